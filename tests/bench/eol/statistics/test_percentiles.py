"""Figures that are not normal: the test that says so, and indices that do not assume it."""

import math

import numpy as np
import pytest

from bench.eol.limits import ParameterLimits
from bench.eol.statistics.association import association
from bench.eol.statistics.normality import anderson_darling
from bench.eol.statistics.percentile_capability import FEWEST, PercentileCapability, by_percentiles, needed, ranks_of


def of_values(values: np.ndarray, limits: ParameterLimits, confidence: float = 0.95) -> PercentileCapability:
    data = np.sort(values)
    ranks = ranks_of(data.size, confidence)
    return by_percentiles(data.size, ranks, {rank: float(data[rank - 1]) for rank in needed(ranks, data.size)}, limits)


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.filterwarnings("ignore::FutureWarning")
def test_the_statistic_is_scipys(seed: int) -> None:
    from scipy.stats import anderson

    values = np.random.default_rng(seed).gamma(3.0, size=40 + 20 * seed)
    plain = anderson(values, "norm").statistic
    corrected = plain * (1.0 + 0.75 / values.size + 2.25 / values.size**2)
    assert anderson_darling(values).statistic == pytest.approx(corrected, rel=1e-9)


def test_normal_values_are_rejected_as_often_as_was_said() -> None:
    random = np.random.default_rng(1)
    p = np.array([anderson_darling(random.normal(5.0, 2.0, 50)).p for _ in range(4000)])
    for level in (0.01, 0.05, 0.25, 0.5):
        assert np.mean(p < level) == pytest.approx(level, abs=4.0 * math.sqrt(level / 4000))


def test_other_values_are_seen_and_too_few_are_not() -> None:
    random = np.random.default_rng(1)
    assert anderson_darling(np.exp(0.5 * random.standard_normal(200))).p < 1e-4
    assert anderson_darling(np.exp(random.standard_normal(10_000))).p == 0.0
    assert math.isnan(anderson_darling([1.0, 2.0, 3.0]).p)
    assert math.isnan(anderson_darling([1.0] * 50).p)
    assert not anderson_darling([1.0] * 50).rejected(0.01)


def test_a_lognormal_process() -> None:
    random = np.random.default_rng(3)
    # At the limit 1570 of a million lie beyond.
    spread = 0.5
    limits = ParameterLimits(high=math.exp(spread * 2.9538))
    truth = (limits.high - 1.0) / (math.exp(3.0 * spread) - 1.0)
    assert truth == pytest.approx(0.97, abs=0.01)
    found = [of_values(np.exp(spread * random.standard_normal(8000)), limits) for _ in range(200)]
    assert np.median([each.ppk for each in found]) == pytest.approx(truth, abs=0.03)
    held = [each.ppk_interval[0] <= truth <= each.ppk_interval[1] for each in found]
    assert np.mean(held) >= 0.95
    assert all(math.isnan(each.pp) for each in found)


@pytest.mark.parametrize("count", [3, 100, 1000, 3000])
def test_the_intervals_hold_whatever_the_distribution(count: int) -> None:
    random = np.random.default_rng(count)
    limits = ParameterLimits(-1.0, 9.0)
    low, middle, high = (-math.log1p(-share) for share in (0.00135, 0.5, 0.99865))
    pp = 10.0 / (high - low)
    ppk = min((9.0 - middle) / (high - middle), (middle + 1.0) / (middle - low))
    found = [of_values(random.exponential(size=count), limits) for _ in range(300)]
    assert np.mean([each.pp_interval[0] <= pp <= each.pp_interval[1] for each in found]) >= 0.94
    assert np.mean([each.ppk_interval[0] <= ppk <= each.ppk_interval[1] for each in found]) >= 0.94
    assert all(math.isnan(each.ppk) == (count < FEWEST) for each in found)


def test_motors_that_failed_stand_out() -> None:
    random = np.random.default_rng(1)
    plain = [association("f", "p", random.normal(0.0, 1.0, 20), 0.0, 1.0, 0.95, 10) for _ in range(500)]
    assert np.mean([each is not None and each.certain for each in plain]) < 0.03
    found = association("f", "p", random.normal(2.0, 1.0, 20), 0.0, 1.0, 0.95, 10)
    assert found is not None
    assert found.certain
    assert found.interval[0] < 2.0 < found.interval[1]
    assert association("f", "p", [1.0, 2.0], 0.0, 1.0, 0.95, 1) is None


def test_three_motors_of_one_socket_do_not_stand_out() -> None:
    # Four sockets, each with an error of its own; three of twelve motors failed, all at one socket.
    sockets = np.repeat([1.018, 0.987, 1.016, 1.004], 3) + np.tile([0.0, 1e-4, 2e-4], 4)
    found = association("f", "p", sockets[:3], float(sockets.mean()), float(sockets.std(ddof=1)), 0.95, 60)
    assert found is not None
    assert found.offset > 0.8
    assert not found.certain
