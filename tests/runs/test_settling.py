"""Four-wire readings of a voltmeter that averages, and so has not settled when it is read."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.motor.motor_file import load_motor
from procedures.estimation.fitting.misfit import Answer
from procedures.estimation.winding.settling import unsettled
from sim_instruments.bench import VirtualBench
from tests.runs.on_bench import measure
from tests.studies.wrong_meters import averaging

FILE = load_motor("lg-400w")
MOTOR = FILE.virtual_motor()


@pytest.mark.parametrize(("time_constant", "answer"), [(0.01, ""), (0.13, "widened"), (0.3, "withheld")])
def test_a_voltmeter_that_averages_is_told_of_and_held_or_gives_no_figure(time_constant, answer):
    with VirtualBench(MOTOR, seed=3, sockets=False) as bench:
        found = measure(bench, FILE.nameplate, "stator-resistance-dc", hands=averaging(bench, time_constant))
    told = [row for row in found.findings.get("misfit", []) if row["cause"] == "unsettled"]
    assert [row["answer"] for row in told] == ([answer] if answer else [])
    assert [reason.cause for reason in found.withheld] == (["unsettled"] if answer == "withheld" else [])
    for parameter in found.parameters:
        low, high = parameter.coverage_interval
        assert low <= MOTOR.stator_resistance_y <= high


@given(
    missing=st.floats(0.0, 0.3),
    of_current=st.booleans(),
    chance=st.floats(1e-6, 1e-3),
    seed=st.integers(0, 1000),
)
def test_what_is_missing_at_the_first_reading_is_in_the_interval(missing, of_current, chance, seed):
    changes = chance * np.random.default_rng(seed).normal(size=(2, 3))
    # What an exponential rise lacks at a reading, and after twice the time; of a slow current it is as much at once.
    changes[int(of_current)] += missing if of_current else missing - missing**2
    off, misfit = unsettled(changes[0], changes[1], chance, 20.0)
    assert off + 6.0 * chance >= missing
    if misfit:
        assert (misfit.findings[0].answer is Answer.WITHHELD) is (off > 0.05)
    else:
        assert off < 10.0 * chance


def test_without_readings_or_scatter_nothing_is_said():
    assert unsettled([], [], 1e-4, 7.0) == (0.0, unsettled([0.1], [0.0], 0.0, 7.0)[1])
    assert not unsettled([], [], 1e-4, 7.0)[1]
