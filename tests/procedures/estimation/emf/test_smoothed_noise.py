"""Records that a spreadsheet or an oscilloscope smoothed: told by their noise, and the interval holds the machine's flux linkage."""

from collections.abc import Callable

import numpy as np
import pytest

from procedures.core.misfit_text import sentence
from procedures.estimation.emf.back_emf import BackEmfFit, fit_back_emf
from procedures.estimation.emf.integrated_flux import FluxEstimate, flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.fit import FloatArray, coverage_interval
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

FLUX, FREQUENCY, PERIODS, COUNT = 0.02, 100.0, 8.5, 2500
AMPLITUDE = FLUX * 2.0 * np.pi * FREQUENCY
TIME = np.arange(COUNT) * PERIODS / FREQUENCY / COUNT
PERIOD = COUNT / PERIODS


def lines() -> FloatArray:
    angle = 2.0 * np.pi * FREQUENCY * TIME - 2.0 * np.pi / 3.0 * np.arange(3)[:, None] + 0.7
    return np.asarray(AMPLITUDE * (np.sin(angle) + 0.03 * np.sin(5.0 * angle)))


def noise(seed: int) -> FloatArray:
    return np.random.default_rng(seed).standard_normal((3, COUNT))


def recorded(
    seed: int, codes: float, noise_codes: float, coloured: FloatArray | None = None
) -> tuple[FloatArray, float]:
    """Return three channels and one step of a converter with so many codes for the amplitude."""
    step = AMPLITUDE / codes
    added = noise(seed) if coloured is None else coloured / np.std(coloured)
    return np.round((lines() + noise_codes * step * added) / step) * step, step


def mean_over(length: int) -> Callable[[FloatArray], FloatArray]:
    return lambda rows: np.apply_along_axis(np.convolve, -1, rows, np.full(length, 1.0 / length), "valid")


def exponential(length: float) -> Callable[[FloatArray], FloatArray]:
    left = np.exp(-1.0 / length)

    def smooth(rows: FloatArray) -> FloatArray:
        weights = (1.0 - left) * left ** np.arange(int(12.0 * length))
        return np.apply_along_axis(np.convolve, -1, rows, weights, "valid")

    return smooth


def both(rows: FloatArray, step: float) -> list[BackEmfFit | FluxEstimate]:
    told = [DigitizedChannel(f"CH{k + 1}", step, None, 0.0) for k in range(3)]
    time = TIME[: rows.shape[1]]
    return [fit_back_emf(time, rows, digitized=told), flux_by_integration(time, rows, digitized=told)]


def smoothing(fit: BackEmfFit | FluxEstimate) -> list[Finding]:
    return [found for found in fit.misfit.findings if found.cause is Cause.BANDWIDTH]


def interval(fit: BackEmfFit | FluxEstimate) -> tuple[float, float]:
    flux = fit.flux_linkage
    return coverage_interval(flux.value, flux.uncertainty, flux.degrees_of_freedom)


@pytest.mark.parametrize(
    "smooth",
    [
        mean_over(int(0.06 * PERIOD)),
        mean_over(int(0.1 * PERIOD)),
        mean_over(int(0.2 * PERIOD)),
        exponential(0.03 * PERIOD),
        lambda rows: mean_over(20)(mean_over(20)(rows)),
    ],
    ids=["mean 0.06", "mean 0.1", "mean 0.2", "exponential", "twice"],
)
@pytest.mark.parametrize(("codes", "noise_codes"), [(90.0, 0.5), (1500.0, 2.0)])
def test_a_smoothed_record_is_told_and_held(
    smooth: Callable[[FloatArray], FloatArray], codes: float, noise_codes: float
) -> None:
    rows, _ = recorded(3, codes, noise_codes)
    for fit in both(smooth(rows), 1e-9):
        (found,) = smoothing(fit)
        assert found.answer is Answer.WIDENED
        assert "Record without smoothing" in sentence(found).render()
        low, high = interval(fit)
        assert low < FLUX < high
        # What is told is about what the figure is too small by, though a shape of noise is no exact law.
        lost, share = 1.0 - fit.flux_linkage.value / FLUX, float(found.figures["share"])
        assert 0.1 * share < lost < 1.5 * share


@pytest.mark.parametrize(
    ("codes", "noise_codes"),
    [
        (90.0, 0.2),
        pytest.param(90.0, 1.0, marks=pytest.mark.slow),
        pytest.param(1500.0, 0.5, marks=pytest.mark.slow),
        (1500.0, 8.0),
    ],
)
def test_a_clean_record_is_not(codes: float, noise_codes: float) -> None:
    for seed in range(10, 15):
        rows, step = recorded(seed, codes, noise_codes)
        for fit in both(rows, step):
            assert not fit.misfit


def test_a_bandwidth_far_above_the_fundamental_is_not() -> None:
    # Noise of four samples in common: a hundredth of a period takes 0.02 % of the fundamental.
    coloured = np.apply_along_axis(np.convolve, -1, np.pad(noise(4), ((0, 0), (0, 3))), np.full(4, 0.25), "valid")
    for fit in both(*recorded(4, 1500.0, 4.0, coloured)):
        assert not smoothing(fit)


def test_noise_that_is_strong_at_low_frequencies_beside_white_noise_is_not() -> None:
    slow = np.cumsum(noise(6), axis=1)
    slow -= np.mean(slow, axis=1, keepdims=True)
    for fit in both(*recorded(5, 1500.0, 6.0, noise(5) + 0.02 * slow)):
        assert not smoothing(fit)
