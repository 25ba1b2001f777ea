"""Ramps and coast-downs whose friction wanders while the shaft turns, by a simulation of their own."""

import warnings

import numpy as np
import pytest

from procedures.estimation.fitting.fit import Fit
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics.inertia import fit_ramps
from procedures.estimation.mechanics.turning import SpeedRamp
from tests.studies.worlds.shaft_records import fit_coast_down

INERTIA, COULOMB, VISCOUS, TOP, DRIVE = 1e-3, 0.03, 1.5e-4, 300.0, 0.35


def turned(torque: float, begin: float, seconds: float, since: float, swing: float, period: float) -> SpeedRamp:
    """Return a ramp of 600 speeds, with a bearing's load that swings by a share so often (s) from `since` (s) on."""
    step, random = seconds / 60_000, np.random.default_rng(5)
    speeds = np.empty(60_000)
    speed = begin
    for k in range(speeds.size):
        speeds[k] = speed
        coulomb = COULOMB * (1.0 + swing * np.sin(2.0 * np.pi * (since + k * step) / period))
        speed += (torque - coulomb - VISCOUS * speed) / INERTIA * step
    time = np.arange(600) * seconds / 600
    return SpeedRamp(time, speeds[::100] + random.normal(0.0, 0.1, 600), torque)


def ramps(swing: float) -> Fit:
    driven = turned(DRIVE, 5.0, 0.95, 0.0, swing, 1.3)
    return fit_ramps([driven, turned(0.0, float(driven.speed[-1]), 4.0, 0.95, swing, 1.3)])


@pytest.mark.parametrize("swing", [0.1, 0.3])
def test_friction_that_wanders_is_told_as_one_thing_and_held(swing: float) -> None:
    fit = ramps(swing)
    (finding,) = fit.misfit.findings
    assert finding.cause is Cause.UNEXPLAINED
    assert "tried" in finding.figures
    for name, truth in (("inertia", INERTIA), ("coulomb_friction", COULOMB), ("viscous_friction", VISCOUS)):
        assert abs(fit.value(name) - truth) < 2.0 * fit.uncertainty(name)


def test_steady_friction_is_told_as_nothing() -> None:
    fit = ramps(0.0)
    assert not fit.misfit
    assert fit.uncertainty("inertia") < 0.003 * INERTIA


@pytest.mark.parametrize("swing", [0.15, 0.25])
def test_a_coast_down_whose_friction_wanders_gives_no_narrow_figure(swing: float) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        coast = turned(0.0, TOP, 5.0, 0.0, swing, 2.1)
        fit = fit_coast_down(coast.time, coast.speed)
    off = abs(fit.value("coulomb_deceleration") - COULOMB / INERTIA)
    assert fit.misfit.withholding("coulomb_deceleration") or off < 2.0 * fit.uncertainty("coulomb_deceleration")
