"""Faults of Modbus, CAN and serial lines: the bytes and frames that come, by every way there is."""

import struct
from collections.abc import Callable, Iterator
from typing import Any

import can
import pytest
import serial

from sim_instruments.bench import VirtualBench
from sim_instruments.faults.catalogue import FAULT
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.transports.can.in_process import CHANNEL
from sim_instruments.transports.modbus.in_process import ModbusStream

#: Sends a request (unit and PDU) and returns unit and PDU of the reply, None for none.
Ask = Callable[[int, str], tuple[int, str] | None]


def add(bench: VirtualBench, **described: Any) -> None:
    bench.injector.add(FAULT.validate_python(described))


@pytest.fixture
def direct(bench_motor: VirtualMotor) -> Iterator[VirtualBench]:
    with VirtualBench(bench_motor, seed=1, sockets=False) as bench:
        yield bench


def over_tcp(bench: VirtualBench) -> Ask:
    stream = bench.stream("in-process://dynamometer")
    assert isinstance(stream, ModbusStream)

    def ask(unit: int, request: str) -> tuple[int, str] | None:
        pdu = bytes.fromhex(request)
        stream.write(struct.pack("!HHHB", 7, 0, len(pdu) + 1, unit) + pdu)
        frame = stream.read(300, 0.5)
        if not frame:
            return None
        transaction, _, length, shown = struct.unpack("!HHHB", frame[:7])
        assert (transaction, length) == (7, len(frame) - 6)
        return shown, frame[7:].hex()

    return ask


def over_rtu(bench: VirtualBench, port: serial.Serial) -> Ask:
    from pymodbus.framer import FramerRTU

    def framed(unit: int, pdu: bytes) -> bytes:
        content = bytes([unit]) + pdu
        return content + FramerRTU.compute_CRC(content).to_bytes(2, "big")

    def ask(unit: int, request: str) -> tuple[int, str] | None:
        # The C2000 hears no request without 10 ms of silence before it.
        bench.clock.sleep(0.02)
        port.write(framed(unit, bytes.fromhex(request)))
        frame = port.read(3)
        if not frame:
            return None
        # What follows the first three bytes: of registers that were read, of an exception, of a register written.
        frame += port.read(frame[2] + 2 if frame[1] in (3, 4) else 2 if frame[1] & 0x80 else 5)
        assert frame == framed(frame[0], frame[1:-2])
        return frame[0], frame[1:-2].hex()

    return ask


@pytest.fixture(params=["tcp", "rtu"])
def line(request: pytest.FixtureRequest, bench_motor: VirtualMotor) -> Iterator[tuple[VirtualBench, Ask]]:
    with VirtualBench(bench_motor, seed=1, sockets=request.param == "rtu", line="rtu") as bench:
        if request.param == "tcp":
            yield bench, over_tcp(bench)
            return
        path = str(bench.address("dynamometer")).removeprefix("rtu://")
        with serial.Serial(path, 9600, timeout=1.5) as port:
            yield bench, over_rtu(bench, port)


def test_an_exception_in_the_place_of_what_was_asked(line: tuple[VirtualBench, Ask]) -> None:
    bench, ask = line
    add(bench, fault="exception", role="dynamometer", pattern="^write 1", times=2, code=6)
    assert ask(1, "06 2001 03E8") == (1, "8606")
    assert ask(1, "10 2001 0001 02 03E8") == (1, "9006")
    # Nothing was carried out.
    assert ask(1, "03 2001 0001") == (1, "03020000")
    assert ask(1, "06 2001 03E8") == (1, "06200103e8")


def test_a_reply_of_another_unit(line: tuple[VirtualBench, Ask]) -> None:
    bench, ask = line
    add(bench, fault="wrong_unit", role="dynamometer", count=1)
    assert ask(1, "03 000A 0001") == (2, "03020000")
    assert ask(1, "03 000A 0001") == (1, "03020000")


