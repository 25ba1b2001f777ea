"""The processes of a line, as the coordinator sees them: the fork server, and a worker for each socket forked from it."""

import os
import select
import signal
import socket
import subprocess
import sys
from collections.abc import Sequence
from contextlib import suppress
from multiprocessing.connection import Connection
from pathlib import Path

from bench.eol.line.workers.messages import ToWorker, WorkerSetup
from drivers.interfaces.text import Text, text

_ONE_THREAD = dict.fromkeys(("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"), "1")
#: How long (s) a worker that has nothing to do may take to leave, and the fork server to report an end that has come.
_LEAVE = 5.0


class ForkServer:
    """A process that forks workers; it is started at once, and again where it has died. Close it after use."""

    def __init__(self) -> None:
        self._start()

    @property
    def pid(self) -> int:
        """The process's identifier, the workers' parent."""
        return self._process.pid

    def fork(self, descriptors: list[int]) -> None:
        """Fork a worker that gets these descriptors (`bench.eol.line.workers.fork_server.DESCRIPTORS`)."""
        try:
            socket.send_fds(self._requests, [b"w"], descriptors)
        except OSError:
            self.close()
            self._start()
            socket.send_fds(self._requests, [b"w"], descriptors)

    def close(self) -> None:
        """End it; workers that are there go on."""
        self._requests.close()
        try:
            self._process.wait(_LEAVE)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _start(self) -> None:
        self._requests, theirs = socket.socketpair()
        with theirs:
            # Plug-ins that this process finds by its PYTHONPATH are there for the workers, too.
            paths = [str(Path(__file__).parents[4]), os.environ.get("PYTHONPATH", "")]
            self._process = subprocess.Popen(  # noqa: S603  this program's own
                [sys.executable, "-P", "-m", "bench.eol.line.workers.fork_server", str(theirs.fileno())],
                pass_fds=(theirs.fileno(),),
                env={**os.environ, **_ONE_THREAD, "PYTHONPATH": os.pathsep.join(filter(None, paths))},
                # Ctrl-C at the terminal is the coordinator's to take.
                start_new_session=True,
            )


class WorkerProcess:
    """A started worker: `connection` to it, and `lifeline`, which ends when both it and its guardian are gone.

    It gets copies of the descriptors `status` and `owner`.
    """

    def __init__(self, fork_server: ForkServer, setup: WorkerSetup, status: int, owner: Sequence[int] = ()) -> None:
        ours, theirs = socket.socketpair()
        self.lifeline, far = os.pipe()
        self._report, reporting = socket.socketpair(type=socket.SOCK_SEQPACKET)
        self._report.settimeout(_LEAVE)
        try:
            fork_server.fork([theirs.fileno(), far, status, reporting.fileno(), *owner])
        finally:
            theirs.close()
            os.close(far)
            reporting.close()
        self._pidfd: int | None = None
        self.connection = Connection(ours.detach())
        self.send(setup)

    def send(self, message: ToWorker) -> None:
        """Send it a message; that one has died is seen on its connection."""
        with suppress(OSError):
            self.connection.send(message)

    def kill(self) -> None:
        """End it as it is, stopped or not; its guardian, where it has one, goes on until all is off."""
        handle = self._handle()
        if handle is not None:
            with suppress(ProcessLookupError):
                signal.pidfd_send_signal(handle, signal.SIGKILL)

    def close(self) -> Text | None:
        """Wait for its end, and say how that was, None where it left by itself; the lifeline is closed."""
        self.connection.close()
        os.close(self.lifeline)
        with self._report:
            handle = self._handle()
            if handle is None:
                return text("did not start")
            try:
                left = bool(select.select([handle], [], [], _LEAVE)[0])
                if not left:
                    signal.pidfd_send_signal(handle, signal.SIGKILL)
            finally:
                os.close(handle)
            how = self._status()
        return how if left else text("did not end and was terminated")

    def _handle(self) -> int | None:
        """Return the process, as a descriptor that becomes readable at its end; None where it never began."""
        if self._pidfd is None:
            with suppress(OSError):
                _, descriptors, _, _ = socket.recv_fds(self._report, 1, 1)
                self._pidfd = descriptors[0] if descriptors else None
        return self._pidfd

    def _status(self) -> Text | None:
        status = b""
        with suppress(OSError):
            status = self._report.recv(16)
        if not status:
            return text("ended, and the fork server did not report how")
        code = int(status)
        if code < 0:
            return text("was ended by {signal}", signal=signal.Signals(-code).name)
        return text("ended with status {code}", code=code) if code else None
