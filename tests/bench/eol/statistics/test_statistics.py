import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import ArrayLike

from bench.eol.limits import ParameterLimits
from bench.eol.statistics.capability import Capability, of_moments, spread_within
from bench.eol.statistics.control_chart import SHIFT, Signal, individuals_chart, simulated_false_alarms
from bench.eol.statistics.drift import drift
from bench.eol.statistics.gauge import gauge_study
from bench.eol.statistics.proportion import proportion

#: AIAG, Measurement Systems Analysis, 4th edition, gauge R&R data sheet: 3 appraisers, 10 parts, 3 trials.
AIAG = np.array(
    [
        [
            [0.29, -0.56, 1.34, 0.47, -0.80, 0.02, 0.59, -0.31, 2.26, -1.36],
            [0.41, -0.68, 1.17, 0.50, -0.92, -0.11, 0.75, -0.20, 1.99, -1.25],
            [0.64, -0.58, 1.27, 0.64, -0.84, -0.21, 0.66, -0.17, 2.01, -1.31],
        ],
        [
            [0.08, -0.47, 1.19, 0.01, -0.56, -0.20, 0.47, -0.63, 1.80, -1.68],
            [0.25, -1.22, 0.94, 1.03, -1.20, 0.22, 0.55, 0.08, 2.12, -1.62],
            [0.07, -0.68, 1.34, 0.20, -1.28, 0.06, 0.83, -0.34, 2.19, -1.50],
        ],
        [
            [0.04, -1.38, 0.88, 0.14, -1.46, -0.29, 0.02, -0.46, 1.77, -1.49],
            [-0.11, -1.13, 1.09, 0.20, -1.07, -0.67, 0.01, -0.56, 1.45, -1.77],
            [-0.15, -0.96, 0.67, 0.11, -1.45, -0.49, 0.21, -0.49, 1.87, -2.16],
        ],
    ]
).transpose(0, 2, 1)


def test_the_aiag_example() -> None:
    study = gauge_study(AIAG)
    assert study.pooled
    assert study.interaction_p == pytest.approx(0.974, abs=0.001)
    assert study.repeatability == pytest.approx(0.199933, abs=2e-6)
    assert study.reproducibility == pytest.approx(0.226838, abs=2e-6)
    assert study.grr == pytest.approx(0.302373, abs=2e-6)
    assert study.parts == pytest.approx(1.042327, abs=2e-6)
    assert study.total == pytest.approx(1.085300, abs=2e-6)
    assert 100.0 * study.grr_share == pytest.approx(27.86, abs=0.01)
    assert study.categories == 4


def test_an_alpha_that_keeps_the_interaction() -> None:
    kept = gauge_study(AIAG, alpha=0.99)
    assert not kept.pooled
    assert kept.repeatability == pytest.approx(math.sqrt(2.7589 / 60), abs=1e-5)
    assert kept.interaction == 0.0


def test_the_interval_holds_the_true_r_and_r() -> None:
    random = np.random.default_rng(4)
    held = []
    for _ in range(300):
        data = random.normal(0, 1.0, (1, 10, 1)) + random.normal(0, 0.2, (3, 1, 1)) + random.normal(0, 0.3, (3, 10, 3))
        low, high = gauge_study(data).grr_interval
        held.append(low <= math.hypot(0.2, 0.3) <= high)
    assert 0.91 <= np.mean(held) <= 0.99


@pytest.mark.parametrize("shape", [(3, 10), (1, 10, 3), (3, 10, 1)])
def test_what_is_no_crossed_study(shape: tuple[int, ...]) -> None:
    with pytest.raises(ValueError, match="appraisers × parts × trials"):
        gauge_study(np.zeros(shape))


def test_a_missing_figure_is_refused() -> None:
    data = AIAG.copy()
    data[0, 0, 0] = math.nan
    with pytest.raises(ValueError, match="missing"):
        gauge_study(data)


def test_capability_by_hand() -> None:
    result = of_moments(50, 16.0, 2.0, ParameterLimits(8.0, 20.0))
    # NIST/SEMATECH e-Handbook 7.1.6: limits 8 and 20, mean 16, standard deviation 2.
    assert result.cp == pytest.approx(1.0)
    assert result.cpk == pytest.approx(0.6667, abs=1e-4)
    low, high = result.cp_interval
    assert (low, high) == pytest.approx((0.8025, 1.1971), abs=5e-4)


