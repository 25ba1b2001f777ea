"""`motorbench serve` for tests: its runs and commands are forked from a process that has loaded what they need.

Its sessions' clock goes on by an hour at SIGUSR1, so that no test waits for the end of a session; a database that is locked is
waited for no longer than a second.
"""

import asyncio
import ctypes
import json
import multiprocessing
import os
import signal
import socket
import sys
import time
from collections.abc import Sequence
from functools import partial, partialmethod
from pathlib import Path
from types import FrameType

from bench.eol.store import database
from bench.panel import launch
from bench.panel.server import sessions
from tests.studies.forked import motorbench

#: How far (s) the sessions' clock goes on at SIGUSR1.
JUMP = 3600.0
_PR_SET_CHILD_SUBREAPER = 36


def serve(*words: str) -> None:
    """Do what `motorbench serve` does with these words."""
    if ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_CHILD_SUBREAPER, 1, 0, 0, 0):
        raise OSError(ctypes.get_errno(), "prctl")
    database._PATIENCE = 1
    ours, theirs = socket.socketpair(socket.AF_UNIX, socket.SOCK_SEQPACKET)
    # Forked before the server begins: no thread and no event loop is there yet.
    if os.fork() == 0:
        ours.close()
        _fork_commands(theirs)
    theirs.close()
    launch._spawn = partial(_start_run, ours)
    asyncio.create_subprocess_exec = partial(_start_command, ours)  # type: ignore[assignment]
    clock = _Clock()
    signal.signal(signal.SIGUSR1, clock.go_on)
    sessions.Sessions = type(
        "Sessions", (sessions.Sessions,), {"__init__": partialmethod(sessions.Sessions.__init__, clock=clock)}
    )  # type: ignore[misc]
    motorbench("serve", *words)


class _Clock:
    """A time (s) that only grows, also by jumps."""

    def __init__(self) -> None:
        self._ahead = 0.0

    def __call__(self) -> float:
        return time.monotonic() + self._ahead

    def go_on(self, number: int, frame: FrameType | None) -> None:
        self._ahead += JUMP


def _fork_commands(requests: socket.socket) -> None:
    """Fork a process for each command that is requested, a child of the server, until the server has ended."""
    while True:
        content, streams, _, _ = socket.recv_fds(requests, 1 << 16, 2)
        if not content:
            os._exit(0)
        read, write = os.pipe()
        between = os.fork()
        if between == 0:
            forked = multiprocessing.get_context("fork").Process(
                target=_work, args=(requests, json.loads(content), streams)
            )
            forked.start()
            os.write(write, str(forked.pid).encode())
            os._exit(0)
        # Its parent gone, the process is the server's child.
        os.waitpid(between, 0)
        requests.send(os.read(read, 20))
        for number in (read, write, *streams):
            os.close(number)


def _work(requests: socket.socket, words: list[str], streams: Sequence[int]) -> None:
    requests.close()
    # To what asks, this is a process like any other.
    multiprocessing.current_process().name = "MainProcess"
    os.setsid()
    nothing = os.open(os.devnull, os.O_RDWR)
    for number, stream in enumerate((nothing, *streams)):
        os.dup2(stream, number)
    os.closerange(3, max(nothing, *streams) + 1)
    sys.stdin = os.fdopen(0, encoding="utf-8", closefd=False)
    motorbench(*words)


def _request(server: socket.socket, command: Sequence[str], output: int, errors: int) -> int:
    """Have a command forked, given as `python -P -m motorbench …`; return its process."""
    assert tuple(command[:4]) == (sys.executable, "-P", "-m", "motorbench"), command
    socket.send_fds(server, [json.dumps(command[4:]).encode()], [output, errors])
    return int(server.recv(20))


def _start_run(server: socket.socket, command: list[str], message: int) -> int:
    with Path(os.devnull).open("wb") as nothing:
        return _request(server, command, nothing.fileno(), message)


async def _start_command(server: socket.socket, *command: str, **streams: int) -> "_Command":
    output, errors = os.memfd_create("output"), os.memfd_create("errors")
    return _Command(_request(server, command, output, errors), output, errors)


class _Command:
    """A command as the panel knows it: asyncio's process with pipes to its output and errors."""

    def __init__(self, pid: int, output: int, errors: int) -> None:
        self.pid = pid
        self.returncode: int | None = None
        self._output, self._errors = output, errors

    async def communicate(self) -> tuple[bytes, bytes]:
        await self.wait()
        return _content(self._output), _content(self._errors)

    async def wait(self) -> None:
        _, status = await asyncio.to_thread(os.waitpid, self.pid, 0)
        self.returncode = os.waitstatus_to_exitcode(status)

    def kill(self) -> None:
        os.kill(self.pid, signal.SIGKILL)


def _content(file: int) -> bytes:
    with os.fdopen(file, "rb") as stream:
        stream.seek(0)
        return stream.read()
