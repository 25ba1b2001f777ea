"""A channel with hysteresis: found with what it takes of the fundamental; a winding's own harmonics are not taken for it."""

import numpy as np
import pytest

from procedures.estimation.emf.back_emf import fit_back_emf
from procedures.estimation.emf.memory import find_memory
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

FLUX, FREQUENCY, STEP = 0.02, 100.0, 0.05
AMPLITUDE = FLUX * 2.0 * np.pi * FREQUENCY


CHANNEL = DigitizedChannel("CH1", STEP, None, 0.01)


def sought(
    seed: int, *, width: float = 0.0, harmonics: tuple[tuple[int, float], ...] = ((5, 0.03), (7, 0.01))
) -> tuple[float, float, tuple[Finding, ...]]:
    """Return what is found and what is missing of the amplitude where a reading follows the voltage by a width (share of the amplitude)."""
    random = np.random.default_rng(seed)
    time = np.arange(4000) * 0.08 / 4000
    angle = 2.0 * np.pi * FREQUENCY * time + random.uniform(0.0, 6.3)
    wave = np.sin(angle) + sum(share * np.sin(order * angle) for order, share in harmonics)
    followed = wave.copy()
    for k in range(1, wave.size):
        followed[k] = np.clip(followed[k - 1], wave[k] - width, wave[k] + width)
    read = np.round((AMPLITUDE * followed + STEP * random.standard_normal(time.size)) / STEP) * STEP
    fit = fit_back_emf(time, read[None])
    lost, findings = find_memory(time, fit.harmonics, fit.model, [CHANNEL], np.array([True]))
    return float(lost[0] / AMPLITUDE), float(1.0 - fit.fundamental()[0] / AMPLITUDE), findings


@pytest.mark.parametrize("width", [0.03, 0.05, 0.1])
def test_hysteresis_is_told_with_what_it_takes_of_the_fundamental(width: float) -> None:
    for seed in range(5):
        lost, missing, [found] = sought(seed, width=width)
        assert (found.cause, found.answer) == (Cause.DISTORTION, Answer.WIDENED)
        assert found.figures["record"] == "emf-memory"
        # What is found is a standard uncertainty of what is missing, and of its size.
        assert 0.4 * missing < lost < 2.0 * missing


@pytest.mark.slow
def test_a_winding_s_own_harmonics_are_no_hysteresis() -> None:
    random = np.random.default_rng(3)
    for seed in range(10):
        many = tuple((order, float(random.uniform(-0.2, 0.2)) / order**1.5) for order in range(3, 26, 2))
        assert not sought(seed, harmonics=many)[2]
    assert not any(sought(seed)[2] for seed in range(20))