def of_values(values: ArrayLike, limits: ParameterLimits) -> Capability:
    data = np.asarray(values, dtype=np.float64)
    spread = float(data.std(ddof=1)) if data.size > 1 else math.nan
    return of_moments(data.size, float(data.mean()) if data.size else math.nan, spread, limits)


def test_the_intervals_hold_the_true_capability() -> None:
    random = np.random.default_rng(2)
    limits, cp, cpk = ParameterLimits(-4.0, 4.0), 4.0 / 3.0, 3.5 / 3.0
    result = [of_values(random.normal(0.5, 1.0, 40), limits) for _ in range(400)]
    assert 0.92 <= np.mean([c.cp_interval[0] <= cp <= c.cp_interval[1] for c in result]) <= 0.98
    assert 0.91 <= np.mean([c.cpk_interval[0] <= cpk <= c.cpk_interval[1] for c in result]) <= 0.98


def test_an_open_side_has_a_cpk_and_no_cp() -> None:
    result = of_moments(10, 5.0, 1.0, ParameterLimits(low=2.0))
    assert math.isnan(result.cp)
    assert result.cpk == pytest.approx(1.0)


@pytest.mark.parametrize("values", [[], [1.0], [2.0, 2.0, 2.0]])
def test_too_little_to_say(values: list[float]) -> None:
    assert math.isnan(of_values(values, ParameterLimits(0.0, 1.0)).cpk)


QUIET = [0.1, -0.1, 0.2, -0.2, 0.15, -0.05, -0.15, 0.05, 0.1, -0.1]


@pytest.mark.parametrize(
    ("tail", "rule"),
    [
        ([2.0], 1),
        ([0.05] * 9, 2),
        ([-0.2, -0.15, -0.1, -0.05, 0.0, 0.05], 3),
        ([0.1, -0.1] * 8, 4),
        ([0.5, 0.0, 0.5], 5),
        ([0.3, 0.3, 0.3, 0.3], 6),
        ([0.01] * 8 + [-0.01] * 7, 7),
        ([0.3, -0.3] * 4, 8),
    ],
)
def test_each_rule_sees_its_pattern(tail: list[float], rule: int) -> None:
    # So many that the tail hardly moves centre and sigma.
    values = QUIET * 20 + tail
    assert Signal(len(values) - 1, rule) in individuals_chart(values, rules=(rule,)).signals


@pytest.mark.parametrize("points", [10, 40, 250])
def test_charts_of_noise_seldom_signal(points: int) -> None:
    random = np.random.default_rng(points)
    charts = [individuals_chart(random.standard_normal(points)) for _ in range(2000)]
    assert all(chart.false_alarms == 0.01 for chart in charts)
    assert np.mean([bool(chart.signals) for chart in charts]) <= 0.01
    skewed = [individuals_chart(np.exp(random.standard_normal(points)), normal=False) for _ in range(2000)]
    assert np.mean([bool(chart.signals) for chart in skewed]) <= 0.01


def test_a_shift_and_a_point_far_off_are_seen() -> None:
    random = np.random.default_rng(3)
    seen = []
    for _ in range(200):
        values = random.standard_normal(100)
        values[60:] += 1.5
        signals = individuals_chart(values).signals
        seen.append(any(signal.rule == SHIFT and 50 <= signal.index <= 70 for signal in signals))
    assert np.mean(seen) > 0.95
    values = random.standard_normal(100)
    values[30] = 7.0
    assert Signal(30, 1) in individuals_chart(values).signals


def test_what_nelsons_rules_cost() -> None:
    assert simulated_false_alarms((1, 2, 3, 5, 6), 100) == pytest.approx(0.64, abs=0.03)
    # NIST/SEMATECH 6.3.1: one point of 370 lies beyond 3 known sigma; limits from the same points leave somewhat fewer out.
    assert 0.2 < simulated_false_alarms((1,), 100) < 0.30


def test_a_quiet_process_gives_no_signal() -> None:
    assert individuals_chart(QUIET).signals == ()


def test_limits_come_from_the_moving_range() -> None:
    chart = individuals_chart([1.0, 2.0, 1.0, 2.0], rules=(1,))
    assert chart.sigma == pytest.approx(1.0 / 1.128379)
    assert chart.high == pytest.approx(1.5 + 3.0 / 1.128379)


