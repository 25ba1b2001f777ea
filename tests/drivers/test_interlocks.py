"""Interlock contacts: exact bytes, and that whatever is not a clear "closed" is an error or "open"."""

import socket
import socketserver
import threading
from collections.abc import Iterator
from contextlib import suppress

import can
import pytest

from drivers.cia402.options import CanInterlockOptions
from drivers.delta.options import ModbusInterlockOptions
from drivers.interfaces import CommunicationError, Interlock, ReportedError, SetpointError
from drivers.interlocks.catalogue import CAN as CAN_FRAME
from drivers.interlocks.catalogue import MODBUS
from drivers.transport.can.listening import LatestFrame


class Module:
    """A Modbus TCP input module: replies to each request with what `reply` says, by its PDU."""

    def __init__(self) -> None:
        module = self
        self.requests: list[str] = []
        self.reply = b""
        self._connections: list[socket.socket] = []

        class Handler(socketserver.BaseRequestHandler):
            def handle(self) -> None:
                module._connections.append(self.request)
                with suppress(OSError):
                    while frame := self.request.recv(256):
                        module.requests.append(frame[6:].hex(" "))
                        if module.reply:
                            head = frame[:4] + (len(module.reply) + 1).to_bytes(2, "big") + frame[6:7]
                            self.request.sendall(head + module.reply)

        self._server = socketserver.ThreadingTCPServer(("127.0.0.1", 0), Handler)
        self.address = f"tcp://127.0.0.1:{self._server.server_address[1]}"
        self._thread = threading.Thread(target=self._server.serve_forever, args=(0.01,))
        self._thread.start()

    def hang_up(self) -> None:
        while self._connections:
            with suppress(OSError):
                self._connections.pop().shutdown(socket.SHUT_RDWR)

    def close(self) -> None:
        if self._thread.is_alive():
            self._server.shutdown()
            self._thread.join()
            self.hang_up()
            self._server.server_close()


@pytest.fixture
def module() -> Iterator[Module]:
    made = Module()
    yield made
    made.close()


@pytest.fixture
def opened() -> Iterator[list[Interlock]]:
    made: list[Interlock] = []
    yield made
    for interlock in made:
        interlock.close()
        interlock.close()


InterlockOptions = ModbusInterlockOptions | CanInterlockOptions


def open_interlock(address: str, options: InterlockOptions, *, name: str) -> Interlock:
    driver = CAN_FRAME if isinstance(options, CanInterlockOptions) else MODBUS
    return driver.open(address, options, name=name)


def contact(opened: list[Interlock], address: str, options: InterlockOptions) -> Interlock:
    opened.append(open_interlock(address, options, name="door"))
    return opened[-1]


@pytest.mark.parametrize(
    ("options", "request_", "closed", "released"),
    [
        (ModbusInterlockOptions(3), "01 02 00 03 00 01", b"\x02\x01\x01", b"\x02\x01\x00"),
        (ModbusInterlockOptions(0x100, "coil", 7), "07 01 01 00 00 01", b"\x01\x01\x01", b"\x01\x01\x00"),
        (ModbusInterlockOptions(3, closed=False), "01 02 00 03 00 01", b"\x02\x01\x00", b"\x02\x01\x01"),
    ],
)
def test_a_modbus_contact(
    module: Module,
    opened: list[Interlock],
    options: ModbusInterlockOptions,
    request_: str,
    closed: bytes,
    released: bytes,
) -> None:
    made = contact(opened, module.address, options)
    module.reply = closed
    assert made.closed() is True
    module.reply = released
    assert made.closed() is False
    assert module.requests == [request_] * 2


def test_a_modbus_module_that_hangs_up_is_reached_again(module: Module, opened: list[Interlock]) -> None:
    made = contact(opened, module.address, ModbusInterlockOptions(0))
    module.reply = b"\x02\x01\x01"
    assert made.closed()
    module.hang_up()
    with pytest.raises(CommunicationError, match="door after 'read discrete_input 0 of unit 1'"):
        made.closed()
    assert made.closed()


