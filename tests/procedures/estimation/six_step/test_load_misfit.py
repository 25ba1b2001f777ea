"""Loads of a six-step drive that contradict each other, from readings of an exact steady state."""

import math

import numpy as np
import pytest

from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.six_step.currents import fold, supplied_average
from procedures.estimation.six_step.load_misfit import bend
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import steady_state
from tests.studies import six_step_misfit as study


@pytest.fixture(scope="module")
def run():
    """A run of five loads of the shipped drive's kind, with what is done to its meters."""

    def measured(name="clean", *, seed=3, **factors):
        random = np.random.default_rng(seed)
        world = study.disturbed(name, study.world(name, random), random)
        for quantity, (load, factor) in factors.items():
            world.factors[quantity][load] *= factor
        return world, study.measured(world, name, random)

    return measured


def causes(result):
    return {(row["cause"], row["answer"]) for row in result.findings.get("misfit", ())}


def test_nothing_is_said_of_loads_that_are_as_the_model_says(run):
    world, result = run()
    assert not causes(result)
    assert {p.name for p in result.parameters} == set(study.truths(world, range(len(world.states))))


def test_a_bus_voltage_off_the_others_is_left_out_and_the_rest_holds_the_truth(run):
    world, result = run(voltage=(1, 1.05))
    assert causes(result) == {("load-point", "modelled")}
    kept = [k for k in range(len(world.states)) if k != 1]
    assert len(result.findings["points"]) == len(kept)
    for name, truth in study.truths(world, kept).items():
        low, high = result.parameter(name).coverage_interval
        assert low - 0.5 * (high - low) <= truth <= high + 0.5 * (high - low), name


def test_a_wild_speed_is_taken_from_the_current_s_frequency(run):
    world, result = run(speed=(2, 0.1))
    assert causes(result) == {("dropouts", "modelled")}
    assert result.findings["points"][2]["speed_rpm"] == pytest.approx(world.states[2].speed * 30.0 / math.pi, rel=1e-4)


def test_a_wrong_probe_factor_withholds_every_figure(run):
    _, result = run(line=(slice(None), 0.5))
    assert not result.parameters
    assert {w.cause for w in result.withheld} == {"probe-factor"}
    assert "E14" not in {w.identifier for w in result.warnings}


def test_a_wrong_torque_touches_no_figure(run):
    _, result = run(torque=(1, 0.6))
    assert ("load-point", "widened") in causes(result)
    assert len(result.parameters) == 7


def test_a_gain_of_the_voltage_shows_in_the_power(run):
    _, result = run(voltage=(slice(None), 1.2))
    assert ("power-balance", "withheld") in causes(result)


@pytest.mark.parametrize("bent", [0.0, 0.2])
def test_a_bend_is_seen_where_there_is_one(bent):
    speed = np.linspace(200.0, 300.0, 6)
    resistance = 0.2 * (1.0 + bent * ((speed - 250.0) / 50.0) ** 2) + 1e-3 * np.array([1, -1, 0, 1, -1, 0])
    found = bend(speed, resistance)
    if not bent:
        assert found is None
    else:
        (finding,) = found.misfit.findings
        assert (finding.cause, finding.answer) == (Cause.CURVATURE, Answer.WIDENED)
        assert found.turned == pytest.approx(2.0 * 0.04 / 50.0, rel=0.05)


@pytest.mark.parametrize("speed", [120.0, 250.0, 380.0])
def test_the_line_s_waveform_gives_the_current_out_of_the_source(speed):
    """The state's beginning is told to a fraction of half a degree, whatever instant the record begins at."""
    from bench.motor.motor_file import load_motor

    state = steady_state(Bridge(load_motor("92bl-30-25l").six_step), speed)
    for begun in (0.0, 0.37):
        time = np.linspace(0.0, 20.0 * state.period, 40_000, endpoint=False)
        line = fold(time, state.line_currents(time + begun * state.period)[0], 1.0 / state.period)
        assert supplied_average(line) == pytest.approx(state.average_supply_current, rel=3e-3)
