"""What tests of the served bench share."""

import json
import socket
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from http.client import HTTPConnection
from typing import Any
from urllib.parse import urlsplit

import pyvisa

from sim_instruments.server.served_bench import ServedBench

FIRST_MESSAGE = 0xFFFFFF00


def port_of(address: object) -> int:
    """The TCP port in any of the bench's addresses."""
    text = str(address)
    if "," in text:
        return int(text.split(",")[1].split("::")[0])
    return int(text.split("::")[2]) if text.endswith("::SOCKET") else int(text.rsplit(":", 1)[1])


@contextmanager
def visa(address: object, timeout: float = 5.0) -> Iterator[Any]:
    """A pyvisa-py session, closed in the end."""
    # PyVISA has one manager for all of a library: closing it would close the others' sessions, too.
    session: Any = pyvisa.ResourceManager("@py").open_resource(str(address))
    session.read_termination = session.write_termination = "\n"
    session.timeout = timeout * 1e3
    try:
        yield session
    finally:
        session.close()


@contextmanager
def stream(address: object) -> Iterator[socket.socket]:
    """A TCP connection to any of the bench's addresses."""
    with socket.create_connection(("127.0.0.1", port_of(address)), timeout=10.0) as connection:
        yield connection


def header(kind: int, control: int = 0, parameter: int = 0, payload: bytes = b"", length: int | None = None) -> bytes:
    """A HiSLIP message, by hand."""
    size = len(payload) if length is None else length
    return struct.pack("!2sBBIQ", b"HS", kind, control, parameter, size) + payload


def message(connection: socket.socket) -> tuple[int, int, int, bytes]:
    """The next HiSLIP message: type, control code, parameter, payload."""
    prologue, kind, control, parameter, length = struct.unpack("!2sBBIQ", exactly(connection, 16))
    assert prologue == b"HS"
    return kind, control, parameter, exactly(connection, length)


def exactly(connection: socket.socket, count: int) -> bytes:
    data = b""
    while len(data) < count:
        more = connection.recv(count - len(data))
        assert more, "hung up"
        data += more
    return data


def ask(bench: ServedBench, method: str, path: str, given: Any = None) -> tuple[int, Any]:
    """A request to the control endpoint: status and answer."""
    body = None if given is None else json.dumps(given)
    return ask_raw(bench, method, path, body, {"Content-Type": "application/json"} if body else {})


def ask_raw(
    bench: ServedBench, method: str, path: str, body: str | bytes | None, headers: dict[str, str]
) -> tuple[int, Any]:
    connection = HTTPConnection("127.0.0.1", urlsplit(bench.control).port or 0, timeout=10.0)
    try:
        connection.request(method, path, body, headers)
        reply = connection.getresponse()
        return reply.status, json.loads(reply.read())
    finally:
        connection.close()
