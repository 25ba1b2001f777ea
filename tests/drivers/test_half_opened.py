"""An instrument that cannot be opened leaves no connection behind: nothing for the collector, and the instrument's place is free."""

import gc
import socket
from collections.abc import Iterator
from contextlib import suppress

import pytest
from pyvisa import ResourceManager
from pyvisa_py.protocols import rpc

from drivers.transport.visa.half_opened import sockets_closed_on_failure


@pytest.fixture
def manager() -> Iterator[ResourceManager]:
    made = ResourceManager("@py")
    yield made
    made.close()


@pytest.fixture
def impatient(monkeypatch: pytest.MonkeyPatch) -> None:
    """PyVISA-py waits 5 s for a first answer by HiSLIP, 4 s by VXI-11, and lets nobody set either."""
    settle, receive = socket.socket.settimeout, rpc._recvrecord
    monkeypatch.setattr(
        socket.socket, "settimeout", lambda one, time: settle(one, None if time is None else min(time, 0.3))
    )
    monkeypatch.setattr(rpc, "_recvrecord", lambda one, time, **more: receive(one, min(time, 0.3), **more))


def sockets() -> list[socket.socket]:
    return [one for one in gc.get_objects() if isinstance(one, socket.socket) and one.fileno() >= 0]


@pytest.mark.usefixtures("impatient")
@pytest.mark.parametrize("form", ["TCPIP0::127.0.0.1::hislip0,{}::INSTR", "TCPIP0::127.0.0.1,{}::inst0::INSTR"])
@pytest.mark.parametrize("listens", [True, False])
def test_nothing_is_left_open(manager: ResourceManager, form: str, listens: bool) -> None:
    with socket.create_server(("127.0.0.1", 0)) as server:
        port = server.getsockname()[1]
        if listens:
            server.settimeout(10.0)
        else:
            server.close()
        before = sockets()
        failed: BaseException | None = None
        try:
            with sockets_closed_on_failure():
                manager.open_resource(form.format(port), open_timeout=200)
        except Exception as error:  # noqa: BLE001  PyVISA-py raises plain exceptions, too
            failed = error
        assert failed is not None
        assert [one for one in sockets() if one not in before] == []
        if listens:
            with server.accept()[0] as taken:
                taken.settimeout(10.0)
                # The other side has hung up, whatever it said before.
                with suppress(ConnectionResetError):
                    while taken.recv(1000):
                        continue
