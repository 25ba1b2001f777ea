"""Inductance readings that end at a range."""

import numpy as np
import pytest

from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.winding.sweep.cut_readings import cut_off
from procedures.estimation.winding.sweep.rotor_sweep import axis_inductances, fit_rotor_sweep
from procedures.estimation.winding.sweep.timed_sweep import fit_timed_sweep


def sweep(*, cut: float = 2.0, step: float = 0.0, noise: float = 1e-3, seed: int = 0, after: bool = False):
    """Return 160 readings over two electrical turns, 1 ± 0.2, cut at this share of the amplitude and rounded to a step.

    The noise is added before the cut, or `after` it.
    """
    random = np.random.default_rng(seed)
    angle = np.linspace(0.0, 4.0 * np.pi, 160) + 0.3
    scatter, end = noise * random.standard_normal(160), 1.0 + 0.2 * cut
    true = 1.0 - 0.2 * np.cos(2.0 * angle)
    readings = np.minimum(true, end) + scatter if after else np.minimum(true + scatter, end)
    return angle, np.round(readings / step) * step if step else readings


@pytest.mark.parametrize("after", [False, True])
@pytest.mark.parametrize("cut", [0.5, 0.9])
def test_maxima_at_the_end_of_the_range_give_no_axis(cut: float, after: bool) -> None:
    angle, readings = sweep(cut=cut, after=after)
    for fit in (fit_timed_sweep(angle, readings), fit_rotor_sweep(angle, readings, pole_pairs=1)):
        reason = axis_inductances(fit).misfit.withholding("q_axis_inductance")
        assert reason is not None
        assert reason.cause is Cause.CLIPPED


@pytest.mark.parametrize("step", [0.0, 0.002, 0.02])
@pytest.mark.parametrize("noise", [0.0, 1e-3, 5e-3])
def test_crests_that_steps_make_flat_are_not_cut(step: float, noise: float) -> None:
    for seed in range(10):
        angle, readings = sweep(step=step, noise=noise, seed=seed)
        found = fit_rotor_sweep(angle, readings, pole_pairs=1, resolution=step).misfit.findings
        assert Cause.CLIPPED not in {finding.cause for finding in found}


@pytest.mark.parametrize("slower", [0.2, 0.25, 0.3])
def test_a_hand_that_slows_at_each_crest_cuts_nothing(slower: float) -> None:
    turned = np.linspace(0.0, 4.0 * np.pi, 160)
    angle = turned - slower * np.sin(2.0 * turned) + 0.1 * np.sin(0.4 * turned)
    readings = 1.0 + 0.07 * np.cos(2.0 * angle) + 1e-5 * np.random.default_rng(2).standard_normal(160)
    assert not cut_off(readings, 0.0)
