"""Places where a scan looks: sockets and pseudo-terminals that answer as a test says."""

import os
import pty
import socket
import threading
import time
import tty
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from bench.discovery.findings import ScanReport
from bench.discovery.inquiry import Inquiry
from bench.discovery.matching import KnownInstruments
from bench.discovery.scan import ScanRequest, scan
from bench.plugins.catalogues import installed
from bench.safety.ownership.owner import Unowned
from bench.station.clock import SystemClock
from bench.station.computer import Computer
from bench.station.visa_library import StationVisa
from drivers.catalogue import Driver

OURS = [driver for drivers in installed().drivers.values() for driver in drivers]


class Nowhere(Computer):
    """A computer with what a test names and nothing else."""

    def __init__(self, ports: dict[str, bool] | None = None) -> None:
        super().__init__(Path("/nonexistent"))
        self._ports = ports or {}

    def serial_ports(self) -> dict[str, bool]:
        return self._ports


def inquiry(
    drivers: list[Driver] | None = None, *, seconds: float = 20.0, owner: Any = None, say: Any = None
) -> Inquiry:
    known = KnownInstruments(OURS if drivers is None else drivers)
    return Inquiry(SystemClock(), seconds, known, owner or Unowned(), say or (lambda _: None))


def looked(request: ScanRequest, *, say: Any = None, computer: Computer | None = None) -> ScanReport:
    return scan(
        request,
        OURS,
        clock=SystemClock(),
        owner=Unowned(),
        visa=StationVisa("@py"),
        computer=computer or Nowhere(),
        say=say or (lambda _: None),
    )


@contextmanager
def listening(answer: Callable[[socket.socket], None]) -> Iterator[int]:
    """A socket on which each who connects is served by `answer`; gives its port."""
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            while True:
                try:
                    line, _ = server.accept()
                except OSError:
                    return
                with line, suppress(OSError):
                    answer(line)

        thread = threading.Thread(target=serve, daemon=True)
        thread.start()
        yield server.getsockname()[1]
        with suppress(OSError):
            server.shutdown(socket.SHUT_RDWR)
    thread.join()


def answering(data: bytes, *, late: float = 0.0) -> Callable[[socket.socket], None]:
    def answer(line: socket.socket) -> None:
        assert line.recv(100) == b"*IDN?\n"
        time.sleep(late)  # noqa: TID251  a slow instrument
        line.sendall(data)
        line.recv(100)

    return answer


@contextmanager
def terminal() -> Iterator[tuple[int, str]]:
    """A pseudo-terminal: its master's descriptor, and the path of its port."""
    master, slave = pty.openpty()
    tty.setraw(slave)
    try:
        yield master, os.ttyname(slave)
    finally:
        os.close(master)
        os.close(slave)


@contextmanager
def talking(master: int, data: bytes) -> Iterator[None]:
    """What is behind the port sends, again and again, while the block lasts."""
    done = threading.Event()

    def talk() -> None:
        while not done.wait(0.02):
            os.write(master, data)

    thread = threading.Thread(target=talk)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def written(master: int) -> bytes:
    os.set_blocking(master, False)
    try:
        return os.read(master, 1000)
    except BlockingIOError:
        return b""
