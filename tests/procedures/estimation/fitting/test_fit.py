import numpy as np
import pytest

from procedures.estimation.fitting.checks import series, uniform_step
from procedures.estimation.fitting.fit import EstimationError, Fit, coverage_interval
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.fitting.noise import undithered, white_noise

FIT = Fit(("a", "b"), np.array([1.0, 2.0]), np.array([[0.04, 0.03], [0.03, 0.09]]), 10.0, np.zeros(12), 0.0)


def test_values_uncertainties_and_correlation_go_by_name() -> None:
    assert FIT.value("b") == 2.0
    assert FIT.uncertainty("a") == pytest.approx(0.2)
    assert FIT.correlation("a", "b") == pytest.approx(0.5)
    with pytest.raises(KeyError, match=r"no parameter 'c'.*a, b"):
        FIT.value("c")


def test_derived_quantities_carry_the_covariance() -> None:
    difference = FIT.derived(("d",), [1.0], np.array([[-1.0, 1.0]]))
    assert difference.uncertainty("d") == pytest.approx(np.sqrt(0.04 + 0.09 - 2 * 0.03))


def test_coverage_interval_follows_student_for_few_degrees_of_freedom() -> None:
    assert coverage_interval(0.0, 1.0, 10.0) == pytest.approx((-2.2281, 2.2281), abs=1e-4)
    assert coverage_interval(0.0, 1.0, np.inf)[1] == pytest.approx(1.95996, abs=1e-4)


def test_residuals_hidden_by_rounding_still_leave_an_uncertainty() -> None:
    x = np.arange(10.0)
    exact = least_squares(("slope", "offset"), np.column_stack((x, np.ones(10))), 2 * x, resolution=0.1)
    assert exact.uncertainty("slope") == pytest.approx(0.1 / np.sqrt(12 * np.sum((x - x.mean()) ** 2)))


def test_bad_series_are_refused_with_the_place() -> None:
    with pytest.raises(EstimationError, match="not numbers, the first at point 1"):
        series("speed", [1.0, np.nan])
    with pytest.raises(EstimationError, match="at least 5"):
        series("speed", [1.0], least=5)
    with pytest.raises(EstimationError, match="between points 2 and 3"):
        uniform_step(np.array([0.0, 1.0, 2.0, 5.0, 6.0, 7.0]))
    with pytest.raises(EstimationError, match="does not increase at point 2"):
        uniform_step(np.array([0.0, 1.0, 1.0]))


def test_noise_is_seen_beside_a_smooth_signal_and_a_jump() -> None:
    random = np.random.default_rng(1)
    signal = np.linspace(0, 5, 4000) ** 2 + np.where(np.arange(4000) > 2000, 50.0, 0.0)
    assert white_noise(signal + random.normal(0, 0.3, 4000)) == pytest.approx(0.3, rel=0.05)
    assert white_noise(np.ones(100), resolution=0.12) == pytest.approx(0.12 / np.sqrt(12))


def test_rounding_averages_out_only_with_enough_noise() -> None:
    assert undithered(np.hypot(1.0, 1 / np.sqrt(12)), 1.0) < 1e-8
    assert undithered(1 / np.sqrt(12), 1.0) == pytest.approx(1 / (np.pi * np.sqrt(2)))
    assert undithered(0.5, 0.0) == 0.0
