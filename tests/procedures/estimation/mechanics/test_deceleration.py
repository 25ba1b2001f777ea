"""A coast-down's deceleration at named speeds follows from no law of friction."""

import numpy as np
import pytest

from procedures.estimation.fitting.fit import coverage_interval
from procedures.estimation.mechanics.deceleration import deceleration
from procedures.estimation.mechanics.turning import SpeedRamp, turning

TOP, STEP = 300.0, 0.02
#: Decelerations (rad/s²) over speeds (rad/s) and time (s).
LAWS = {
    "Coulomb and viscous": lambda w, _: 20.0 + 0.1 * w,
    "fan": lambda w, _: 5.0 + 6e-4 * w**2,
    "grows ever less": lambda w, _: 10.0 + 2.0 * np.sqrt(w),
    "Stribeck hump": lambda w, _: 15.0 + 0.05 * w + 20.0 * np.exp(-((w / 60.0) ** 2)),
    "grease": lambda w, t: (25.0 + 0.05 * w) * (0.6 + 0.4 * np.exp(-t / 2.0)),
}


def coasted(law, end=10.0):
    """Return times (s), speeds (rad/s) and decelerations (rad/s²) of a coast-down."""
    fine, rows, speed = STEP / 4.0, [], TOP
    while speed > end:
        time = len(rows) * fine
        rows.append((time, speed, law(speed, time)))
        speed -= fine * law(speed - 0.5 * fine * rows[-1][2], time + 0.5 * fine)
    return np.array(rows).T[:, ::4]


def judged(time, speed, rates, seen, **more):
    """Return for 25, 50 and 75 % of the top speed the error over the half-width of the interval, and that over the figure."""
    run = turning(SpeedRamp(time, seen, 0.0, **more), 1)
    for share in (0.25, 0.5, 0.75):
        found = deceleration(run, share * TOP)
        low, high = coverage_interval(found.value, found.uncertainty, found.degrees_of_freedom)
        true = np.interp(share * TOP, speed[::-1], rates[::-1])
        yield 2.0 * abs(found.value - true) / (high - low), 0.5 * (high - low) / found.value


@pytest.mark.parametrize("name", LAWS)
def test_any_law_is_held(name):
    time, speed, rates = coasted(LAWS[name])
    errors = []
    for seed in range(3):
        seen = speed + np.random.default_rng(seed).normal(0.0, 0.1, speed.size)
        errors += judged(time, speed, rates, seen)
    off, width = np.array(errors).T
    assert np.count_nonzero(off > 1.0) <= 1
    assert np.max(off) < 2.0
    assert np.max(width) < 0.06


def test_a_sensor_out_of_centre_that_is_read_more_seldom_than_it_turns():
    time, speed, rates = coasted(LAWS["fan"])
    angle = np.concatenate(([0.0], np.cumsum(0.5 * STEP * (speed[1:] + speed[:-1]))))
    seen = speed * (1.0 + 0.01 * np.cos(angle)) + np.random.default_rng(2).normal(0.0, 0.05, speed.size)
    seldom = slice(None, None, 5)
    assert all(off < 1.0 for off, _ in judged(time[seldom], speed, rates, seen[seldom]))


def test_a_filter_that_is_stated_is_undone():
    time, speed, rates = coasted(LAWS["fan"])
    behind, seen = 1.5, speed.copy()
    for k in range(1, seen.size):
        seen[k] = seen[k - 1] + (1.0 - np.exp(-STEP / behind)) * (0.5 * (speed[k] + speed[k - 1]) - seen[k - 1])
    seen = seen + np.random.default_rng(2).normal(0.0, 0.01, seen.size)
    assert all(off < 1.0 for off, _ in judged(time, speed, rates, seen, speed_filter=behind))
    assert any(off > 1.0 for off, _ in judged(time, speed, rates, seen))


def test_readings_on_steps_are_known_by_their_steps():
    time, speed, rates = coasted(LAWS["Coulomb and viscous"])
    seen = 5.0 * np.round(speed / 5.0)
    assert all(off < 1.0 for off, _ in judged(time, speed, rates, seen, speed_resolution=5.0))


def test_a_speed_that_the_record_does_not_carry_has_none():
    time, speed, _ = coasted(LAWS["fan"], end=100.0)
    run = turning(SpeedRamp(time, speed, 0.0), 1)
    assert deceleration(run, 90.0) is None
    assert deceleration(run, TOP) is None
