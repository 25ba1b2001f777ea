"""The CAN gateway, byte by byte."""

import socket
from collections.abc import Callable, Iterator
from contextlib import ExitStack

import can
import pytest

from sim_instruments.transports.can.buses import fresh_channel, open_bus
from sim_instruments.transports.can.gateway import CanGateway
from sim_instruments.transports.can.slcan import LONGEST, Adapter, LineSplitter, frame_of, line_of
from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.tcp_service import TcpService

Connect = Callable[[], socket.socket]


@pytest.mark.parametrize(
    "line", ["t1230", "t7FF80102030405060708", "T1FFFFFFF3A1B2C3", "T000001230", "r1234", "R000001238"]
)
def test_frames_and_their_lines(line: str) -> None:
    frame = frame_of(line)
    assert frame is not None
    assert line_of(frame) == line.encode() + b"\r"
    assert (frame.is_extended_id, frame.is_remote_frame) == (line[0] in "TR", line[0] in "rR")
    assert frame.arbitration_id == int(line[1:9] if frame.is_extended_id else line[1:4], 16)


@pytest.mark.parametrize(
    ("line", "size", "switched"),
    [
        ("d1230", 0, False),
        ("b5003210002", 3, True),
        ("D1FFFFFFF9" + "5A" * 12, 12, False),
        ("B00008005F" + "01" * 64, 64, True),
    ],
)
def test_frames_of_can_fd_and_their_lines(line: str, size: int, switched: bool) -> None:
    frame = frame_of(line)
    assert frame is not None
    assert line_of(frame) == line.encode() + b"\r"
    assert (frame.is_fd, frame.bitrate_switch, frame.dlc, len(frame.data)) == (True, switched, size, size)
    assert frame.is_extended_id == line[0].isupper()


@pytest.mark.parametrize("line", ["d12390" + "00" * 8, "b8000", "D2000000000", "b123G00", "dABC9" + "00" * 13])
def test_lines_that_are_no_frame_of_can_fd(line: str) -> None:
    assert frame_of(line) is None


@pytest.mark.parametrize(
    "line", ["t8000", "t12", "t1239", "t123201", "t12310102", "T200000000", "r123101", "x", "t12G0"]
)
def test_lines_that_are_no_frame(line: str) -> None:
    assert frame_of(line) is None


def replies(*lines: str) -> list[bytes]:
    adapter = Adapter()
    return [adapter.take(line.encode()).reply for line in lines]


def test_an_adapter_is_opened_before_it_sends() -> None:
    assert replies("", "t1230", "C", "S6", "s031C", "Z0", "O", "O", "S6", "t1230", "C", "t1230") == [
        *(b"", b"\a", b"\a", b"\r", b"\r", b"\r", b"\r", b"\a", b"\a", b"\r", b"\r", b"\a")
    ]
    assert replies("V", "N", "F", "L", "F", "t1230", "?") == [
        b"V1013\r",
        b"NVB01\r",
        b"\a",
        b"\r",
        b"F00\r",
        b"\a",
        b"\a",
    ]


def test_lines_are_cut_and_long_ones_dropped() -> None:
    splitter = LineSplitter()
    assert splitter.feed(b"O\rt12") == [b"O"]
    assert splitter.feed(b"30\r\r") == [b"t1230", b""]
    assert splitter.feed(b"x" * (LONGEST + 1)) == []
    assert splitter.feed(b"y" * 5000) == []
    assert splitter.feed(b"z\rC\r") == [None, b"C"]
    assert splitter.feed(b"x" * (LONGEST + 1) + b"\rC\r") == [None, b"C"]


@pytest.fixture
def connect() -> Iterator[tuple[Connect, str]]:
    """Return how to connect to a gateway, and its bus' channel."""
    with ExitStack() as ending:
        loop = LoopThread("gateway")
        ending.callback(loop.close)
        channel = fresh_channel()
        gateway = CanGateway(channel)
        loop.run(gateway.start())
        ending.callback(lambda: loop.run(gateway.stop()))
        service = TcpService(gateway.serve, "127.0.0.1")
        loop.run(service.start())
        ending.callback(lambda: loop.run(service.stop()))
        yield lambda: ending.enter_context(socket.create_connection(("127.0.0.1", service.port), timeout=5.0)), channel


def said(client: socket.socket, length: int) -> bytes:
    data = b""
    while len(data) < length:
        data += client.recv(length - len(data))
    return data


def test_all_on_the_bus_hear_each_other(connect: tuple[Connect, str]) -> None:
    one, other, closed = connect[0](), connect[0](), connect[0]()
    for client in (one, other):
        client.sendall(b"S6\rO\r")
        assert said(client, 2) == b"\r\r"
    with open_bus(connect[1]) as bus:
        one.sendall(b"t6012AB01\r")
        assert said(one, 1) == b"\r"
        assert said(other, 10) == b"t6012AB01\r"
        heard = bus.recv(5.0)
        assert heard is not None
        assert (heard.arbitration_id, bytes(heard.data)) == (0x601, b"\xab\x01")
        bus.send(can.Message(arbitration_id=0x18FF0001, data=b"\x05", is_extended_id=True))
        assert said(one, 13) == said(other, 13) == b"T18FF0001105\r"
    closed.sendall(b"V\r")
    assert said(closed, 6) == b"V1013\r"


def test_one_that_does_not_read_holds_up_nobody(connect: tuple[Connect, str]) -> None:
    idle, one = connect[0](), connect[0]()
    for client in (idle, one):
        client.sendall(b"O\r")
        assert said(client, 1) == b"\r"
    frame = b"t12388877665544332211\r"
    for _ in range(40):
        one.sendall(frame * 1000)
        assert said(one, 1000) == b"\r" * 1000
