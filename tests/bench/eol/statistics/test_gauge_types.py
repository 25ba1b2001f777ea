"""Studies of gauges, against AIAG, Measurement Systems Analysis, 4th edition."""

import math

import numpy as np
import pytest

from bench.eol.statistics.control_chart import individuals_chart
from bench.eol.statistics.gauge_types import linearity, range_study, type_one

#: Chapter III B, linearity: five parts of known value, twelve trials each.
REFERENCES = (2.0, 4.0, 6.0, 8.0, 10.0)
TRIALS = (
    (2.7, 2.5, 2.4, 2.5, 2.7, 2.3, 2.5, 2.5, 2.4, 2.4, 2.6, 2.4),
    (5.1, 3.9, 4.2, 5.0, 3.8, 3.9, 3.9, 3.9, 3.9, 4.0, 4.1, 3.8),
    (5.8, 5.7, 5.9, 5.9, 6.0, 6.1, 6.0, 6.1, 6.4, 6.3, 6.0, 6.1),
    (7.6, 7.7, 7.8, 7.7, 7.8, 7.8, 7.8, 7.7, 7.8, 7.5, 7.6, 7.7),
    (9.1, 9.3, 9.5, 9.3, 9.4, 9.5, 9.5, 9.5, 9.6, 9.2, 9.3, 9.4),
)


def test_the_handbooks_linearity() -> None:
    known = [reference for reference, trials in zip(REFERENCES, TRIALS, strict=True) for _ in trials]
    found = linearity(known, [value for trials in TRIALS for value in trials])
    assert (found.slope, found.intercept) == pytest.approx((-0.131667, 0.736667), abs=1e-6)
    assert (found.slope_t, found.intercept_t) == pytest.approx((-12.043, 10.158), abs=1e-3)
    assert found.r_squared == pytest.approx(0.714, abs=1e-3)
    assert [each.bias for each in found.biases] == pytest.approx(
        [0.491667, 0.125, 0.025, -0.291667, -0.616667], abs=1e-6
    )
    assert not found.acceptable


def test_the_handbooks_range_method() -> None:
    values = [[0.85, 0.75, 1.00, 0.45, 0.50], [0.80, 0.70, 0.95, 0.55, 0.60]]
    found = range_study(values, whole=0.0777)
    assert found.mean_range == pytest.approx(0.07)
    assert found.grr == pytest.approx(0.0588, abs=5e-5)
    assert 100.0 * found.share == pytest.approx(75.7, abs=0.1)
    assert found.grr_interval[0] < found.grr < found.grr_interval[1]


def test_the_ranges_interval_holds_the_true_r_and_r() -> None:
    random = np.random.default_rng(4)
    held = []
    for _ in range(600):
        values = random.normal(0.0, 2.0, (1, 10)) + random.normal(0.0, 0.3, (3, 10))
        low, high = range_study(values, whole=1.0).grr_interval
        held.append(low <= 0.3 <= high)
    assert 0.92 <= np.mean(held) <= 0.98


def test_cg_and_cgk_by_hand() -> None:
    values = [6.0 + 0.01 * (n % 5) for n in range(25)]
    spread = float(np.std(values, ddof=1))
    found = type_one(values, 6.0, 1.0)
    assert found.bias == pytest.approx(0.02)
    assert found.cg == pytest.approx(0.2 / (6.0 * spread))
    assert found.cgk == pytest.approx((0.1 - 0.02) / (3.0 * spread))
    assert found.cgk_interval[0] < found.cgk < found.cgk_interval[1]
    # AIAG's study of bias, reference 6: mean 6.0067 of 15.
    of_aiag = [5.8, 5.7, 5.9, 5.9, 6.0, 6.1, 6.0, 6.1, 6.4, 6.3, 6.0, 6.1, 6.2, 5.6, 6.0]
    biased = type_one(of_aiag, 6.0, 10.0)
    assert biased.bias == pytest.approx(0.0067, abs=1e-4)
    assert biased.bias_interval[0] < 0.0 < biased.bias_interval[1]


@pytest.mark.parametrize(("values", "tolerance"), [([1.0] * 9, 1.0), ([1.0] * 20, math.inf), ([math.nan] * 20, 1.0)])
def test_what_is_no_type_one_study(values: list[float], tolerance: float) -> None:
    with pytest.raises(ValueError, match="type-1 study needs"):
        type_one(values, 1.0, tolerance)


def test_what_is_no_linearity_and_no_range_study() -> None:
    with pytest.raises(ValueError, match="different known values"):
        linearity([1.0, 1.0, 1.0], [1.0, 1.1, 0.9])
    with pytest.raises(ValueError, match="2 to 10 appraisers"):
        range_study([[1.0, 2.0]], whole=1.0)


def test_a_gauge_that_is_stable_and_one_that_is_not() -> None:
    random = np.random.default_rng(1)
    shifts = random.normal(6.021, 0.2, 40)
    assert individuals_chart(shifts).signals == ()
    assert individuals_chart(np.concatenate([shifts, shifts[:20] + 0.5])).signals