@pytest.mark.parametrize(
    ("reply", "error", "message"),
    [
        (b"", CommunicationError, "no usable reply"),
        (b"\x82\x02", ReportedError, r"Modbus exception 2 \(illegal data address\).*Correct unit and number"),
        (b"\x02\x00", CommunicationError, "a reply without a bit|no usable reply"),
    ],
)
def test_a_modbus_module_that_says_nothing_clear(
    module: Module, opened: list[Interlock], reply: bytes, error: type[Exception], message: str
) -> None:
    module.reply = reply
    with pytest.raises(error, match=message):
        contact(opened, module.address, ModbusInterlockOptions(0, timeout=2.0 if reply else 0.05)).closed()


def test_a_modbus_module_that_is_not_there(module: Module, opened: list[Interlock]) -> None:
    module.close()
    with pytest.raises(CommunicationError, match=r"cannot be reached at tcp://127\.0\.0\.1"):
        contact(opened, module.address, ModbusInterlockOptions(0)).closed()


CAN = "can://virtual/interlocks"


def test_a_can_contact_takes_the_latest_frame(opened: list[Interlock]) -> None:
    made = contact(opened, CAN, CanInterlockOptions(0x1A0, byte=1, bit=2, timeout=5.0))
    low = contact(opened, CAN, CanInterlockOptions(0x1A0, byte=1, bit=2, closed=False, timeout=5.0))
    extended = contact(opened, CAN, CanInterlockOptions(0x1A0, byte=0, bit=0, extended=True, timeout=0.05))
    with can.Bus(interface="virtual", channel="interlocks") as bus:
        send = lambda content, identifier=0x1A0: bus.send(  # noqa: E731
            can.Message(arbitration_id=identifier, data=bytes.fromhex(content), is_extended_id=False)
        )
        send("00 00")
        send("00 04")
        send("00 00", 0x1A1)
        # Each bus has a thread that takes what was sent; asked before it has the second frame, it is told the first.
        assert any(made.closed() is True for _ in range(2))
        assert any(low.closed() is False for _ in range(2))
        send("FF FB")
        assert made.closed() is False
        assert low.closed() is True
        with pytest.raises(CommunicationError, match=r"no frame 0x1A0 for 0.05 s"):
            extended.closed()


def test_of_frames_that_have_come_only_the_latest_counts() -> None:
    frames = LatestFrame()
    for content in (b"\x00\x00", b"\x00\x04"):
        frames.on_message_received(can.Message(arbitration_id=0x1A0, data=content))
    assert frames.take(5.0) == b"\x00\x04"
    assert frames.take(0.01) is None


@pytest.mark.parametrize(
    ("content", "message"), [(None, "no frame 0x1A0 for 0.05 s"), ("04", "has 1 bytes, no byte 1")]
)
def test_a_can_contact_that_says_nothing_clear(opened: list[Interlock], content: str | None, message: str) -> None:
    made = contact(opened, CAN, CanInterlockOptions(0x1A0, byte=1, bit=2, timeout=0.05))
    with can.Bus(interface="virtual", channel="interlocks") as bus:
        if content is not None:
            bus.send(can.Message(arbitration_id=0x1A0, data=bytes.fromhex(content), is_extended_id=False))
        with pytest.raises(CommunicationError, match=message):
            made.closed()
    made.close()
    with pytest.raises(CommunicationError, match="the bus is closed"):
        made.closed()


@pytest.mark.parametrize(
    ("address", "options", "error", "message"),
    [
        ("tcp://", ModbusInterlockOptions(0), CommunicationError, "no Modbus address"),
        ("tcp://127.0.0.1", ModbusInterlockOptions(-1), SetpointError, "number = -1  is outside 0 … 65535"),
        ("tcp://127.0.0.1", ModbusInterlockOptions(0, unit=300), SetpointError, "unit = 300"),
        ("can://virtual", CanInterlockOptions(1, 0, 0), CommunicationError, "no address of a CAN bus"),
        ("can://nothing/x", CanInterlockOptions(1, 0, 0), CommunicationError, "cannot be opened at can://nothing/x"),
        ("can://virtual/x", CanInterlockOptions(0x800, 0, 0), SetpointError, "frame = 2048"),
        ("can://virtual/x", CanInterlockOptions(1, 0, 8), SetpointError, "bit = 8"),
    ],
)
def test_what_cannot_be_is_refused(
    address: str, options: InterlockOptions, error: type[Exception], message: str
) -> None:
    with pytest.raises(error, match=message):
        open_interlock(address, options, name="door")
