"""VXI-11 to the letter: what PyVISA-py's core client and bare sockets are answered."""

import socket
import struct
import threading
from collections.abc import Iterator
from contextlib import closing
from typing import Any

import pytest
from pyvisa_py.tcpip import Vxi11CoreClient

from sim_instruments.faults.line_faults import Fault
from sim_instruments.server.served_bench import ServedBench
from tests.sim_instruments.server import wires

END, WAIT, TERMINATED = 0x08, 0x01, 0x80
CORE, ABORT = 0x0607AF, 0x0607B0


@pytest.fixture
def port(bench: ServedBench) -> int:
    return wires.port_of(bench.addresses()["voltmeter"]["vxi11"])


@pytest.fixture
def core(port: int) -> Iterator[Any]:
    with closing(Vxi11CoreClient("127.0.0.1", port)) as client:
        client.sock.settimeout(10.0)
        yield client


def linked(core: Any, locked: int = 0) -> int:
    error, link, _, longest = core.create_link(1, locked, 0, "inst0")
    assert (error, longest) == (0, 1 << 16)
    return int(link)


def write(core: Any, link: int, message: bytes, flags: int = END) -> Any:
    return core.device_write(link, 1000, 0, flags, message)


def numbers(*values: int) -> bytes:
    return struct.pack(f"!{len(values)}I", *values)


def call(connection: socket.socket, program: int, procedure: int, parameters: bytes, version: int = 1) -> bytes:
    """Make a call in fragments of one byte and the rest, and return what follows the head of its reply."""
    content = numbers(7, 0, 2, program, version, procedure) + bytes(16) + parameters
    connection.sendall(numbers(1) + content[:1] + numbers(1 << 31 | len(content) - 1) + content[1:])
    reply = record(connection)
    assert reply[:24] == numbers(7, 1, 0, 0, 0, 0)
    return reply[24:]


def record(connection: socket.socket) -> bytes:
    (mark,) = struct.unpack("!I", wires.exactly(connection, 4))
    return wires.exactly(connection, mark & 0x7FFFFFFF)


def test_a_message_comes_and_goes_in_pieces(core: Any) -> None:
    link = linked(core)
    assert write(core, link, b"*CLS;*ID", 0) == (0, 8)
    assert write(core, link, b"N?;*OPC?\n") == (0, 9)
    error, reason, data = core.device_read(link, 8, 1000, 0, 0, 0)
    assert (error, reason, data) == (0, 1, b"Keysight")
    error, reason, data = core.device_read(link, 100, 1000, 0, TERMINATED, ord(","))
    assert (error, reason, data) == (0, 2, b" Technologies,")
    error, reason, data = core.device_read(link, 1000, 1000, 0, 0, 0)
    assert (error, reason) == (0, 4)
    assert data.endswith(b";1\n")
    assert core.device_read(link, 10, 50, 0, 0, 0)[0] == 15
    write(core, link, b"SYST:ERR?")
    assert core.device_read(link, 100, 1000, 0, 0, 0)[2].startswith(b"-420")
    assert core.device_remote(link, 0, 0, 0) == core.device_local(link, 0, 0, 0) == 0
    assert core.device_trigger(link, 0, 0, 1000) == 0
    write(core, link, b"SYST:ERR?")
    assert core.device_read(link, 100, 1000, 0, 0, 0)[2].startswith(b"-211")


def test_half_a_reply_has_no_end_and_too_long_a_message_is_dropped(bench: ServedBench, core: Any) -> None:
    link = linked(core)
    bench.bench.faults("voltmeter").add(Fault.on("half", r"\*IDN"))
    write(core, link, b"*CLS;*IDN?")
    assert core.device_read(link, 1000, 1000, 0, 0, 0)[:2] == (0, 0)
    assert core.device_read(link, 1000, 50, 0, 0, 0)[0] == 15
    assert core.device_clear(link, 0, 0, 1000) == 0
    for flags in (0, END):
        write(core, link, b"*CLS;" * 8000, flags)
    write(core, link, b"SYST:ERR?")
    assert core.device_read(link, 100, 1000, 0, 0, 0)[2].startswith(b"-363")


