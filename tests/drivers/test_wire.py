"""What whoever records is told of each wire: every byte, both ways, in order, and why none came."""

from collections.abc import Callable, Iterator
from typing import Any

import can
import pytest
from pyvisa import ResourceManager

from drivers.catalogue import Surroundings
from drivers.interfaces import CommunicationError
from drivers.transport.can.buses import CanBuses
from drivers.transport.can.network_management import NmtState
from drivers.transport.modbus.line import open_line
from drivers.transport.serial.ports import StreamPort, TappedPort
from drivers.transport.visa.opening import open_session
from drivers.transport.wire import Carrier, Direction
from sim_instruments.bench import VirtualBench
from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.transports.can.in_process import CHANNEL, DirectBus
from sim_instruments.transports.modbus.rtu import ModbusRtuEndpoint

ADDRESS = "TCPIP0::meter::inst0::INSTR"


class Told:
    """What was told."""

    def __init__(self) -> None:
        self.all: list[tuple[Carrier, Direction, bytes]] = []

    def __call__(self, carrier: Carrier, direction: Direction, data: bytes) -> None:
        self.all.append((carrier, direction, data))


@pytest.fixture
def told() -> Told:
    return Told()


@pytest.mark.parametrize("chunk", [None, 3])
def test_visa(manager: ResourceManager, connect: Callable[..., Any], clock: Any, told: Told, chunk: int | None) -> None:
    block = b"#213" + bytes(range(13)) + b"\n"
    replies = {"*IDN?": b"ACME,1,2,3\n", "DATA?": block}
    wire = connect(ADDRESS, lambda message: replies.get(message))
    wire.chunk = chunk
    session = open_session(
        ADDRESS, Surroundings(clock, lambda: manager, wire=told), "meter", timeout=0.1, line_end="\r\n"
    )
    assert session.identity_line() == "ACME,1,2,3"
    assert session.query_block("DATA?") == bytes(range(13))
    wire.fail_write["OFF"] = 1
    for message, fails in (("ON", False), ("OFF", True)):
        if fails:
            with pytest.raises(CommunicationError):
                session.send(message)
        else:
            session.send(message)
    session.close()
    assert told.all[:5] == [
        ("visa", ">", b"*IDN?\r\n"),
        ("visa", "<", b"ACME,1,2,3\n"),
        ("visa", ">", b"DATA?\r\n"),
        ("visa", "<", block),
        ("visa", ">", b"ON\r\n"),
    ]
    assert told.all[5:] == [("visa", ">", b"OFF\r\n"), ("visa", "!", b"write: VI_ERROR_CONN_LOST")]


def test_a_reply_that_does_not_come(
    manager: ResourceManager, connect: Callable[..., Any], clock: Any, told: Told
) -> None:
    connect(ADDRESS, lambda _: None)
    session = open_session(ADDRESS, Surroundings(clock, lambda: manager, wire=told), "meter", timeout=0.1)
    with pytest.raises(CommunicationError):
        session.identity_line()
    session.close()
    assert told.all == [("visa", ">", b"*IDN?\n"), ("visa", "!", b"read: VI_ERROR_TMO")]


@pytest.fixture
def bench() -> Iterator[VirtualBench]:
    from bench.motor.motor_file import load_motor

    with VirtualBench(load_motor("lg-400w").virtual_motor(), sockets=False) as made:
        yield made


def test_modbus_tcp(bench: VirtualBench, told: Told) -> None:
    line = open_line("in-process://dynamometer", "dynamometer", in_process=bench, wire=told)
    assert line.read(2, 0x08, 2, "torque decimals") == [0, 4]
    line.close()
    assert told.all == [
        ("modbus tcp", ">", bytes.fromhex("00 01 00 00 00 06 02 03 00 08 00 02")),
        ("modbus tcp", "<", bytes.fromhex("00 01 00 00 00 07 02 03 04 00 00 00 04")),
    ]


def test_modbus_rtu(bench: VirtualBench, told: Told) -> None:
    endpoint = ModbusRtuEndpoint(bench.instrument("dynamometer"))
    line = open_line(endpoint.address, "dynamometer", wire=told)
    assert line.read(2, 0x08, 2, "torque decimals") == [0, 4]
    line.close()
    endpoint.close()
    assert {carrier for carrier, _, _ in told.all} == {"modbus rtu"}
    assert told.all[0][2] == bytes.fromhex("02 03 00 08 00 02 45 FA")
    assert b"".join(data for _, direction, data in told.all if direction == "<") == bytes.fromhex(
        "02 03 04 00 00 00 04 C8 F0"
    )


def test_a_node_and_no_other(told: Told) -> None:
    bus = DirectBus(VirtualClock())
    node = bus.end()

    class Opener:
        def can_bus(self, channel: str) -> can.BusABC:
            return bus.end()

        def stream(self, address: str) -> Any:
            raise LookupError(address)

    def answer(frame: can.Message) -> None:
        for identifier, data in (
            (0x585, "4F60600000000000"),
            (0x586, "00"),
            (0x705, "05"),
            (0x085, "1081010000000000"),
        ):
            if frame.arbitration_id == 0x605:
                node.send(can.Message(arbitration_id=identifier, is_extended_id=False, data=bytes.fromhex(data)))

    node.hand_over(answer)
    buses = CanBuses(Opener())
    place = buses.node(f"can://in-process/{CHANNEL}?node=5", "inverter", told)
    other = buses.node(f"can://in-process/{CHANNEL}?node=6", "drive")
    assert place.client.upload(0x6060, 0) == b"\0"
    place.command_node(NmtState.OPERATIONAL)
    place.ask_nmt_state()
    place.synchronise()
    place.hear(0x185, lambda _: None)
    node.send(can.Message(arbitration_id=0x185, is_extended_id=False, data=b"\x01\x02"))
    for one in place, other:
        one.disconnect()
    node.shutdown()
    assert [(direction, data) for _, direction, data in told.all] == [
        (">", b"605#4060600000000000"),
        ("<", b"585#4F60600000000000"),
        ("<", b"705#05"),
        ("<", b"085#1081010000000000"),
        (">", b"000#0105"),
        (">", b"705#R"),
        (">", b"080#"),
        ("<", b"185#0102"),
    ]


class Coming:
    """A stream from which bytes come until none do."""

    def __init__(self, data: bytes) -> None:
        self.data = data

    def read(self, count: int, timeout: float) -> bytes:
        data, self.data = self.data[:count], self.data[count:]
        return data

    def write(self, data: bytes) -> int:
        return len(data)

    def reset_input_buffer(self) -> None:
        self.data = b""

    def close(self) -> None:
        """Nothing is open."""


def test_a_serial_line(told: Told) -> None:
    port = TappedPort(StreamPort(Coming(b"\x0212\r34"), 1.0), told)
    assert port.read_until(b"\r") == b"\x0212\r"
    assert port.read_until(b"\r") == b"34"
    assert port.read_until(b"\r") == b""
    assert [(direction, data) for _, direction, data in told.all] == [
        ("<", b"\x0212\r"),
        ("<", b"34"),
        ("!", b"timeout"),
        ("!", b"timeout"),
    ]
