"""The panel is there at once: what measures, evaluates and draws is loaded by the processes that need it."""

import subprocess
import sys

HEAVY = ("GTC", "scipy", "h5py", "matplotlib", "pyvisa", "pymodbus", "canopen", "sqlalchemy", "sim_instruments")


def test_what_the_panel_loads_to_start() -> None:
    content = subprocess.run(
        [sys.executable, "-c", f"import sys; import bench.panel.app; print([n for n in {HEAVY} if n in sys.modules])"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert content.stdout.strip() == "[]"
