"""The origin of workers: a process that has loaded what they need, and forks one on request.

Loading takes longer than a short measurement; forking takes nothing. Nothing is measured here, and there is one thread, so
that nothing is under way that a fork would cut in two. `python -m bench.eol.line.workers.fork_server DESCRIPTOR` is how the
coordinator's side (`bench.eol.line.workers.worker_process`) starts it.
"""

import gc
import os
import select
import signal
import socket
import sys
import traceback
from contextlib import suppress
from multiprocessing.connection import Connection
from typing import NoReturn

#: A worker's descriptors, in the order in which they come: its connection, its lifeline, the workers' shared memory, its report,
#: and what holds the batch's claims where it has any.
DESCRIPTORS = 5


def main() -> None:
    """Fork a worker for each message, and report how each ended, until nobody is there to ask for more."""
    # Ctrl-C is the coordinator's to take; it says what to do.
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # Heavy from here on.
    import bench.eol.line.workers.worker  # noqa: F401
    from bench.plugins.catalogues import installed
    from sim_instruments.catalogue import preload

    preload()
    list(installed().procedures)
    gc.freeze()
    _ForkLoop(socket.socket(fileno=int(sys.argv[1]))).run()


class _ForkLoop:
    """Waits for requests, and for workers to end."""

    def __init__(self, requests: socket.socket) -> None:
        self._requests = requests
        self._reports: dict[int, socket.socket] = {}
        self._ended, self._wake = os.pipe()
        for end in (self._ended, self._wake):
            os.set_blocking(end, False)
        signal.set_wakeup_fd(self._wake, warn_on_full_buffer=False)
        signal.signal(signal.SIGCHLD, lambda *_: None)

    def run(self) -> None:
        sources: list[socket.socket | int] = [self._requests, self._ended]
        while True:
            ready, _, _ = select.select(sources, [], [])
            if self._ended in ready:
                os.read(self._ended, 512)
                self._reap()
            if self._requests in ready:
                message, descriptors, _, _ = socket.recv_fds(self._requests, 1, DESCRIPTORS)
                if not message:
                    return
                self._fork(*descriptors)

    def _fork(self, connection: int, lifeline: int, status: int, report: int, owner: int = -1) -> None:
        reporting = socket.socket(fileno=report)
        pid = os.fork()
        if pid == 0:
            reporting.close()
            self._become_worker(connection, lifeline, status, owner)
        for descriptor in (connection, lifeline, status, owner):
            if descriptor >= 0:
                os.close(descriptor)
        self._reports[pid] = reporting
        handle = os.pidfd_open(pid)
        with suppress(OSError):
            socket.send_fds(reporting, [b"b"], [handle])
        os.close(handle)

    def _become_worker(self, connection: int, lifeline: int, status: int, owner: int) -> NoReturn:
        from bench.eol.line.workers.worker import work

        exit_status = 1
        try:
            signal.set_wakeup_fd(-1)
            signal.signal(signal.SIGCHLD, signal.SIG_DFL)
            # The others' reports end with the fork server, whoever else is there.
            for one in (self._requests, *self._reports.values()):
                one.close()
            for end in (self._ended, self._wake):
                os.close(end)
            os.setsid()
            work(Connection(connection), lifeline, status, owner)
            exit_status = 0
        except BaseException:  # noqa: BLE001  nothing of the fork server's may run in a worker
            traceback.print_exc()
        finally:
            for stream in (sys.stdout, sys.stderr):
                with suppress(OSError, ValueError):
                    stream.flush()
            # Whatever a library has left running must not keep it here.
            os._exit(exit_status)

    def _reap(self) -> None:
        for pid in list(self._reports):
            ended, status = os.waitpid(pid, os.WNOHANG)
            if ended == pid:
                with self._reports.pop(pid) as report, suppress(OSError):
                    report.send(b"%d" % os.waitstatus_to_exitcode(status))


if __name__ == "__main__":
    main()
