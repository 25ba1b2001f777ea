"""The guardian is there at once and stays small: it computes nothing, so it loads no numerical library, its instruments connected."""

import signal
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

HEAVY = ("numpy", "scipy", "GTC", "h5py", "matplotlib", "sim_instruments")


def test_what_the_guardian_loads_to_start() -> None:
    code = f"import sys; import bench.safety.guardian.__main__; print([n for n in {HEAVY} if n in sys.modules])"
    content = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert content.stdout.strip() == "[]"


def test_what_it_has_loaded_when_it_guards(hold: Callable[..., Any], served: Any) -> None:
    run = hold("wait")
    assert {event.kind for event in run.guardian} >= {"ready"}
    loaded = Path(f"/proc/{run.guardian_pid}/maps").read_text(encoding="utf-8")
    assert not [line for line in loaded.splitlines() if "/numpy/" in line or "/scipy/" in line]
    run.signal(signal.SIGKILL)
    run.guardian_left()
