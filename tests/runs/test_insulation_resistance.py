"""The insulation test on the virtual bench, through the tester's own driver."""

from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure, within

FILE = load_motor("lg-400w")
PLATE = replace(FILE.nameplate, insulation_test_voltage=500.0)


def measured_at(resistance):
    motor = replace(FILE.virtual_motor(), insulation_resistance=resistance)
    with VirtualBench(motor, seed=3, sockets=False, fixture=True) as bench:
        result = measure(bench, PLATE, "insulation-resistance")
        assert set(bench.world.truth()["wiring"].values()) == {"open"}
    return result


@pytest.mark.parametrize("resistance", [5e6, 2e8])
def test_it_holds_the_truth(resistance):
    result = measured_at(resistance)
    assert within(result.parameter("insulation_resistance"), resistance)
    assert result.findings["test_voltage"] == pytest.approx(500.0, rel=0.03)
    assert result.findings["at_least"] is False


def test_sound_insulation_is_at_least_the_range():
    result = measured_at(1e12)
    assert result.findings["at_least"] is True
    assert 5e9 < result.parameter("insulation_resistance").value < 1e12
