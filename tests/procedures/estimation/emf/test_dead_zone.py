"""A channel that stands still about zero: told, and in the flux linkage's interval; a winding's own harmonics are not taken for it."""

import numpy as np
import pytest

from procedures.estimation.emf.back_emf import BackEmfFit, fit_back_emf
from procedures.estimation.emf.record import DigitizedChannel
from procedures.estimation.fitting.misfit import Answer, Cause

FLUX, FREQUENCY, STEP = 0.02, 100.0, 0.15
AMPLITUDE = FLUX * 2.0 * np.pi * FREQUENCY


def recorded(
    seed: int, *, zone: float = 0.0, harmonics: tuple[tuple[int, float], ...] = ((5, 0.03), (7, 0.01))
) -> BackEmfFit:
    """Record a phase whose reading is 0 within a zone (share of the amplitude), and as much too small beyond it."""
    random = np.random.default_rng(seed)
    time = np.arange(4000) * 0.08 / 4000
    angle = 2.0 * np.pi * FREQUENCY * time + random.uniform(0.0, 6.3)
    wave = np.sin(angle) + sum(share * np.sin(order * angle) for order, share in harmonics)
    wave = AMPLITUDE * np.sign(wave) * np.maximum(np.abs(wave) - zone, 0.0)
    read = np.round((wave + 0.5 * STEP * random.standard_normal(time.size)) / STEP) * STEP
    return fit_back_emf(time, read[None], digitized=[DigitizedChannel("CH1", STEP, None, 0.01)])


@pytest.mark.parametrize("zone", [0.02, 0.03, 0.08])
def test_a_dead_zone_is_told_and_its_loss_is_in_the_interval(zone: float) -> None:
    for seed in range(5):
        fit = recorded(seed, zone=zone)
        # A zone that is wide holds equal readings, which are left out as such.
        [found] = [one for one in fit.misfit.findings if one.cause is not Cause.DROPOUTS]
        value, uncertainty = fit.flux_linkage.value, fit.flux_linkage.uncertainty
        little = 1.96 * uncertainty > 0.2 * value
        assert (found.cause, found.answer) == (Cause.DISTORTION, Answer.WITHHELD if little else Answer.WIDENED)
        assert found.figures["share"] == pytest.approx(4.0 * zone / np.pi, rel=0.5)
        assert value < FLUX
        assert abs(value - FLUX) < 2.0 * uncertainty


@pytest.mark.slow
def test_a_winding_s_own_odd_harmonics_are_no_dead_zone() -> None:
    many = tuple((order, 0.2 / order**1.5) for order in range(3, 26, 2))
    assert not any(recorded(seed, harmonics=many).misfit for seed in range(10))
    assert not any(recorded(seed).misfit for seed in range(20))


@pytest.mark.parametrize("noise", [0.0, 0.2, 0.5])
@pytest.mark.parametrize("frequency", [20.0, 50.0, 133.3, 200.0, 400.0])
def test_rounding_that_comes_again_every_turn_is_no_cause(frequency: float, noise: float) -> None:
    # 20 V in a range of 40 V of eight bits at 2 kHz: few places of a turn, each of them in every turn.
    random, time, step, held, names = np.random.default_rng(3), np.arange(1600) / 2000.0, 40.0 / 256, 0, "UVW"
    for amplitude in random.uniform(14.0, 19.9, 4):
        angle = 2.0 * np.pi * frequency * time + random.uniform(0.0, 6.3) - 2.0 * np.pi / 3.0 * np.arange(3)[:, None]
        read = np.round((amplitude * np.sin(angle) + noise * step * random.standard_normal(angle.shape)) / step) * step
        fit = fit_back_emf(time, read, digitized=[DigitizedChannel(name, step, None, 0.01) for name in names])
        assert {found.cause for found in fit.misfit.findings} <= {Cause.TOO_COARSE}
        value, uncertainty = fit.flux_linkage.value, fit.flux_linkage.uncertainty
        assert uncertainty < 2e-3 * value
        held += abs(value - amplitude / (2.0 * np.pi * frequency)) < 2.0 * uncertainty
    assert held >= 3
