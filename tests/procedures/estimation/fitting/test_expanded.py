"""Half-widths of 95 % intervals against closed forms and against drawn errors."""

import math

import numpy as np
import pytest

from procedures.estimation.fitting.expanded import half_width


def test_normal_and_student_without_a_limit_that_stands_out() -> None:
    assert half_width([], [(3.0, math.inf), (4.0, math.inf)]) == pytest.approx(1.959964 * 5.0, rel=1e-6)
    assert half_width([], [(1.0, 4.0)]) == pytest.approx(2.776445, rel=1e-6)
    assert half_width([], []) == 0.0


def test_one_limit_alone_and_two_equal_ones() -> None:
    assert half_width([2.0], []) == pytest.approx(0.95 * 2.0, rel=3e-3)
    assert half_width([1.0, 1.0], []) == pytest.approx(2.0 - math.sqrt(0.2), rel=3e-3)


@pytest.mark.parametrize(
    ("limits", "scattered"),
    [
        ([1.0], [(0.2, math.inf)]),
        ([1.0, 0.4], [(0.3, math.inf)]),
        ([1.0, 0.7, 0.05], [(0.1, 3.0)]),
        ([0.1] * 30, [(0.1, math.inf)]),
    ],
)
def test_holds_95_percent_of_drawn_errors(limits: list[float], scattered: list[tuple[float, float]]) -> None:
    random, count = np.random.default_rng(3), 200_000
    errors = sum(random.uniform(-a, a, count) for a in limits)
    for u, freedom in scattered:
        errors = errors + u * (
            random.standard_normal(count) if math.isinf(freedom) else random.standard_t(freedom, count)
        )
    held = float(np.mean(np.abs(errors) <= half_width(limits, scattered)))
    assert held == pytest.approx(0.95, abs=0.003)
