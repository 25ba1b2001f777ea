"""What a rectifier leaves on the supply's output: a triangle that the motor's current follows."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bench.motor.motor_file import load_motor
from sim_instruments.bench import BenchSetting, VirtualBench
from sim_instruments.disturbances.bench import Disturbances, SupplyRipple
from sim_instruments.world.machine_data import SupplyStage
from tests.runs.on_bench import measure

FILE = load_motor("lg-400w")
#: None of the shipped motors.
MOTOR = replace(
    FILE.virtual_motor(),
    pole_pairs=1,
    phase_resistances=(0.5, 0.5, 0.5),
    d_axis_inductance=1e-3,
    q_axis_inductance=1e-3,
)


def rippled(ripple: float, frequency: float = 100.0) -> BenchSetting:
    return BenchSetting(disturbances=Disturbances(supply=SupplyRipple(ripple, frequency)))


def test_the_ripple_is_a_triangle() -> None:
    stage = SupplyRipple(0.3, 100.0).stage(SupplyStage())
    times = np.arange(2000) * 1e-5 + 3.2e-6
    values = np.array([stage.ripple_at(float(time))[0] for time in times])
    assert np.max(values) == pytest.approx(0.3, rel=2e-3)
    assert np.min(values) == pytest.approx(-0.3, rel=2e-3)
    assert np.std(values) == pytest.approx(0.3 / math.sqrt(3.0), rel=1e-3)
    assert np.abs(np.diff(values)).max() == pytest.approx(4.0 * 0.3 * 100.0 * 1e-5, rel=1e-6)
    value, slope, turn = stage.ripple_at(0.0125)
    assert stage.ripple_at(turn)[0] == pytest.approx(value + slope * (turn - 0.0125))


@pytest.mark.parametrize(("ripple", "frequency"), [(0.02, 100.0), (0.2, 120.0)])
def test_the_output_of_an_open_supply_shows_it(ripple: float, frequency: float) -> None:
    with VirtualBench(MOTOR, seed=1, setting=rippled(ripple, frequency), sockets=False) as bench:
        supply = bench.world.supply
        supply.set_current_limit(1.0)
        supply.set_voltage(5.0)
        supply.switch(True)
        bench.clock.sleep(0.1)
        seen = []
        for _ in range(400):
            bench.clock.sleep(2.3e-4)
            seen.append(supply.voltage())
    assert np.mean(seen) == pytest.approx(5.0, abs=0.05 * ripple)
    assert np.std(seen) == pytest.approx(ripple / math.sqrt(3.0), rel=0.05)


@pytest.mark.parametrize("ripple", [pytest.param(0.003, marks=pytest.mark.slow), 0.02])
def test_a_step_on_a_rippling_supply_holds_the_inductance(ripple: float) -> None:
    with VirtualBench(MOTOR, seed=1, setting=rippled(ripple), sockets=False) as bench:
        # A current that the supply's volts drive through this winding.
        result = measure(bench, replace(FILE.nameplate, rated_current=5.0), "dq-inductance-time-constant")
    for name in ("d_axis_inductance", "q_axis_inductance"):
        low, high = result.parameter(name).coverage_interval
        assert low <= 1e-3 <= high
