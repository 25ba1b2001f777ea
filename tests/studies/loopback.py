"""A network namespace with the loopback interface alone: how a command is run in one.

As a program, `loopback.py COMMAND…` is the first that runs there: it switches the interface on and becomes the command.
"""

import fcntl
import os
import shutil
import socket
import struct
import subprocess
import sys
from pathlib import Path

# SIOCSIFFLAGS of netdevice(7), and the interface's flags: up and running.
_SET_FLAGS, _UP = 0x8914, 0x1 | 0x40


def with_loopback_only(command: list[str], python: str = sys.executable) -> list[str]:
    """Return the command line that runs `command` as the same user in a namespace of its own, by util-linux' unshare."""
    begin = [python, str(Path(__file__).resolve())]
    if os.geteuid() == 0:
        return ["unshare", "--net", "--", *begin, *command]
    # The right to make one comes with a user namespace in which one is root; the command is an ordinary user again.
    again = ["unshare", "--user", f"--map-user={os.geteuid()}", f"--map-group={os.getegid()}", "--"]
    return ["unshare", "--user", "--map-root-user", "--net", "--", *begin, *again, *command]


def why_not() -> str:
    """Return why no such namespace can be made here, nothing where one can."""
    if shutil.which("unshare") is None:
        return "there is no unshare (util-linux) on this machine"
    tried = subprocess.run(with_loopback_only(["true"]), capture_output=True, text=True, check=False)
    return "" if tried.returncode == 0 else " ".join(tried.stderr.split()) or f"unshare ends with {tried.returncode}"


def switch_on() -> None:
    """Switch the loopback interface of this namespace on. Raises OSError where that is not allowed."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as any_socket:
        fcntl.ioctl(any_socket, _SET_FLAGS, struct.pack("16sH14x", b"lo", _UP))


if __name__ == "__main__":
    switch_on()
    os.execvp(sys.argv[1], sys.argv[1:])  # noqa: S606  the very command that is to run there
