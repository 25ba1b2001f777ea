"""Short-circuit currents and torque of motors whose constants are known."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.winding.short_circuit import (
    D_INDUCTANCE,
    RESISTANCE,
    SALIENCY,
    current,
    d_axis_current,
    fit_currents,
    fit_torque,
    peak_speed,
    with_peak,
)

R, LD, LQ, FLUX, PAIRS = 0.05, 1.0e-3, 2.5e-3, 0.1, 4
CORNER = R / math.sqrt(LD * LQ)
SPEEDS = CORNER * np.array([0.15, 0.3, 0.6, 1.0, 1.5, 2.5, 4.0, 7.0, 12.0])


def torque(speed, r=R, ld=LD, lq=LQ):
    return 1.5 * PAIRS * r * current(speed, r, ld, lq, FLUX) ** 2 / speed


@settings(deadline=None, max_examples=50)
@given(ratio=st.floats(0.3, 8.0), speed=st.floats(0.01, 100.0))
def test_the_currents_solve_both_voltage_equations(ratio, speed):
    lq, omega = ratio * LD, speed * CORNER
    along = float(d_axis_current(omega, R, LD, lq, FLUX))
    across = -math.sqrt(max(float(current(omega, R, LD, lq, FLUX)) ** 2 - along**2, 0.0))
    assert R * along - omega * lq * across == pytest.approx(0.0, abs=1e-6 * R * abs(along) + 1e-9)
    assert R * across + omega * (LD * along + FLUX) == pytest.approx(0.0, abs=1e-6 * omega * FLUX)


@settings(deadline=None, max_examples=50)
@given(ratio=st.floats(0.3, 8.0))
def test_the_peak_is_where_the_torque_is_largest(ratio):
    lq = ratio * LD
    omega = np.geomspace(0.01, 100.0, 20001) * R / math.sqrt(LD * lq)
    found = omega[np.argmax(torque(omega, lq=lq))]
    assert peak_speed(R, LD, lq) == pytest.approx(found, rel=2e-3)


@pytest.mark.parametrize(("ratio", "factor"), [(1.0, 1.0), (2.0, 1.33), (4.0, 1.54), (8.0, 1.64)])
def test_the_peak_lies_where_the_literature_has_it(ratio, factor):
    assert peak_speed(R, LD, ratio * LD) == pytest.approx(factor * R / math.sqrt(LD * ratio * LD), rel=5e-3)


def test_the_currents_give_the_constants_back():
    size = current(SPEEDS, R, LD, LQ, FLUX)
    fit = fit_currents(SPEEDS, size, 1e-4 * size, FLUX)
    assert fit.value(RESISTANCE) == pytest.approx(R, rel=1e-4)
    assert fit.value(D_INDUCTANCE) == pytest.approx(LD, rel=1e-4)
    assert fit.value(SALIENCY) == pytest.approx(LQ / LD, rel=1e-3)


def test_intervals_hold_over_noisy_sweeps():
    random, z = np.random.default_rng(3), []
    for _ in range(200):
        true = current(SPEEDS, R, LD, LQ, FLUX)
        size = true * (1.0 + 1e-3 * random.standard_normal(SPEEDS.size))
        fit = fit_currents(SPEEDS, size, 1e-3 * true, FLUX)
        z.append(
            [
                (fit.value(n) - v) / fit.uncertainty(n)
                for n, v in ((RESISTANCE, R), (D_INDUCTANCE, LD), (SALIENCY, LQ / LD))
            ]
        )
    assert np.all(np.abs(np.mean(z, axis=0)) < 0.3)
    assert np.all((np.std(z, axis=0) > 0.75) & (np.std(z, axis=0) < 1.2))


def test_a_range_s_gain_is_in_the_uncertainty():
    size = current(SPEEDS, R, LD, LQ, FLUX)
    ranges = np.where(SPEEDS < CORNER, 1.0, 2.0)
    plain = fit_currents(SPEEDS, size, 1e-4 * size, FLUX)
    gained = fit_currents(SPEEDS, size, 1e-4 * size, FLUX, ranges=ranges, gain=0.01)
    assert gained.uncertainty(D_INDUCTANCE) > 5.0 * plain.uncertainty(D_INDUCTANCE)
    off = fit_currents(SPEEDS, size * np.where(ranges > 1.0, 1.01, 1.0), 1e-4 * size, FLUX, ranges=ranges, gain=0.01)
    assert abs(off.value(D_INDUCTANCE) - LD) < 2.0 * off.uncertainty(D_INDUCTANCE)


def test_what_is_known_of_the_saliency_is_gone_by():
    slow = SPEEDS[SPEEDS < 1.2 * CORNER]
    size = current(slow, R, LD, LQ, FLUX)
    vague = fit_currents(slow, size, 1e-2 * size, FLUX)
    told = fit_currents(slow, size, 1e-2 * size, FLUX, saliency=(2.5, 0.02))
    assert told.uncertainty(SALIENCY) < 0.06 < 0.2 < vague.uncertainty(SALIENCY)
    assert told.uncertainty(RESISTANCE) <= vague.uncertainty(RESISTANCE)


def test_a_saturating_q_axis_makes_the_currents_resistance_small_and_the_torque_s_right():
    # What L_q = L_q0 / (1 + |i_q| / 100 A) gives, each speed solved by itself.
    size = []
    for omega in SPEEDS:
        across = 0.0
        for _ in range(200):
            lq = LQ / (1.0 + abs(across) / 100.0)
            across = -omega * FLUX * R / (R**2 + omega**2 * LD * lq)
        size.append(math.hypot(across, omega * lq * across / R))
    size = np.array(size)
    pull = 1.5 * PAIRS * R * size**2 / SPEEDS
    fit = fit_currents(SPEEDS, size, 1e-3 * size, FLUX)
    braking = fit_torque(SPEEDS, size, pull, np.full(SPEEDS.size, 1e-3), PAIRS)
    assert braking.resistance == pytest.approx(R, rel=1e-9)
    assert fit.value(RESISTANCE) < 0.995 * R


def test_the_torque_s_peak_is_found_between_the_points_and_not_beyond_them():
    size = current(SPEEDS, R, LD, LQ, FLUX)
    fit = fit_currents(SPEEDS, size, 1e-4 * size, FLUX)
    braking = fit_torque(SPEEDS, size, torque(SPEEDS), np.full(SPEEDS.size, 1e-3), PAIRS)
    found = with_peak(braking, fit, SPEEDS, torque(SPEEDS), FLUX, PAIRS)
    top = peak_speed(R, LD, LQ)
    assert found.peak == pytest.approx((float(torque(top)), top), rel=1e-3)
    slow = np.flatnonzero(0.9 * top > SPEEDS)
    below = fit_torque(SPEEDS[slow], size[slow], torque(SPEEDS[slow]), np.full(slow.size, 1e-3), PAIRS)
    assert with_peak(below, fit, SPEEDS[slow], torque(SPEEDS[slow]), FLUX, PAIRS).peak is None


@pytest.mark.parametrize(
    ("speeds", "sizes", "message"),
    [([1.0, 2.0, 3.0], [1.0, 2.0, 3.0], "at least 4"), ([0.0, 1.0, 2.0, 3.0], [1.0, 1.0, 2.0, 3.0], "above zero")],
)
def test_what_cannot_be_fitted_is_refused(speeds, sizes, message):
    with pytest.raises(EstimationError, match=message):
        fit_currents(speeds, sizes, [0.1] * len(sizes), FLUX)


@settings(deadline=None, max_examples=25)
@given(share=st.floats(0.01, 0.08), rise=st.floats(0.002, 0.03), told=st.floats(0.75, 1.25))
def test_a_winding_that_warms_below_the_bend_gives_no_inductance(share, rise, told):
    omega = np.array([0.15, 0.25, 0.4, 0.6, 0.8, 1.0]) * share * CORNER
    heat = np.cumsum(omega**2) / np.sum(omega**2)
    size = np.array([current(w, R * (1.0 + rise * h), LD, LQ, FLUX) for w, h in zip(omega, heat, strict=True)]).ravel()
    fit = fit_currents(omega, size, 2e-4 * size, FLUX, warmings=told * rise * heat)
    assert fit.value(RESISTANCE) == pytest.approx(R, rel=0.01)
    away = math.log(fit.value(D_INDUCTANCE) / LD)
    known = fit.uncertainty(D_INDUCTANCE) / fit.value(D_INDUCTANCE)
    assert known > 0.25 or abs(away) < 2.5 * known, (fit.value(D_INDUCTANCE), known)


def test_a_warming_at_high_speed_changes_nothing_and_one_more_is_one_too_many():
    size = current(SPEEDS, R, LD, LQ, FLUX)
    cold = fit_currents(SPEEDS, size, 1e-3 * size, FLUX)
    warm = fit_currents(SPEEDS, size, 1e-3 * size, FLUX, warmings=np.linspace(0.0, 2e-3, SPEEDS.size))
    assert warm.value(D_INDUCTANCE) == pytest.approx(cold.value(D_INDUCTANCE), rel=2e-3)
    with pytest.raises(EstimationError):
        fit_currents(SPEEDS, size, 1e-3 * size, FLUX, warmings=[0.0])
