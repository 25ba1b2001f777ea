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


def test_its_sockets_load_no_client() -> None:
    begin = "from bench.panel.server.socket_server import load_socket_server; load_socket_server(); import bench.panel.app, sys; "
    content = subprocess.run(
        [sys.executable, "-c", begin + "print('aiohttp' in sys.modules, 'tornado' in sys.modules); import aiohttp"],
        capture_output=True,
        text=True,
        check=True,
    )
    assert content.stdout.strip() == "False False"
