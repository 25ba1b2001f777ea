"""Real connections that the instrument ends."""

import socket
import threading
from collections.abc import Iterator

import pytest
import pyvisa

from bench.station.clock import SystemClock
from drivers.catalogue import Surroundings
from drivers.interfaces import CommunicationError
from drivers.transport.visa.opening import open_session


@pytest.fixture
def passing() -> Iterator[str]:
    """An instrument that answers one *IDN? and hangs up; its address."""
    server = socket.create_server(("127.0.0.1", 0))

    def answer() -> None:
        connection, _ = server.accept()
        with connection:
            connection.recv(100)
            connection.sendall(b"ACME,ONE,1,1\n")

    thread = threading.Thread(target=answer)
    thread.start()
    yield f"TCPIP0::127.0.0.1::{server.getsockname()[1]}::SOCKET"
    thread.join(5.0)
    server.close()


def test_a_socket_that_was_hung_up_is_an_error_and_no_endless_loop(passing: str) -> None:
    session = open_session(
        passing, Surroundings(SystemClock(), lambda: pyvisa.ResourceManager("@py")), "supply", timeout=0.2
    )
    try:
        assert session.identity_line() == "ACME,ONE,1,1"
        for _ in range(2):
            with pytest.raises(CommunicationError, match="supply"):
                session.query("VOLT?")
    finally:
        session.close()
