"""Every estimator against its bound, on few trials of a fixed seed; `tests.studies.estimators` does many."""

import numpy as np
import pytest

from tests.studies.worlds import simulated

TRIALS = {"Ld, sweep fit, turned by hand": 40, "λ, integrated, speed drifting 5 %": 40}
# The limit's bound knows the rotor's angle; where that must be found as well, no estimator reaches it. Over 500 trials the sweep
# by hand has 0.84. The sharp step's bound knows its instant and the voltage; with both to be found it is 0.92, and over 2000 trials
# the fit has 0.90.
LEAST = {"Ld, sweep fit, turned by hand": 0.6}


@pytest.mark.slow
@pytest.mark.parametrize("case", simulated.reported(), ids=lambda case: case.name)
def test_reaches_the_bound_without_bias_and_covers(case: simulated.Case) -> None:
    trials = TRIALS.get(case.name, 100)
    found = simulated.score(case, trials)
    assert found.efficiency > LEAST.get(case.name, 0.8)
    # An estimator that is better than the bound, as averages over laws that may be absent are, has a bias for it.
    better = found.efficiency > 1.0 + 3.3 * np.sqrt(2.0 / trials)
    assert better or abs(found.bias) < 3.3 / np.sqrt(trials)
    assert found.coverage >= 0.95 - 3 * np.sqrt(0.05 * 0.95 / trials)


@pytest.mark.parametrize("case", simulated.simple(), ids=lambda case: case.name)
def test_the_notes_simple_reading_is_far_from_the_bound(case: simulated.Case) -> None:
    assert simulated.score(case, 40).efficiency < 0.15


@pytest.mark.slow
def test_a_motor_without_saliency_is_rarely_said_to_have_one() -> None:
    assert simulated.false_saliency(200, timed=False) <= 0.09
    assert simulated.false_saliency(25, timed=True) <= 0.12
