"""A torque constant measured alone, where only the inverter's own voltages can tell that a scale is wrong."""

from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.result import ProcedureResult
from sim_instruments.bench import BenchSetting
from sim_instruments.disturbances.bench import Disturbances
from sim_instruments.disturbances.current_loop import CurrentLoop
from tests.runs.flux_bench import flux_bench, map_of

FILE = load_motor("lg-400w")
MOTOR = FILE.virtual_motor()
PLATE = replace(FILE.nameplate, pole_pairs=MOTOR.pole_pairs)


def found_with(**errors: float) -> ProcedureResult:
    setting = BenchSetting(disturbances=Disturbances(inverter=CurrentLoop(**errors)))
    with flux_bench(MOTOR, PLATE, setting=setting, torque=5.0) as virtual:
        return map_of(virtual, PLATE, name="torque-constant")


@pytest.mark.parametrize(
    ("errors", "said"),
    [
        ({}, False),
        ({"angle_error": 0.05, "voltage_delay": 4e-5, "dead_time": 1e-6}, False),
        ({"current_gain": 0.05}, True),
        pytest.param({"current_gain": -0.05}, True, marks=pytest.mark.slow),
        pytest.param({"voltage_gain": 0.05}, True, marks=pytest.mark.slow),
    ],
)
def test_the_interval_holds_the_truth_and_says_what_the_voltages_contradict(
    errors: dict[str, float], said: bool
) -> None:
    found = found_with(**errors)
    (constant,) = found.parameters
    low, high = constant.coverage_interval
    assert low <= MOTOR.torque_constant <= high
    assert [w.identifier for w in found.warnings] == (["channels-differ"] if said else [])
    assert found.findings["induced"]["standard_uncertainty"] < 0.01 * constant.value
    if not said:
        assert constant.standard_uncertainty < 0.01 * constant.value


def test_a_current_scale_that_is_far_off_gives_no_torque_constant() -> None:
    found = found_with(current_gain=0.25)
    assert not found.parameters
    assert {reason.cause for reason in found.withheld} == {"channels-differ"}
