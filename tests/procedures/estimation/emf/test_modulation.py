"""Voltages that change along a record otherwise than the speed does: told, and the interval holds the machine's flux linkage."""

import numpy as np
import pytest

from bench.analysis.back_emf import analyze_back_emf
from procedures.estimation.emf.back_emf import BackEmfFit, fit_back_emf
from procedures.estimation.emf.integrated_flux import FluxEstimate, flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray, coverage_interval
from procedures.estimation.fitting.misfit import Answer, Cause, Misfit

FLUX, FREQUENCY, STEP, SPAN = 0.02, 100.0, 0.05, 0.08
SPEED = 2.0 * np.pi * FREQUENCY
TIME = np.linspace(-0.5 * SPAN, 0.5 * SPAN, 4000)
TOLD = [DigitizedChannel(f"CH{k + 1}", STEP, None, 0.0) for k in range(3)]


def voltages(*, faster: FloatArray | float = 1.0, gain: FloatArray | float = 1.0, coasting: float = 0.0) -> FloatArray:
    """Return three lines' voltages (3, n), of a shaft that is by so many times faster and slows down by a share."""
    place = TIME / SPAN
    angle = faster * SPEED * (TIME - 0.5 * coasting * TIME * place)
    lines = angle - 2.0 * np.pi / 3.0 * np.arange(3)[:, None]
    wave = np.sin(lines) + 0.02 * np.sin(5.0 * lines)
    return np.asarray(FLUX * SPEED * faster * (1.0 - coasting * place) * gain * wave)


def read(volts: FloatArray, seed: int = 1) -> FloatArray:
    noisy = volts + STEP * np.random.default_rng(seed).standard_normal(volts.shape)
    return np.asarray(np.round(noisy / STEP) * STEP)


def averaged(spread: float) -> FloatArray:
    """Return the mean of 64 acquisitions with the trigger at the record's middle, of a speed that varies by a standard deviation."""
    speeds = np.random.default_rng(2).normal(1.0, spread, 64)
    return np.asarray(np.mean([voltages(faster=float(each)) for each in speeds], axis=0))


def both(volts: FloatArray) -> list[BackEmfFit | FluxEstimate]:
    return [fit_back_emf(TIME, volts, digitized=TOLD), flux_by_integration(TIME, volts, digitized=TOLD)]


def modulated(misfit: Misfit) -> bool:
    return any(found.cause is Cause.MODULATED and found.answer is Answer.WIDENED for found in misfit.findings)


@pytest.mark.parametrize(
    "volts",
    [
        averaged(0.005),
        averaged(0.02),
        voltages(gain=1.0 + 0.05 * TIME / SPAN),
        voltages(gain=1.0 - 0.2 * (TIME / SPAN + 0.5)),
    ],
)
def test_a_flux_linkage_that_changes_along_the_record_is_told_and_held(volts: FloatArray) -> None:
    for fit in both(read(volts)):
        assert modulated(fit.misfit)
        flux = fit.flux_linkage
        low, high = coverage_interval(flux.value, flux.uncertainty, flux.degrees_of_freedom)
        assert low <= FLUX <= high


@pytest.mark.parametrize(
    "coasting", [pytest.param(0.0, marks=pytest.mark.slow), 0.02, pytest.param(0.3, marks=pytest.mark.slow)]
)
def test_a_speed_that_falls_is_none(coasting: float) -> None:
    volts = voltages(coasting=coasting)
    for seed in range(5):
        fit, integrated = both(read(volts, seed))
        assert isinstance(fit, BackEmfFit)
        counts = integrated if fit.drift_significant else fit
        assert not modulated(counts.misfit)
        assert counts.flux_linkage.uncertainty < 1e-3 * FLUX
        assert counts.flux_linkage.value == pytest.approx(FLUX, rel=3e-3)


def test_analyze_says_so(tmp_path) -> None:
    path = tmp_path / "averaged.csv"
    table = np.column_stack((TIME, read(averaged(0.01)).T))
    np.savetxt(path, table, delimiter=",", fmt="%.6g", header="time (s),U (V),V (V),W (V)", comments="")
    made = analyze_back_emf(path, connection="phase", coupling={"": "dc"})
    assert "modulated" in {warning["id"] for warning in made["warnings"]}
    low, high = made["parameters"]["flux_linkage"]["coverage_interval"]
    assert low <= FLUX <= high