def test_replies_that_are_one_behind(line: tuple[VirtualBench, Ask]) -> None:
    bench, ask = line
    add(bench, fault="stale", role="dynamometer", count=1)
    assert ask(1, "03 0016 0001") is None
    assert ask(1, "06 0016 0001") == (1, "03020000")
    assert ask(1, "03 0016 0001") == (1, "0600160001")


def test_a_torque_transducer_that_is_frozen(line: tuple[VirtualBench, Ask]) -> None:
    bench, ask = line
    world = bench.world
    world.couple_dynamometer()
    add(bench, fault="frozen", role="dynamometer", duration=30.0)
    first = ask(2, "03 0000 0006")
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    bench.clock.sleep(1.0)
    assert ask(2, "03 0000 0006") == first
    # Its settings are no readings.
    assert ask(2, "03 0008 0002") == (2, "030400000004")
    bench.injector.clear()
    shown = ask(2, "03 0002 0002")
    assert shown is not None
    assert int(shown[1][4:], 16) / 100.0 == pytest.approx(100.0 * 30.0 / 3.14159, rel=1e-3)


@pytest.mark.parametrize(
    ("kind", "double", "word"), [("not_a_number", "80000000", "8000"), ("overflow", "7fffffff", "7fff")]
)
def test_registers_without_readings(line: tuple[VirtualBench, Ask], kind: str, double: str, word: str) -> None:
    bench, ask = line
    add(bench, fault=kind, role="dynamometer")
    assert ask(2, "03 0000 000A") == (2, "0314" + 3 * double + "00000002" + "00000004")
    # State and error code of the drive are no readings, frequency and current are.
    status = ask(1, "03 2100 0004")
    assert status is not None
    assert status[1][4:8] == "0000"
    assert status[1][12:] == word * 2


def test_a_cable_that_is_out(line: tuple[VirtualBench, Ask], request: pytest.FixtureRequest) -> None:
    bench, ask = line
    add(bench, fault="disconnect", role="dynamometer", duration=2.0)
    if bench.address("dynamometer") == "in-process://dynamometer":
        with pytest.raises(ConnectionError):
            ask(1, "03 000A 0001")
        bench.clock.sleep(2.0)
        ask = over_tcp(bench)
    else:
        # A serial line tells nobody.
        assert ask(1, "03 000A 0001") is None
        bench.clock.sleep(2.0)
    assert ask(1, "03 000A 0001") == (1, "03020000")


# CAN

INVERTER = 5


class Master:
    """Sends SDO requests and sees every frame of the bus."""

    def __init__(self, bench: VirtualBench) -> None:
        bench.address("inverter")
        self.end = bench.can_bus(CHANNEL)
        self.heard: list[can.Message] = []
        self.end.hand_over(self.heard.append)

    def ask(self, request: str) -> str | None:
        self.heard.clear()
        data = bytes.fromhex(request)
        self.end.send(can.Message(arbitration_id=0x600 + INVERTER, data=data, is_extended_id=False))
        replies = [bytes(frame.data).hex() for frame in self.heard if frame.arbitration_id == 0x580 + INVERTER]
        return replies[0] if replies else None


@pytest.fixture
def master(direct: VirtualBench) -> Iterator[Master]:
    made = Master(direct)
    yield made
    made.end.shutdown()


READ_STATUS, READ_VELOCITY = "40 4160 00 00000000", "40 6C60 00 00000000"


def test_a_node_that_is_off_its_bus_and_returns(direct: VirtualBench, master: Master) -> None:
    assert master.ask(READ_STATUS) == "4b41600050020000"
    # A heartbeat of 10 s, which is not to be waited for.
    assert master.ask("2B 1710 00 1027 0000") == "6017100000000000"
    add(direct, fault="bus_off", role="inverter", duration=5.0)
    assert master.ask(READ_STATUS) is None
    assert master.ask("2B 4060 00 0600 0000") is None
    master.heard.clear()
    direct.clock.sleep(5.0)
    assert next((frame.arbitration_id, bytes(frame.data)) for frame in master.heard) == (0x700 + INVERTER, b"\0")
    # The control word did not get through.
    assert master.ask(READ_STATUS) == "4b41600050020000"


