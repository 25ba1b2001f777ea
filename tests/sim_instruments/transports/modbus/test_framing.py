"""A C2000 on a serial line is spoken to as its parameters 09-00, 09-01 and 09-04 say, and as nothing else."""

from collections.abc import Iterator
from typing import Any

import pytest
import serial

from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.physics.motor.motor import VirtualMotor

#: 00-00 of unit 1 is 6, in both kinds of frame (Modbus over Serial Line, V1.02, 2.5.1 and 2.5.2).
RTU, RTU_REPLY = bytes.fromhex("01 03 00 00 00 01 84 0A"), bytes.fromhex("01 03 02 00 06 38 46")
ASCII, ASCII_REPLY = b":010300000001FB\r\n", b":0103020006F4\r\n"
SILENCE = 0.015


class Line:
    """The far end of the line, as a serial port of some settings."""

    def __init__(self, bench: VirtualBench) -> None:
        self.bench = bench
        self.drive = bench.instrument("dynamometer").units[1]
        self._path = str(bench.address("dynamometer")).removeprefix("rtu://")

    def tell(self, request: bytes, reply: bytes = b"", rate: int = 9600, **how: Any) -> bytes:
        """Send a request with some settings of the port; return what comes, nothing where that is nothing."""
        self.bench.clock.sleep(SILENCE)
        with serial.Serial(self._path, rate, timeout=20.0 if reply else 0.3, **how) as port:
            port.write(request)
            return port.read(len(reply) or 1)


@pytest.fixture(params=["at once", "after power"])
def line(request: pytest.FixtureRequest, bench_motor: VirtualMotor) -> Iterator[Line]:
    unit = SimulatedUnit(find("delta-dyn200"), options={"drive_framing_acts": request.param})
    with VirtualBench(bench_motor, [unit], line="rtu") as bench:
        yield Line(bench)


def test_it_hears_its_own_rate_parity_and_kind_of_frame(line: Line) -> None:
    assert line.tell(RTU, RTU_REPLY) == RTU_REPLY
    assert line.tell(RTU, rate=19200) == b""
    assert line.tell(RTU, parity="O") == b""
    assert line.tell(ASCII) == b""


def test_as_delivered_it_speaks_ascii(line: Line) -> None:
    line.drive.deliver()
    assert line.tell(ASCII, ASCII_REPLY, bytesize=7, stopbits=2) == ASCII_REPLY
    assert line.tell(RTU, stopbits=2) == b""
    # The sensor beside it is where it was.
    sensor = bytes.fromhex("02 03 00 08 00 02 45 FA"), bytes.fromhex("02 03 04 00 00 00 04 C8 F0")
    assert line.tell(*sensor) == sensor[1]


@pytest.mark.parametrize("line", ["at once"], indirect=True)
def test_a_new_rate_acts_after_the_reply(line: Line) -> None:
    rate = bytes.fromhex("01 06 09 01 00 C0 DB C6")
    assert line.tell(rate, rate) == rate
    assert line.tell(RTU) == b""
    assert line.tell(RTU, RTU_REPLY, 19200) == RTU_REPLY


@pytest.mark.parametrize("line", ["after power"], indirect=True)
def test_a_new_rate_may_act_only_once_the_power_has_been_off(line: Line) -> None:
    rate = bytes.fromhex("01 06 09 01 00 C0 DB C6")
    assert line.tell(rate, rate) == rate
    assert line.tell(RTU, RTU_REPLY) == RTU_REPLY
    line.drive.power_cycle()
    assert line.tell(RTU) == b""
    assert line.tell(RTU, RTU_REPLY, 19200) == RTU_REPLY


@pytest.mark.parametrize("line", ["at once"], indirect=True)
def test_a_new_unit_number_is_answered_to(line: Line) -> None:
    unit = bytes.fromhex("01 06 09 00 00 05 4A 55")
    assert line.tell(unit, unit) == unit
    assert line.tell(RTU) == b""
    reply = bytes.fromhex("05 03 02 00 06 C9 86")
    assert line.tell(bytes.fromhex("05 03 00 00 00 01 85 8E"), reply) == reply
    assert set(line.bench.instrument("dynamometer").units) == {2, 5}