def test_a_lock_is_one_with_hislip_and_ends_with_its_link(bench: ServedBench, core: Any) -> None:
    first, second = linked(core, 1), linked(core)
    assert (
        write(core, second, b"*CLS")[0]
        == core.device_lock(second, WAIT, 20)
        == core.device_clear(second, 0, 0, 9)
        == 11
    )
    assert core.device_unlock(second) == 12
    with wires.visa(bench.addresses()["voltmeter"]["hislip"], timeout=0.2) as other:
        with pytest.raises(Exception, match="VI_ERROR_TMO"):
            other.query("*IDN?")
        assert core.destroy_link(first) == 0
        assert write(core, first, b"*CLS")[0] == core.destroy_link(first) == 4
        other.timeout = 5000
        assert write(core, second, b"*CLS") == (0, 4)
        assert core.device_unlock(second) == 12


def test_an_abort_ends_a_call_that_waits(port: int, core: Any) -> None:
    link = linked(core)
    ended: list[Any] = []
    reading = threading.Thread(target=lambda: ended.append(core.device_read(link, 10, 60_000, 0, 0, 0)[0]))
    reading.start()
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as aborting:
        # An abort that comes before the call finds nothing to end.
        while not ended:
            assert call(aborting, ABORT, 1, numbers(link)) == numbers(0)
            reading.join(0.01)
        assert call(aborting, ABORT, 1, numbers(link + 1000)) == numbers(4)
    reading.join()
    assert ended == [23]
    assert write(core, link, b"*CLS") == (0, 4)


def test_service_is_asked_for_on_the_interrupt_channel(port: int) -> None:
    with (
        socket.create_server(("127.0.0.1", 0)) as server,
        socket.create_connection(("127.0.0.1", port), timeout=10.0) as client,
    ):
        link = struct.unpack("!4I", call(client, CORE, 10, numbers(1, 0, 0, 5) + b"inst0\0\0\0"))[1]
        back = 0x7F000001, server.getsockname()[1], 0x0607B1, 1
        assert call(client, CORE, 26, b"") == numbers(6)
        assert call(client, CORE, 25, numbers(0x7F000002, *back[1:], 0)) == numbers(21)
        assert call(client, CORE, 25, numbers(*back, 1)) == numbers(8)
        assert call(client, CORE, 25, numbers(*back, 0)) == numbers(0)
        assert call(client, CORE, 25, numbers(*back, 0)) == numbers(29)
        channel, _ = server.accept()
        with channel:
            channel.settimeout(10.0)
            assert call(client, CORE, 20, numbers(link, 1, 3) + b"abc\0") == numbers(0)
            message = b"*CLS;*SRE 32;*ESE 32;NONSENSE"
            call(client, CORE, 11, numbers(link, 1000, 0, END, len(message)) + message + b"\0\0\0")
            asked = record(channel)
            assert asked[4:24] == numbers(0, 2, 0x0607B1, 1, 30)
            assert asked.endswith(numbers(3) + b"abc\0")
            assert call(client, CORE, 13, numbers(link, 0, 0, 0)) == numbers(0, 0x64)
            assert call(client, CORE, 20, numbers(link, 0, 0)) == numbers(0)
            assert call(client, CORE, 26, b"") == numbers(0)
            assert channel.recv(1) == b""


def test_what_is_not_there_is_refused(port: int) -> None:
    with socket.create_connection(("127.0.0.1", port), timeout=10.0) as client:
        assert call(client, CORE, 0, b"") == b""
        assert call(client, CORE, 10, numbers(1, 0, 0, 5) + b"inst1\0\0\0") == numbers(3, 0, 0, 0)
        assert call(client, CORE, 22, bytes(40)) == numbers(8, 0)
        for program, procedure, parameters, version, outcome in (
            (CORE, 10, b"\0", 1, 4),
            (CORE, 99, b"", 1, 3),
            (ABORT, 10, b"", 1, 3),
            (CORE, 10, b"", 2, 2),
            (100_000, 3, b"", 2, 1),
        ):
            content = numbers(8, 0, 2, program, version, procedure) + bytes(16) + parameters
            client.sendall(numbers(1 << 31 | len(content)) + content)
            assert record(client)[:24] == numbers(8, 1, 0, 0, 0, outcome)
    for nonsense in (b"GET / HTTP/1.1\r\n\r\n", numbers(0), numbers(1 << 31 | 4) + b"abcd", b"\xff" * 8):
        with socket.create_connection(("127.0.0.1", port), timeout=10.0) as client:
            client.sendall(nonsense)
            assert client.recv(1) == b""
