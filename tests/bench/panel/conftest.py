import os
import shutil
import socket
import ssl
import subprocess
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
FLAGS = [
    "--no-sandbox",
    "--disable-gpu",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
]


class Server:
    """`motorbench serve` in a process of its own, which can be started again."""

    def __init__(self, runs: Path, *options: str) -> None:
        self.runs = runs
        self.options = options
        with socket.create_server(("127.0.0.1", 0)) as free:
            self.port = free.getsockname()[1]
        self.url = f"http://127.0.0.1:{self.port}"
        self._process: subprocess.Popen[bytes] | None = None

    def start(self) -> None:
        command = [sys.executable, "-m", "bench", "serve", "--port", str(self.port), "--runs", str(self.runs)]
        # NiceGUI behaves in another way where it believes that it is itself under test.
        environment = {name: value for name, value in os.environ.items() if not name.startswith("PYTEST_")}
        self._process = subprocess.Popen([*command, *self.options], stderr=subprocess.PIPE, env=environment)
        deadline = time.monotonic() + 30
        while time.monotonic() < deadline:
            try:
                self._ask()
            except urllib.error.URLError:
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
        self._process.terminate()
        _, said = self._process.communicate(timeout=20)
        return said.decode()
