"""Linear algebra takes one thread, here and in the processes that are started from here, unless the user's environment says otherwise."""

import os
import subprocess
import sys

import pytest

_COUNTED = """
import os, sys
from motorbench.__main__ import main
assert "numpy" not in sys.modules
sys.argv = ["motorbench", "--version"]
try:
    main()
except SystemExit:
    pass
import numpy
print(os.environ["OPENBLAS_NUM_THREADS"], len(os.listdir("/proc/self/task")))
"""
_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


@pytest.mark.skipif(sys.platform != "linux", reason="counts the threads in /proc")
@pytest.mark.parametrize("chosen", [None, "3"])
def test_one_thread_unless_others_are_asked_for(chosen: str | None) -> None:
    environment = {name: value for name, value in os.environ.items() if name not in _VARIABLES}
    if chosen is not None:
        environment["OPENBLAS_NUM_THREADS"] = chosen
    done = subprocess.run([sys.executable, "-c", _COUNTED], env=environment, capture_output=True, text=True, check=True)
    asked, threads = done.stdout.split()[-2:]
    assert asked == (chosen or "1")
    # They are made when the library is loaded, as many as there are cores for.
    assert int(threads) == min(int(asked), len(os.sched_getaffinity(0)))
