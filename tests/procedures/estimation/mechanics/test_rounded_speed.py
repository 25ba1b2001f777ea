"""A speed column of few digits: its rounding is known noise, and no sign of another friction."""

import math

import numpy as np
import pytest

from procedures.estimation.fitting.noise import rounded_to
from procedures.estimation.mechanics.inertia import fit_coast_down

RPM = math.pi / 30.0


@pytest.mark.parametrize("unit", [1.0, RPM])
def test_a_computed_coast_down_with_one_decimal_is_not_told_and_held(unit: float) -> None:
    random = np.random.default_rng(1)
    held = told = 0
    for _ in range(20):
        top, count, seconds = (
            random.uniform(100.0, 500.0),
            int(random.choice([100, 200, 500])),
            random.uniform(2.0, 20.0),
        )
        rate, share = random.uniform(0.1, 1.0), random.uniform(0.02, 0.3)
        level = random.uniform(0.2, 1.0) * top
        scale = math.log((top + level / rate) / (share * top + level / rate)) / rate / seconds
        level, rate = level * scale, rate * scale
        time = np.linspace(0.0, seconds, count)
        speed = (top + level / rate) * np.exp(-rate * time) - level / rate
        fit = fit_coast_down(time, np.round(speed / unit, 1) * unit)
        told += bool(fit.misfit)
        assert not fit.misfit.withholding("viscous_rate")
        for name, truth in (("coulomb_deceleration", level), ("viscous_rate", rate)):
            low, high = fit.interval(name)
            held += low < truth < high
    assert told <= 1
    assert held >= 37


def test_the_step_of_rounding_is_found_in_any_unit() -> None:
    values = np.linspace(500.0, 3.0, 80) ** 1.01
    assert rounded_to(np.round(values, 1)) == pytest.approx(0.1)
    assert rounded_to(np.round(values, 1) * RPM) == pytest.approx(0.1 * RPM)
    assert rounded_to(np.round(values / 4.0) * 4.0) == pytest.approx(4.0)


def test_numbers_that_were_not_rounded_have_none() -> None:
    random = np.random.default_rng(2)
    assert not any(rounded_to(random.normal(0.0, 1.0, int(count))) for count in random.integers(20, 3000, 100))
    assert rounded_to(np.arange(10.0)) == 0.0
