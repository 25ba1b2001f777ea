"""Readings of a map that were taken again: which of them is right is told by the repeats, not by the surface."""

from dataclasses import replace

import numpy as np
import pytest

from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.flux.estimator import FluxMapEstimate, estimate_flux_map
from procedures.estimation.flux.plan import PlannedReading, grid_locations, reading_order
from tests.studies.odd_locations import GAINS, worst
from tests.studies.worlds.flux_benches import random_bench, read
from tests.studies.worlds.flux_truths import true_motors

MOTOR = true_motors(None)["reluctance"]
PLAN = list(reading_order(grid_locations(MOTOR.largest_current, 36), np.random.default_rng(2)))


def once() -> list[int]:
    """Places in the plan of currents that are read once."""
    folded = [(each.i_d, abs(each.i_q)) for each in PLAN]
    return [k for k, each in enumerate(folded) if folded.count(each) == 1]


def estimated(
    share: float, place: int, again: list[PlannedReading], *, stated: bool = True, seed: int = 5
) -> FluxMapEstimate:
    """The map of the plan and further readings, one of which is off by a share of the largest voltage."""
    random = np.random.default_rng(seed)
    readings, wanted = read(MOTOR, random_bench(MOTOR, random), [*PLAN, *again], random)
    off = share * float(np.max(np.abs(readings.voltage))) * (np.arange(readings.time.size) == place)
    readings = replace(readings, u_d=readings.u_d + 0.6 * off, u_q=readings.u_q - 0.8 * off)
    if not stated:
        nil = np.zeros(readings.time.size)
        readings = replace(readings, voltage_noise=nil, current_noise=nil)
    return estimate_flux_map(readings, gains=GAINS, wanted=wanted)


def odd(made: FluxMapEstimate) -> set[int]:
    return {int(f.figures["number"]) for f in made.misfit.findings if f.cause is Cause.ODD_READING}


def test_repeats_that_agree_say_nothing() -> None:
    made = estimated(0.0, 0, [PLAN[k] for k in once()[:4]] * 2)
    assert not odd(made)
    assert np.all(made.kept)
    assert not made.doubtful


@pytest.mark.parametrize("share", [0.015, 0.3])
@pytest.mark.parametrize("stated", [True, pytest.param(False, marks=pytest.mark.slow)])
def test_the_one_of_three_that_contradicts_is_left_out(share: float, stated: bool) -> None:
    place = once()[7]
    made = estimated(share, place, [PLAN[once()[3]], PLAN[place], PLAN[place]], stated=stated)
    assert odd(made) == {place + 1}
    assert np.flatnonzero(~made.kept).tolist() == [place]
    assert worst(MOTOR, made) < 2.0


@pytest.mark.parametrize("share", [0.01, 0.3])
def test_of_two_that_contradict_each_other_the_interval_holds_both(share: float) -> None:
    # Others show what drifts.
    place = once()[7]
    made = estimated(share, place, [PLAN[k] for k in (*once()[1:5], place)])
    assert odd(made)
    (doubtful,) = made.doubtful
    kept = PLAN[int(np.flatnonzero(made.kept)[doubtful])]
    assert (kept.i_d, abs(kept.i_q)) == (PLAN[place].i_d, abs(PLAN[place].i_q))
    assert worst(MOTOR, made) < 2.0
