"""Calls of mbpoll, a program of its own, on the Modbus lines: registers read and written, a coil, over TCP and on the terminal."""

import re
import subprocess
from urllib.parse import urlsplit

from calls import Calls, address

_PORT = str(urlsplit(address("dynamometer", "tcp")).port)
_TERMINAL = address("dynamometer", "rtu").removeprefix("rtu://").partition("?")[0]
_VALUE = re.compile(r"^\[(\d+)\]:\s+(-?\d+)", re.MULTILINE)


def poll(way: str, unit: int, table: str, start: int, *words: str) -> dict[int, int]:
    """Have mbpoll do one thing, and return the registers that it shows."""
    how = ["-m", "tcp", "-p", _PORT] if way == "tcp" else ["-m", "rtu", "-b", "9600", "-P", "none"]
    where, values = ("127.0.0.1" if way == "tcp" else _TERMINAL), [word for word in words if word.isdigit()]
    options = [word for word in words if not word.isdigit()]
    command = ["mbpoll", *how, "-a", str(unit), "-t", table, "-r", str(start), "-0", "-1", *options, where, *values]
    done = subprocess.run(command, capture_output=True, text=True, timeout=10.0, check=True)
    if "failed" in done.stderr:
        raise RuntimeError(done.stderr.strip())
    return {int(register): int(value) for register, value in _VALUE.findall(done.stdout)}


calls = Calls("mbpoll")
DRIVE, SENSOR = 1, 2
calls.make("sensor, TCP: 6 registers", lambda: poll("tcp", SENSOR, "4", 0, "-c6"), lambda found: len(found) == 6)
calls.make("sensor, TCP: coil 0", lambda: poll("tcp", SENSOR, "0", 0, "1"))
calls.make("drive, TCP: identity", lambda: poll("tcp", DRIVE, "4", 0), lambda found: found == {0: 6})
calls.make("drive, TCP: write 2001H", lambda: poll("tcp", DRIVE, "4", 0x2001, "1000"))
calls.make("drive, RTU: read 2102H", lambda: poll("rtu", DRIVE, "4", 0x2102), lambda found: found == {0x2102: 1000})
calls.make("sensor, RTU: 6 registers", lambda: poll("rtu", SENSOR, "4", 0, "-c6"), lambda found: len(found) == 6)
