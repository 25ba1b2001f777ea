"""One socket's worker process, as the coordinator sees it."""

import os
import signal
import socket
import subprocess
import sys
from contextlib import suppress
from dataclasses import replace
from multiprocessing.connection import Connection
from pathlib import Path

from bench.eol.line.messages import Setup, ToWorker

_ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
#: How long (s) a worker that has nothing to do may take to leave.
_LEAVE = 5.0


class WorkerProcess:
    """A started worker: `connection` to it, and `lifeline`, which ends when both it and its guardian are gone."""

    def __init__(self, make: "SetupMaker", times: int) -> None:
        ours, theirs = socket.socketpair()
        self.lifeline, far = os.pipe()
        self._process = subprocess.Popen(  # noqa: S603  this program's own
            [sys.executable, "-P", "-m", "bench.eol.line.worker", str(theirs.fileno())],
            pass_fds=(theirs.fileno(), far, times),
            env={**os.environ, **_ONE_THREAD, "PYTHONPATH": str(Path(__file__).parents[3])},
            # Ctrl-C at the terminal is the coordinator's to take.
            start_new_session=True,
        )
        theirs.close()
        os.close(far)
        self.connection = Connection(ours.detach())
        self.send(make(far))

    @property
    def pid(self) -> int:
        """The worker's process."""
        return self._process.pid

    def send(self, message: ToWorker | Setup) -> None:
        """Tell it something; one that has died is heard of on its connection."""
        with suppress(OSError):
            self.connection.send(message)

    def kill(self) -> None:
        """End it as nothing else can."""
        self._process.kill()

    def close(self) -> str:
        """Wait for its end, and say how that was, empty where it left by itself; the lifeline is let go of."""
        self.connection.close()
        os.close(self.lifeline)
        try:
            code = self._process.wait(_LEAVE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()
            return "did not leave and was ended"
        if code < 0:
            return f"was ended by {signal.Signals(-code).name}"
        return f"ended with status {code}" if code else ""


class SetupMaker:
    """Makes a worker's first message, given the number of the lifeline's descriptor in its process."""

    def __init__(self, setup: Setup) -> None:
        self._setup = setup

    def __call__(self, lifeline: int) -> Setup:
        """Return the message."""
        return replace(self._setup, place=replace(self._setup.place, lifeline=lifeline))
