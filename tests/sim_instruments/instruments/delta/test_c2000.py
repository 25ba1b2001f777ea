"""The C2000's sources, limits and identity by their telegrams."""

import pytest

from sim_instruments.physics.motor.motor import VirtualMotor
from tests.sim_instruments.instruments.delta.test_dyn200 import Wire, wired

RUN, STOP = "01 06 20 00 00 12", "01 06 20 00 00 01"


def command(wire: Wire) -> str:
    return wire.tell("01 03 21 02 00 01")


def test_what_it_says_of_itself_and_of_its_line(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        assert wire.tell("01 03 00 00 00 01") == "01 03 02 00 06"
        assert wire.tell("01 03 00 14 00 02") == "01 03 04 00 01 00 02"
        assert wire.tell("01 03 09 00 00 02") == "01 03 04 00 01 00 60"
        assert wire.tell("01 03 09 04 00 01") == "01 03 02 00 0D"
        assert wire.tell("01 06 00 00 00 01") == "01 86 02"
        assert wire.tell("01 06 09 00 00 FF") == "01 86 03"
        assert wire.tell("01 03 00 01 00 01") == "01 83 02"


def test_the_frequency_of_the_line_acts_where_it_is_the_source(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        assert wire.tell("01 06 00 14 00 00") == "01 06 00 14 00 00"
        assert wire.tell("01 06 20 01 0B B8") == "01 06 20 01 0B B8"
        wire.tell(RUN)
        wire.bench.clock.sleep(2.0)
        assert command(wire) == "01 03 02 00 00"
        assert wire.bench.world.truth()["shaft_speed"] == pytest.approx(0.0, abs=0.1)
        wire.tell("01 06 00 14 00 01")
        wire.bench.clock.sleep(2.0)
        assert command(wire) == "01 03 02 0B B8"
        assert wire.bench.world.truth()["shaft_speed"] == pytest.approx(94.2, rel=0.01)


def test_the_keypads_frequency_is_followed_where_that_is_the_source(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        wire.bench.instrument("dynamometer").units[1].keypad_frequency = 1000
        wire.tell("01 06 00 14 00 00")
        wire.tell("01 06 20 01 00 00")
        wire.tell(RUN)
        wire.bench.clock.sleep(2.0)
        assert wire.bench.world.truth()["shaft_speed"] == pytest.approx(31.4, rel=0.01)


def test_commands_of_the_line_act_where_it_is_their_source(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        wire.tell("01 06 00 15 00 00")
        wire.tell("01 06 20 01 0B B8")
        assert wire.tell(RUN) == RUN
        assert wire.bench.world.truth()["dynamometer_enabled"] is False
        assert wire.tell("01 03 21 01 00 01") == "01 03 02 05 00"
        wire.tell("01 06 00 15 00 02")
        wire.tell(RUN)
        assert wire.bench.world.truth()["dynamometer_enabled"] is True


def test_commands_are_where_09_30_says(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        wire.tell("01 06 09 1E 00 01")
        assert wire.tell(RUN) == RUN
        assert wire.bench.world.truth()["dynamometer_enabled"] is False
        wire.tell("01 06 09 1E 00 00")
        wire.tell(RUN)
        assert wire.bench.world.truth()["dynamometer_enabled"] is True


def torque_mode(wire: Wire) -> None:
    wire.tell("01 06 00 0A 00 02")
    wire.tell("01 06 0B 22 00 28")
    wire.tell(RUN)


def test_the_torque_of_the_line_acts_where_it_is_the_source(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        wire.tell("01 06 0B 21 00 00")
        torque_mode(wire)
        wire.bench.clock.sleep(0.2)
        assert wire.registers()[0] == pytest.approx(0, abs=20)
        wire.tell("01 06 0B 21 00 01")
        wire.bench.clock.sleep(0.05)
        assert wire.registers()[0] == pytest.approx(2000, abs=20)


def test_a_torque_is_a_share_of_the_maximum(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        wire.tell("01 06 0B 1B 00 32")
        torque_mode(wire)
        wire.bench.clock.sleep(0.2)
        assert wire.registers()[0] == pytest.approx(1000, abs=20)


@pytest.mark.parametrize(("by", "limit"), [(0, 62.8), (1, 31.4)])
def test_in_torque_mode_the_speed_stays_at_its_limit(bench_motor: VirtualMotor, by: int, limit: float) -> None:
    with wired(bench_motor) as wire:
        wire.tell(f"01 06 0B 24 00 0{by}")
        wire.tell("01 06 0B 25 00 0A")
        wire.tell("01 06 20 01 03 E8")
        torque_mode(wire)
        wire.bench.clock.sleep(20.0)
        assert wire.bench.world.truth()["shaft_speed"] == pytest.approx(limit, rel=0.01)
        wire.tell(STOP)
        assert wire.bench.world.truth()["dynamometer_enabled"] is False


def test_with_the_protocol_on_ascii_it_answers_nobody(bench_motor: VirtualMotor) -> None:
    with wired(bench_motor) as wire:
        assert wire.tell("01 06 09 04 00 01") == "01 06 09 04 00 01"
        assert wire.tell("01 03 09 04 00 01") == ""
        assert wire.tell("02 03 00 08 00 02") == "02 03 04 00 00 00 04"
