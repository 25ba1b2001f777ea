"""Cogging torque of synthetic slow turns."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics.cogging import fit_cogging


def turn(parts=((24, 4e-3, 0.3),), *, drag=0.02, noise=1e-4, readings=300, turns=1.0, seed=0, step=0.0):
    """Return angles (rad) and torques (N·m) of an even turn; `parts` are order, amplitude and phase."""
    random = np.random.default_rng(seed)
    angle = 2 * math.pi * turns * np.arange(readings) / readings + 0.7
    torque = drag + sum(a * np.sin(n * angle + p) for n, a, p in parts) + noise * random.standard_normal(readings)
    return angle, np.round(torque / step) * step if step else torque


def test_one_order_is_twice_its_amplitude():
    found = fit_cogging(*turn())
    assert found.peak_to_peak == pytest.approx(8e-3, abs=4.0 * found.uncertainty)
    assert list(found.orders) == [24.0]
    assert found.mean == pytest.approx(0.02, abs=1e-4)
    assert found.noise == pytest.approx(1e-4, rel=0.2)


@settings(max_examples=25, deadline=None)
@given(
    st.integers(min_value=6, max_value=40),
    st.floats(min_value=1e-3, max_value=1e-2),
    st.floats(min_value=0.0, max_value=6.3),
    st.floats(min_value=0.0, max_value=0.4),
    st.integers(min_value=0, max_value=999),
)
def test_order_and_its_double_are_found_whatever_their_phase(order, amplitude, phase, share, seed):
    parts = ((order, amplitude, phase), (2 * order, share * amplitude, 1.0))
    fine = np.linspace(0.0, 2 * math.pi, 20_001)
    truth = np.ptp(sum(a * np.sin(n * fine + p) for n, a, p in parts))
    found = fit_cogging(*turn(parts, seed=seed))
    # An order too small to stand out is left out.
    assert abs(found.peak_to_peak - truth) < 5.0 * found.uncertainty + found.hidden
    assert order in found.orders


def test_run_out_is_no_cogging():
    found = fit_cogging(*turn(((1, 0.05, 0.0), (2, 0.02, 1.0), (12, 3e-3, 0.0))))
    assert list(found.orders) == [12.0]
    assert found.peak_to_peak == pytest.approx(6e-3, abs=4.0 * found.uncertainty)


@settings(max_examples=15, deadline=None)
@given(st.integers(min_value=6, max_value=300), st.floats(min_value=0.0, max_value=6.3), st.integers(0, 99))
def test_some_periods_of_a_known_order_suffice(order, phase, seed):
    angle, torque = turn(
        ((order, 3e-3, phase), (2 * order, 5e-4, 1.0), (1, 0.01, 0.5)), turns=12.0 / order, readings=120, seed=seed
    )
    fine = np.linspace(0.0, 2 * math.pi, 2001)
    truth = np.ptp(3e-3 * np.sin(fine + phase) + 5e-4 * np.sin(2 * fine + 1.0))
    found = fit_cogging(angle, torque, order=order)
    assert abs(found.peak_to_peak - truth) < 5.0 * found.uncertainty + 0.003 * truth


def test_none_is_none_with_what_the_scatter_may_hide():
    silent = [fit_cogging(*turn((), seed=seed)) for seed in range(50)]
    assert sum(found.peak_to_peak > 0.0 for found in silent) <= 3
    assert silent[0].hidden < 4e-4
    assert fit_cogging(*turn(((24, 0.3 * silent[0].hidden, 0.0),))).peak_to_peak <= 2.0 * silent[0].hidden


def test_an_order_too_high_to_be_seen_is_told_as_hidden():
    angle = 2 * math.pi * (np.arange(250) + 0.8 * np.mod(0.618034 * np.arange(250), 1.0)) / 250
    for order in (84, 264, 250):
        found = fit_cogging(angle, 3e-3 * np.sin(order * angle) + 1e-5 * np.cos(9 * angle))
        assert abs(found.peak_to_peak - 6e-3) < 1.1 * found.hidden, order


def test_single_zeros_are_readings_that_dropped_out_and_no_end_of_a_range():
    # Of an order too high to be seen, so that zeros do not stand out of the scatter.
    number = np.arange(500)
    angle = 2 * math.pi * (number + 0.8 * np.mod(0.618034 * number, 1.0)) / 250
    torque = 0.31 + 0.15 * np.sin(180 * angle) + 5e-3 * np.random.default_rng(1).standard_normal(500)
    torque[7::71] = 0.0
    causes = {finding.cause for finding in fit_cogging(angle, torque, resolution=1e-3).misfit.findings}
    assert Cause.DROPOUTS in causes
    assert Cause.CLIPPED not in causes


@pytest.mark.slow
def test_the_uncertainty_is_that_of_repeated_turns():
    found = [fit_cogging(*turn(((24, 4e-3, 0.3), (48, 1e-3, 1.0)), seed=seed)) for seed in range(60)]
    off = np.array([one.peak_to_peak for one in found])
    stated = np.mean([one.uncertainty for one in found])
    assert 0.5 * stated < np.std(off) < 1.5 * stated


def test_more_turns_and_coarse_readings_are_no_matter():
    found = fit_cogging(*turn(turns=2.0, readings=600, noise=2e-4))
    assert found.peak_to_peak == pytest.approx(8e-3, abs=4.0 * found.uncertainty)
    coarse = fit_cogging(*turn(noise=0.0, step=1e-3), resolution=1e-3)
    assert coarse.peak_to_peak == pytest.approx(8e-3, abs=6.0 * coarse.uncertainty)


@pytest.mark.parametrize(
    ("how", "said"),
    [({"turns": 0.6}, "0.60 of a turn"), ({"readings": 18}, "take more readings"), ({"readings": 8}, "torque|angle")],
)
def test_too_little_is_refused(how, said):
    with pytest.raises(EstimationError, match=said):
        fit_cogging(*turn(**how))


def test_too_little_of_a_known_order_is_refused():
    with pytest.raises(EstimationError, match="two are needed"):
        fit_cogging(*turn(turns=0.05), order=24)
    with pytest.raises(EstimationError, match="too few"):
        fit_cogging(*turn(readings=40, turns=1.0), order=24)


@pytest.mark.slow
def test_a_deep_record_is_read_by_its_means():
    found = fit_cogging(*turn(((372, 4e-3, 0.3), (2, 3e-3, 0.1)), readings=60_003, noise=1e-3))
    assert list(found.orders) == [372]
    # Means of blocks that were taken for readings would be smaller by up to 2 %.
    assert found.peak_to_peak == pytest.approx(8e-3, rel=0.005)
    assert found.noise == pytest.approx(1e-3, rel=0.05)