def test_a_limit_where_no_value_can_be_is_none() -> None:
    values = [0.1, 1.2, 0.3, 0.9, 0.2, 1.1]
    assert individuals_chart(values).low < 0.0
    bounded = individuals_chart(values, possible=(0.0, math.inf))
    assert (bounded.low, bounded.high) == (-math.inf, individuals_chart(values).high)
    assert individuals_chart(values, possible=(-math.inf, 1.5)).high == math.inf


#: Of few lengths: the share of false alarms of each is simulated anew.
@given(st.sampled_from((2, 9, 40)).flatmap(lambda n: st.lists(st.floats(-10, 10), min_size=n, max_size=n)))
def test_turning_the_values_over_breaks_the_same_rules(values: list[float]) -> None:
    up = individuals_chart(values, rules=(2, 3, 4)).signals
    assert individuals_chart([-value for value in values], rules=(2, 3, 4)).signals == up


def test_the_handbooks_chart() -> None:
    # NIST/SEMATECH e-Handbook 6.3.2.2, flow rates: mean 50.81, mean range 1.8778, limits 45.8159 and 55.8041.
    chart = individuals_chart([49.6, 47.6, 49.9, 51.3, 47.8, 51.2, 52.6, 52.4, 53.6, 52.1], rules=(1,))
    assert chart.centre == pytest.approx(50.81)
    assert chart.sigma * 1.128379 == pytest.approx(1.8778, abs=1e-4)
    # The handbook's factor is 2.66 for 3/1.128 = 2.6596.
    assert (chart.low, chart.high) == pytest.approx((45.8159, 55.8041), abs=3e-3)
    assert chart.signals == ()


def test_the_handbooks_share() -> None:
    # NIST/SEMATECH e-Handbook 7.2.4.1: 4 of 20, 90 %.
    result = proportion(4, 20, 0.90)
    assert result.share == pytest.approx(0.2)
    assert result.interval == pytest.approx((0.071354, 0.401029), abs=2e-6)


def test_shares_at_the_ends() -> None:
    none, all_of_them = proportion(0, 20), proportion(20, 20)
    # The rule of three, exactly: 1 − 0.025^(1/20).
    assert none.interval == pytest.approx((0.0, 1.0 - 0.025 ** (1 / 20)))
    assert all_of_them.interval == pytest.approx((0.025 ** (1 / 20), 1.0))
    assert math.isnan(proportion(0, 0).share)
    with pytest.raises(ValueError, match="5 of 4"):
        proportion(5, 4)


@given(st.integers(0, 400), st.integers(1, 400))
def test_the_interval_holds_the_share(hits: int, more: int) -> None:
    result = proportion(hits, hits + more)
    assert result.interval[0] <= result.share <= result.interval[1]


def test_neighbours_tell_the_spread_that_a_drift_does_not_hide() -> None:
    random = np.random.default_rng(6)
    rows = (random.normal(0.0, 0.3, (20, 250)) + np.linspace(0.0, 30.0, 20)[:, None]).tolist()
    within, freedom = spread_within(rows)
    assert within == pytest.approx(0.3, rel=0.03)
    assert freedom == pytest.approx(0.62 * 20 * 249)
    assert np.std(rows) > 5.0
    assert math.isnan(spread_within([[1.0], []])[0])


def test_the_freedom_of_a_mean_moving_range() -> None:
    random = np.random.default_rng(7)
    result = np.array([spread_within([random.normal(0.0, 1.0, 100).tolist()])[0] for _ in range(2000)])
    # A standard deviation with ν degrees of freedom scatters by 1/√(2ν) of itself.
    assert 1.0 / (2.0 * result.std() ** 2) == pytest.approx(spread_within([[0.0, 1.0] * 50])[1], rel=0.08)


def test_a_drift_and_its_interval() -> None:
    days = np.arange(20.0)
    held, seen = [], 0
    for seed in range(300):
        noise = np.random.default_rng(seed).normal(0.0, 0.1, 20)
        result = drift(86400.0 * days, 5.0 + 0.05 * days + noise)
        held.append(result.slope_interval[0] <= 0.05 <= result.slope_interval[1])
        seen += drift(86400.0 * days, 5.0 + noise).significant
    assert 0.92 <= np.mean(held) <= 0.98
    assert seen <= 30
    assert result.significant
    assert result.change == pytest.approx(19.0 * result.slope)


@pytest.mark.parametrize("times", [[], [1.0, 2.0], [3.0, 3.0, 3.0]])
def test_too_few_to_tell_a_drift(times: list[float]) -> None:
    result = drift(times, [1.0] * len(times))
    assert math.isnan(result.slope)
    assert not result.significant
