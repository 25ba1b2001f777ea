"""A speed column of few digits: its rounding is known noise, and no sign of another friction."""

import math

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.fitting.noise import rounded_to
from procedures.estimation.mechanics.inertia import fit_ramps
from procedures.estimation.mechanics.turning import SpeedRamp
from tests.studies.worlds.shaft_records import fit_coast_down

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


@pytest.mark.parametrize("seed", range(4))
def test_a_few_counted_pulses_are_noise_and_no_dropouts_or_cogging(seed: int) -> None:
    """60 pulses a turn counted for 20 ms, where the gate falls being chance: 15 steps up to the top speed."""
    random, digit, step = np.random.default_rng(seed), 0.01 * np.pi / 30.0, 2.0 * np.pi / (60.0 * 0.02)
    inertia, coulomb, torque, time = 1.2e-4, 0.014, 0.035, 0.006 * np.arange(90)

    def counted(speed: np.ndarray) -> np.ndarray:
        shown = np.floor(speed / step + random.uniform(size=speed.size)) * step
        return np.round(shown / digit) * digit

    up = counted((torque - coulomb) / inertia * time)
    down = counted((torque - coulomb) / inertia * time[-1] - coulomb / inertia * time)
    fit = fit_ramps([SpeedRamp(time, up, torque, digit), SpeedRamp(time, down, 0.0, digit)])
    assert {finding.cause for finding in fit.misfit.findings} == {Cause.TOO_COARSE}
    assert abs(fit.value("inertia") - inertia) < 2.0 * fit.uncertainty("inertia") < 0.2 * inertia


def test_pulses_too_few_for_a_ramp_are_named() -> None:
    time, digit = 0.006 * np.arange(90), 0.001
    shown = 5.236 * np.floor(0.02 * np.arange(90) + 0.4)
    with pytest.raises(EstimationError, match=r"in steps of 5\.24 rad/s up to 10\.5 rad/s.*more pulses a turn"):
        fit_ramps([SpeedRamp(time, shown, 0.1, digit), SpeedRamp(time, shown[::-1], 0.0, digit)])
