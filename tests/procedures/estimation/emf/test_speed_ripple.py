"""A shaft that a drill or a gear turns: its speed swings about its mean."""

import numpy as np
import pytest

from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.integrated_flux import flux_by_integration
from procedures.estimation.emf.record import DigitizedChannel

FLUX, STEP = 0.02, 0.05
TIME = np.arange(4000) * 1e-4


def record(swing: float, cycles: float, hum: float = 0.0) -> tuple[np.ndarray, list[DigitizedChannel]]:
    """Return one line's voltage of 32 periods, whose speed swings by this share so many times."""
    mean, rate = 2.0 * np.pi * 80.0, 2.0 * np.pi * cycles / TIME[-1]
    phase = mean * TIME + swing * mean / rate * np.sin(rate * TIME + 0.7)
    speed = mean * (1.0 + swing * np.cos(rate * TIME + 0.7))
    volts = FLUX * speed * (np.sin(phase) + 0.04 * np.sin(5.0 * phase)) + hum * np.sin(2.0 * np.pi * 50.0 * TIME)
    noise = np.random.default_rng(4).normal(0.0, 0.6 * STEP, TIME.size)
    return np.round((volts + noise) / STEP)[None] * STEP, [DigitizedChannel("CH1", STEP, None, 0.01)]


@pytest.mark.parametrize(("swing", "cycles"), [(0.03, 1.3), (0.02, 3.2), (0.05, 1.8)])
def test_flux_linkage_at_a_speed_that_swings(swing: float, cycles: float) -> None:
    volts, told = record(swing, cycles)
    fit = fit_back_emf(TIME, volts, digitized=told)
    assert fit.ripples
    assert fit.speed_changes
    found = flux_by_integration(TIME, volts, digitized=told)
    assert not found.misfit.withholding("flux_linkage")
    value, uncertainty = found.mean()
    assert abs(value - FLUX) < 2.5 * uncertainty < 0.01 * FLUX
    frequencies = found.period_frequencies / 80.0
    assert np.max(frequencies) == pytest.approx(1.0 + swing, abs=0.2 * swing)


@pytest.mark.parametrize("hum", [0.0, 0.3])
def test_neither_noise_nor_hum_is_a_swing(hum: float) -> None:
    volts, told = record(0.0, 1.0, hum)
    assert not fit_back_emf(TIME, volts, digitized=told).ripples


@pytest.mark.parametrize(
    ("periods", "swing", "cycles"), [(2.9, 0.03, 0.7), (4.3, 0.03, 1.65), (5.2, 0.05, 2.1), (5.8, 0.008, 2.0)]
)
def test_a_swing_within_a_few_periods_is_told_as_one_and_held(periods: float, swing: float, cycles: float) -> None:
    random, time = np.random.default_rng(11), np.arange(2500) * (periods / 80.0 / 2500)
    mean, rate = 2.0 * np.pi * 80.0, 2.0 * np.pi * cycles / time[-1]
    phase = mean * time + swing * mean / rate * np.sin(rate * time + 0.7)
    speed = mean * (1.0 + swing * np.cos(rate * time + 0.7))
    lines = [FLUX * speed * (np.sin(a := phase - 2.0 * np.pi / 3.0 * k) + 0.03 * np.sin(5.0 * a)) for k in range(3)]
    step = 2.5 * FLUX * mean / 256.0
    volts = np.round(np.array(lines) / step + random.normal(0.0, 0.6, (3, time.size))) * step
    told = [DigitizedChannel(f"CH{k}", step, None, 0.003) for k in range(3)]
    assert fit_back_emf(time, volts, digitized=told).ripples
    found = flux_by_integration(time, volts, digitized=told)
    assert not found.misfit
    value, uncertainty = found.mean()
    assert abs(value - FLUX) < 2.5 * uncertainty < 0.01 * FLUX


@pytest.mark.parametrize("order", [2, 11])
def test_waves_of_a_few_periods_are_no_swing(order: int) -> None:
    random, time = np.random.default_rng(12), np.arange(2500) * (4.2 / 80.0 / 2500)
    angle = 2.0 * np.pi * 80.0 * time
    volts = 10.0 * (np.sin(angle) + 0.02 * np.sin(order * angle + 1.0)) + random.normal(0.0, 0.05, time.size)
    assert not fit_back_emf(time, volts[None], digitized=[DigitizedChannel("CH1", 0.1, None, 0.01)]).ripples
