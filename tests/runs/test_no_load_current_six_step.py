"""The six-step drive's no-load current against the exact model's own."""

import math
from dataclasses import replace

import pytest

from bench.motor.motor_file import load_motor
from procedures.core.bench import ProcedureError
from sim_instruments.bench import VirtualBench
from sim_instruments.six_step.load import balance_load
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import steady_state
from tests.runs.on_bench import measure, within

FILE = load_motor("92bl-30-25l")
NAME = "no-load-current-six-step"


@pytest.fixture
def bench():
    with VirtualBench(FILE.virtual_motor(), seed=2, sockets=False, six_step=FILE.six_step) as virtual:
        yield virtual


def test_it_is_that_of_the_model_at_this_speed(bench):
    result = measure(bench, FILE.nameplate, NAME)
    drive = FILE.six_step
    speed = 2.0 * math.pi * result.findings["frequency"] / drive.pole_pairs
    found = result.parameter("no_load_bus_current")
    assert within(found, steady_state(Bridge(drive), speed).average_supply_current)
    assert found.unit == "A"


def test_a_bearing_that_brakes_takes_more(bench):
    usual = measure(bench, FILE.nameplate, NAME).parameter("no_load_bus_current").value
    motor = FILE.virtual_motor()
    braked = replace(motor, coulomb_friction=motor.coulomb_friction + 0.05)
    with VirtualBench(braked, seed=2, sockets=False, six_step=FILE.six_step) as other:
        assert measure(other, FILE.nameplate, NAME).parameter("no_load_bus_current").value > 1.5 * usual


@pytest.mark.parametrize(
    "factor", [pytest.param(5.0, marks=pytest.mark.slow), 20.0, pytest.param(60.0, marks=pytest.mark.slow)]
)
def test_what_accelerates_a_heavy_rotor_is_no_no_load_current(factor):
    """A flywheel runs up for as long as the readings last: the mean of the first ones was 9 % and 67 % too high."""
    heavy = replace(FILE.virtual_motor(), inertia=factor * FILE.virtual_motor().inertia)
    drive = replace(FILE.six_step, inertia=factor * FILE.six_step.inertia)
    with VirtualBench(heavy, seed=2, sockets=False, six_step=drive) as other:
        found = measure(other, FILE.nameplate, NAME).parameter("no_load_bus_current")
    truth = balance_load(Bridge(FILE.six_step), 0.0).average_supply_current
    assert within(found, truth)
    assert found.value == pytest.approx(truth, rel=0.015)


@pytest.mark.slow
def test_a_rotor_that_runs_up_for_longer_is_refused():
    heavy = replace(FILE.virtual_motor(), inertia=1000.0 * FILE.virtual_motor().inertia)
    drive = replace(FILE.six_step, inertia=1000.0 * FILE.six_step.inertia)
    with (
        VirtualBench(heavy, seed=2, sockets=False, six_step=drive) as other,
        pytest.raises(ProcedureError, match="still accelerates the rotor"),
    ):
        measure(other, FILE.nameplate, NAME)


def test_a_speed_that_does_not_settle_is_no_no_load(bench):
    with pytest.raises(ProcedureError, match="still changes"):
        measure(bench, FILE.nameplate, NAME, "longest=0.01", "steady=1e-9", "look=0.005")
