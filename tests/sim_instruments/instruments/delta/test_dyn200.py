"""The DYN-200 by its telegrams."""

import math
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest

from sim_instruments.bench import VirtualBench
from sim_instruments.catalogue import SimulatedUnit, find
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.transports.modbus.in_process import ModbusStream

RPM = 2.0 * math.pi / 60.0
#: Requests after the header: read torque, speed and power; zero by coil; zero by a write of v0lker's and of samuelknowles923's.
READ, COIL = "02 03 00 00 00 06", "02 05 00 00 FF 00"
WRITE, WRITE_FF00 = "02 10 00 00 00 02 04 00 00 00 00", "02 10 00 00 00 02 04 00 00 FF 00"


class Wire:
    """Modbus TCP frames to the bench's dynamometer."""

    def __init__(self, bench: VirtualBench) -> None:
        self.bench = bench
        stream = bench.stream("in-process://dynamometer")
        assert isinstance(stream, ModbusStream)
        self._stream = stream

    def tell(self, request: str) -> str:
        body = bytes.fromhex(request)
        self._stream.write(struct.pack("!HHH", 7, 0, len(body)) + body)
        reply = self._stream.read(300, 0.1)
        assert not reply or reply[:6] == struct.pack("!HHH", 7, 0, len(reply) - 6)
        return reply[6:].hex(" ").upper()

    def registers(self) -> tuple[int, int, int]:
        reply = bytes.fromhex(self.tell(READ))
        assert reply[:3] == bytes.fromhex("02 03 0C")
        torque, speed, power = struct.unpack("!iii", reply[3:])
        return torque, speed, power

    def mean_torque(self) -> float:
        return sum(self.registers()[0] for _ in range(30)) / 30e4


@contextmanager
def wired(motor: VirtualMotor, **options: Any) -> Iterator[Wire]:
    with VirtualBench(motor, [SimulatedUnit(find("delta-dyn200"), options=options)], seed=1, sockets=False) as bench:
        bench.world.couple_dynamometer()
        yield Wire(bench)


def turn(wire: Wire, frequency: int, direction: int) -> None:
    """Regulate speed (0.01 Hz), forwards (1) or backwards (2), and wait until it is there."""
    wire.tell(f"01 06 20 01 {frequency >> 8:02X} {frequency & 0xFF:02X}")
    wire.tell(f"01 06 20 00 00 {direction << 4 | 2:02X}")
    wire.bench.clock.sleep(3.0)


def test_the_direction_of_rotation_is_in_no_register(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        turn(wire, 3333, 2)
        assert wire.bench.world.truth()["shaft_speed"] < 0.0
        assert wire.tell("02 03 00 12 00 02") == "02 03 04 00 00 00 00"
        torque, speed, power = wire.registers()
        assert speed > 0
        assert torque < 0 < power


def test_the_direction_register_turns_the_torque_and_the_power(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        turn(wire, 3333, 1)
        before = wire.registers()
        assert wire.tell("02 10 00 12 00 02 04 00 00 00 01") == "02 10 00 12 00 02"
        assert wire.tell("02 03 00 12 00 02") == "02 03 04 00 00 00 01"
        after = wire.registers()
        assert before[0] > 0 > after[0]
        assert before[2] > 0 > after[2]
        assert after[1] == pytest.approx(before[1], rel=1e-4)
        assert wire.tell("02 10 00 12 00 02 04 00 00 00 02") == "02 90 03"


@pytest.mark.parametrize(("power_unit", "speed_unit"), [(0.1, None), (1.0, 0.1), (0.1, 1.0)])
def test_power_and_speed_in_what_this_sensor_counts(
    bench_motor: VirtualMotor, power_unit: float, speed_unit: float | None
) -> None:
    with wired(bench_motor, sensor_power_unit=power_unit, sensor_speed_unit=speed_unit) as wire:
        turn(wire, 20000, 1)
        torque, speed, power = wire.registers()
        rpm = speed * (0.01 if speed_unit is None else speed_unit)
        assert rpm == pytest.approx(6000.0, abs=2.0)
        assert power * power_unit == pytest.approx(torque * 1e-4 * rpm * RPM, abs=0.51 * power_unit + 0.05)
        wire.tell("02 10 00 20 00 02 04 00 00 00 00")
        assert wire.registers()[1] == pytest.approx(6000 if speed_unit is None else 6000 / speed_unit, abs=20)


def test_power_without_the_sign_of_rotation(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor, sensor_power_sign=False) as wire:
        turn(wire, 3333, 2)
        torque, _, power = wire.registers()
        assert torque < 0
        assert power < 0


def test_coil_0_zeroes_and_a_write_at_00h_is_acknowledged_for_nothing(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        for request in (WRITE, WRITE_FF00):
            assert wire.tell(request) == "02 10 00 00 00 02"
        assert wire.mean_torque() == pytest.approx(5e-4, abs=2e-4)
        assert wire.tell("02 05 00 00 00 00") == "02 05 00 00 00 00"
        assert wire.mean_torque() == pytest.approx(5e-4, abs=2e-4)
        assert wire.tell(COIL) == "02 05 00 00 FF 00"
        assert wire.mean_torque() == pytest.approx(0.0, abs=4e-4)
        assert wire.tell("02 05 00 01 FF 00") == "02 85 02"


@pytest.mark.parametrize("request_", [WRITE, WRITE_FF00])
def test_a_sensor_that_knows_the_write_alone(bench_motor: VirtualMotor, request_: str) -> None:
    with wired(bench_motor, sensor_zeroed="write") as wire:
        assert wire.tell(COIL) == "02 85 01"
        assert wire.mean_torque() == pytest.approx(5e-4, abs=2e-4)
        assert wire.tell(request_) == "02 10 00 00 00 02"
        assert wire.mean_torque() == pytest.approx(0.0, abs=4e-4)
        assert wire.tell("02 10 00 00 00 02 04 00 00 00 05") == "02 90 03"


def test_coil_2_brings_back_the_factorys_settings(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        wire.tell("02 10 00 12 00 02 04 00 00 00 01")
        wire.tell("02 10 00 08 00 02 04 00 00 00 02")
        assert wire.tell("02 03 00 08 00 02") == "02 03 04 00 00 00 02"
        assert wire.tell("02 05 00 02 FF 00") == "02 05 00 02 FF 00"
        assert wire.tell("02 03 00 08 00 02") == "02 03 04 00 00 00 04"
        assert wire.tell("02 03 00 12 00 02") == "02 03 04 00 00 00 00"


def test_with_parameter_09_off_it_answers_nobody_and_the_drive_does(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor, sensor_modbus=False) as wire:
        for request in (READ, COIL, WRITE):
            assert wire.tell(request) == ""
        assert wire.tell("01 03 00 0A 00 01") == "01 03 02 00 00"


def test_units_of_nothing_are_refused(bench_motor: VirtualMotor) -> None:
    with pytest.raises(ValueError, match="positive"), wired(bench_motor, sensor_power_unit=0.0):
        pass
