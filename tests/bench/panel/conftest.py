import os
import shutil
import signal
import socket
import ssl
import threading
import time
import urllib.error
import urllib.request
import weakref
from pathlib import Path

from argon2 import PasswordHasher

from tests.bench.panel.served import serve
from tests.studies.forked import Forked

#: A server has begun, and has ended, within this time (s), however busy the machine.
PATIENCE = 60.0
#: Hashes that cost nothing: whoever checks a password takes time and memory from its hash.
QUICK = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
#: Without a browser's own surface where that is installed: it takes a quarter less of the processor.
CHROMIUM = next(filter(None, map(shutil.which, ("chromium-headless-shell", "chromium", "chromium-browser"))), None)
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
    # Pages live for seconds: machine code for what runs often, and tidying up, come too late to spare anything.
    "--js-flags=--no-maglev --no-turbofan --min-semi-space-size=64 --initial-heap-size=512",
]


class Server:
    """`motorbench serve` in a process of its own, which can be started again."""

    def __init__(self, runs: Path, *options: str) -> None:
        self.runs = runs
        self.options = options
        # Kept to the end, between two starts, too: the system gives a port that is bound to nobody else, and who names it may listen.
        kept = socket.socket()
        kept.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        kept.bind(("127.0.0.1", 0))
        weakref.finalize(self, kept.close)
        self.port = kept.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}"
        self._process: Forked | None = None

    def start(self) -> None:
        # NiceGUI behaves in another way where it believes that it is itself under test.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
        words = ("--port", str(self.port), "--runs", str(self.runs), *self.options)
        self._process = Forked(serve, *words, environment=environment)
        deadline = time.monotonic() + PATIENCE
        while time.monotonic() < deadline:
            if self._process.returncode is not None:
                raise AssertionError(f"the server ended: {self._process.communicate(timeout=5)}")
            try:
                self._ask()
            # A server that accepts and is held up before it answers is no URLError.
            except (urllib.error.URLError, TimeoutError):
                threading.Event().wait(0.05)
            else:
                return
        raise AssertionError("the server did not start")

    def _ask(self) -> None:
        tls = "--certificate" in self.options
        url = self.url.replace("http:", "https:") if tls else self.url
        # The tests of TLS look at the certificate themselves.
        context = ssl._create_unverified_context() if tls else None  # noqa: S323
        urllib.request.urlopen(url, timeout=5, context=context).close()  # noqa: S310  our own server

    def stop(self) -> str:
        assert self._process is not None
        self._process.send_signal(signal.SIGTERM)
        _, message = self._process.communicate(timeout=PATIENCE)
        self._process.close()
        return message

    def kill(self) -> None:
        """End it as no program can prepare for."""
        assert self._process is not None
        self._process.send_signal(signal.SIGKILL)
        self._process.communicate(timeout=PATIENCE)
        self._process.close()

    def pass_an_hour(self) -> None:
        """Move the sessions' clock on, before the next request; two without one between may be one."""
        assert self._process is not None
        self._process.send_signal(signal.SIGUSR1)

    @property
    def pid(self) -> int:
        assert self._process is not None
        return self._process.pid
