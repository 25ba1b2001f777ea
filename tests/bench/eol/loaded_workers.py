"""A line's fork server that is itself forked from a process that has loaded what it needs: as started, but for the seconds of that."""

import os
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from unittest.mock import patch

from bench.eol.line import batch
from bench.eol.line.workers import fork_server
from bench.eol.line.workers.worker_process import ForkServer
from tests.studies.forked import Descriptors, Forked


class LoadedForkServer(ForkServer):
    """Forks workers as the product's does."""

    def _start(self) -> None:
        self._requests, theirs = socket.socketpair()
        with theirs:
            self._process = _Process(_serve, Descriptors(theirs.fileno()))


class _Process(Forked):
    def wait(self, timeout: float | None = None) -> None:
        self.join(timeout)
        if self.returncode is None:
            raise subprocess.TimeoutExpired("fork_server", timeout or 0.0)
        self.close()

    def kill(self) -> None:
        self.close()


def _serve(received: Descriptors) -> None:
    os.setsid()
    sys.argv = ["fork_server", str(received[0].detach())]
    fork_server.main()


@contextmanager
def loaded_workers() -> Iterator[None]:
    """Have batches that are begun within take their workers from there."""
    with patch.object(batch, "ForkServer", LoadedForkServer):
        yield
