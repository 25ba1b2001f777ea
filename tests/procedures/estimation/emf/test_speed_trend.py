import numpy as np
import pytest

from procedures.estimation.emf.agreement import Combined
from procedures.estimation.emf.speed_trend import over_records, over_speeds
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Answer, Cause

FREQUENCIES = np.array([30.0, 50.0, 80.0, 130.0, 210.0, 340.0])


def test_one_speed_is_itself() -> None:
    over = over_speeds([50.0], [3.1e-3], [1e-6])
    assert (over.value, over.uncertainty) == (3.1e-3, 1e-6)
    assert not over.misfit


def test_speeds_that_agree_are_averaged() -> None:
    said = 0
    for seed in range(200):
        values = 3e-3 + np.random.default_rng(seed).normal(0, 1e-6, 6)
        over = over_speeds(FREQUENCIES, values, np.full(6, 1e-6))
        said += bool(over.misfit)
        assert over.value == pytest.approx(np.mean(values))
    assert said <= 4


def test_a_trend_over_three_speeds_gives_the_table_and_no_figure() -> None:
    over = over_speeds([29.2, 58.3, 116.6], [3.161e-3, 3.136e-3, 3.117e-3], [2.3e-6] * 3)
    (finding,) = over.misfit.findings
    assert (finding.cause, finding.answer) == (Cause.SPEED_TREND, Answer.WITHHELD)
    assert finding.figures["span"] == pytest.approx(0.014, abs=5e-4)
    intercepts = [law.value for law in over.laws]
    assert min(intercepts) == pytest.approx(3.10e-3, abs=1e-5)
    assert max(intercepts) == pytest.approx(3.20e-3, abs=1e-5)


def test_five_speeds_and_one_law_give_the_flux_at_no_speed() -> None:
    true, spread = 3e-3, 3e-7
    held = 0
    for seed in range(40):
        values = true * (1 - 0.05 * (FREQUENCIES / 340) ** 2) + np.random.default_rng(seed).normal(0, spread, 6)
        over = over_speeds(FREQUENCIES, values, np.full(6, spread))
        if over.law != "f²":
            # Chance leaves the right law in one of twenty.
            assert over.misfit.withholding("flux_linkage")
            continue
        assert over.misfit.findings[0].answer is Answer.MODELLED
        held += abs(over.value - true) < 3 * over.uncertainty
    assert held >= 34


def test_a_small_trend_widens_the_interval_by_all_laws() -> None:
    values = 3e-3 * (1 + 2e-3 * FREQUENCIES[:3] / 80)
    over = over_speeds(FREQUENCIES[:3], values, np.full(3, 3e-7))
    assert over.misfit.findings[0].answer is Answer.WIDENED
    assert abs(over.value - 3e-3) < 2 * over.uncertainty


def test_a_trend_within_the_stated_gain_is_not_told_twice() -> None:
    over = over_speeds([29.2, 58.3, 116.6], [3.161e-3, 3.136e-3, 3.117e-3], [2.3e-6] * 3, gain_limit=0.02)
    assert not over.misfit


def test_a_law_over_many_speeds_is_told_within_the_stated_gain() -> None:
    values = 3e-3 * (1 - 0.02 * FREQUENCIES / 340) + np.random.default_rng(3).normal(0, 2e-7, 6)
    over = over_speeds(FREQUENCIES, values, np.full(6, 2e-7), gain_limit=0.04)
    assert over.misfit.findings[0].cause is Cause.SPEED_TREND
    assert abs(over.value - 3e-3) < 3 * over.uncertainty


def test_ranges_that_err_by_themselves_are_no_trend() -> None:
    said = 0
    for seed in range(300):
        random = np.random.default_rng(seed)
        own = 3e-3 * 10 ** random.uniform(-5, -2.5)
        values = 3e-3 * (1 + random.uniform(-0.01, 0.01, 6)) + random.normal(0, own, 6)
        said += bool(over_speeds(FREQUENCIES, values, np.full(6, own), gain_limit=0.02).misfit)
    assert said <= 3


def test_what_channels_differ_by_is_not_averaged_away_over_speeds() -> None:
    records = [Combined(3e-3, 2e-5, 2.0, scatter=2e-5)] * 4
    over = over_records(FREQUENCIES[:4], records)
    assert over.uncertainty == pytest.approx(2e-5)
    assert over.degrees_of_freedom == pytest.approx(2.0)


def test_a_frequency_that_is_none_is_refused() -> None:
    with pytest.raises(EstimationError, match="not above 0 Hz"):
        over_speeds([0.0, 1.0], [1.0, 1.0], [0.1, 0.1])