def test_a_drive_off_its_bus_goes_on_as_before(direct: VirtualBench, master: Master) -> None:
    world = direct.world
    world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    face = direct.instrument("inverter")
    for index, value in ((0x6060, 3), (0x2000, 3000), (0x60FF, 2_400_000), (0x6040, 6), (0x6040, 7), (0x6040, 15)):
        face.write(index, value)
    direct.clock.sleep(5.0)
    add(direct, fault="bus_off", role="inverter")
    direct.clock.sleep(10.0)
    truth = world.truth()
    assert truth["energised"] is True
    assert truth["shaft_speed"] == pytest.approx(2.0 * 3.14159 * 10.0, rel=1e-3)


@pytest.mark.parametrize(("kind", "shown"), [("not_a_number", "00000080"), ("overflow", "ffffff7f")])
def test_objects_without_readings(direct: VirtualBench, master: Master, kind: str, shown: str) -> None:
    add(direct, fault=kind, role="inverter")
    assert master.ask(READ_VELOCITY) == f"436c6000{shown}"
    assert master.ask(READ_STATUS) == "4b41600050020000"


def test_an_object_that_is_frozen(direct: VirtualBench, master: Master) -> None:
    world = direct.world
    world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    add(direct, fault="frozen", role="inverter", duration=20.0)
    assert master.ask(READ_VELOCITY) == "436c600000000000"
    world.inverter.command_amplitude(3.0)
    world.inverter.command_frequency(10.0)
    world.inverter.enable(True)
    direct.clock.sleep(5.0)
    assert master.ask(READ_VELOCITY) == "436c600000000000"
    direct.clock.sleep(20.0)
    assert master.ask(READ_VELOCITY) == "436c6000c0270900"


def test_sdo_replies_that_are_one_behind(direct: VirtualBench, master: Master) -> None:
    add(direct, fault="stale", role="inverter", count=1)
    assert master.ask(READ_STATUS) is None
    assert master.ask(READ_VELOCITY) == "4b41600050020000"
    assert master.ask(READ_STATUS) == "436c600000000000"


# the tachometer


def frames(bench: VirtualBench, count: int) -> list[bytes]:
    stream = bench.stream("in-process://tachometer")
    stream.reset_input_buffer()
    for _ in range(count):
        bench.clock.sleep(1.0)
    content = stream.read(16 * count, 0.0)
    return [content[place : place + 16] for place in range(0, len(content), 16)]


@pytest.fixture
def turning(direct: VirtualBench) -> VirtualBench:
    direct.address("tachometer")
    direct.world.turn_shaft(10.0)
    return direct


def test_a_tachometer_that_is_frozen(turning: VirtualBench) -> None:
    turning.clock.sleep(2.0)
    add(turning, fault="frozen", role="tachometer")
    first = frames(turning, 1)
    turning.world.turn_shaft(50.0)
    assert set(frames(turning, 4)) == set(first)
    turning.injector.clear()
    assert frames(turning, 3)[-1] != first[0]


@pytest.mark.parametrize(("kind", "digits"), [("not_a_number", b"--------"), ("overflow", b"99999999")])
def test_a_tachometer_without_a_reading(turning: VirtualBench, kind: str, digits: bytes) -> None:
    add(turning, fault=kind, role="tachometer")
    assert {frame[7:15] for frame in frames(turning, 3)} == {digits}


def test_a_tachometer_that_is_one_behind(turning: VirtualBench) -> None:
    turning.clock.sleep(2.0)
    add(turning, fault="stale", role="tachometer", duration=60.0)
    assert frames(turning, 1) == []
    turning.world.turn_shaft(100.0)
    slow, fast = frames(turning, 2)
    assert int(slow[7:15]) < int(fast[7:15])


def test_a_tachometer_whose_cable_is_out(turning: VirtualBench) -> None:
    add(turning, fault="disconnect", role="tachometer", duration=3.5)
    assert frames(turning, 3) == []
    assert len(frames(turning, 3)) == 3
