"""A torque constant of an inverter whose current scale is wrong, against the flux linkage that is known."""

import math

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.parameter_set import merge
from procedures.plausibility.consistency import check_consistency
from sim_instruments.bench import VirtualBench
from sim_instruments.instruments.errors import Errors, InverterErrors
from tests.runs.on_bench import measure
from tests.studies.wrong_meters import known

FILE = load_motor("lg-400w")
MOTOR = FILE.virtual_motor()


KNOWN = known(MOTOR, 0.004)


def found_with(gain: float):
    errors = Errors(inverter=InverterErrors(current_gain=gain))
    with VirtualBench(MOTOR, seed=5, sockets=False, errors=errors) as bench:
        return measure(bench, FILE.nameplate, "torque-constant", "levels=2", known=KNOWN)


@pytest.mark.parametrize(("gain", "said"), [(0.0, False), (0.03, False), (-0.07, True), (0.08, True)])
def test_both_figures_hold_the_truth_where_they_contradict_each_other(gain, said):
    found = found_with(gain)
    assert len(found.parameters) == 2
    for parameter in found.parameters:
        low, high = parameter.coverage_interval
        assert low <= MOTOR.torque_constant <= high
    assert [w.identifier for w in found.warnings] == (["channels-differ"] if said else [])


@pytest.mark.parametrize(("gain", "named"), [(0.2, None), (math.sqrt(2.0) - 1.0, "rms current entered for peak")])
def test_a_wrong_current_scale_gives_no_torque_constant_and_its_factor_is_named(gain, named):
    found = found_with(gain)
    assert not found.parameters
    assert {reason.cause for reason in found.withheld} == {"channels-differ"}
    run = merge([found])
    run.parameters.update(KNOWN)
    alarms = check_consistency(run, {"torque-constant": found.findings}, FILE.nameplate)
    said = [str(alarm.message) for alarm in alarms if alarm.identifier == "consistency-torque-constant"]
    assert [named in each for each in said] == ([True] if named else [])
