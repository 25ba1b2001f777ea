"""Ramps that the world bends: records are integrated on their own (`tests.studies.worlds.shaft_records`), the truth is known."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError, Fit
from procedures.estimation.fitting.misfit import Answer, Cause
from procedures.estimation.mechanics.inertia import fit_coast_downs, fit_ramps
from procedures.estimation.mechanics.turning import SpeedRamp, wild
from tests.studies.coast_pairs import Bearing
from tests.studies.worlds.shaft_records import Motion, Shaft, fit_coast_down, move, record

#: 5 s from 300 rad/s down to a fifth, 1 s up.
SHAFT = Shaft(
    inertia=1e-3, coulomb=0.03, viscous=1.5e-4, torque=0.35, top=300.0, noise=0.1, torque_noise=3e-3, samples=600, settling=0.05
)  # fmt: skip
TRUTH = {"inertia": SHAFT.inertia, "coulomb_friction": SHAFT.coulomb, "viscous_friction": SHAFT.viscous}
#: What acts on the readings and not on the motion.
SENSORS = {"speed_filter", "torque_filter", "dropouts", "eccentricity", "settling"}


@cache
def motion(**acting: float) -> Motion:
    return move([replace(SHAFT, **acting)])[0]


def measured(seed: int = 1, *, stated: bool = False, **disturbed: float) -> Fit:
    acting = {name: value for name, value in disturbed.items() if name not in SENSORS}
    random = np.random.default_rng(seed)
    return fit_ramps(record(replace(SHAFT, **disturbed), motion(**acting), random, stated=stated))


def holds(fit: Fit) -> bool:
    return all(abs(fit.value(name) - truth) < 3.5 * fit.uncertainty(name) for name, truth in TRUTH.items())


def causes(fit: Fit) -> set[Cause]:
    return {finding.cause for finding in fit.misfit.findings}


def test_a_clean_record_says_nothing_and_holds_the_truth() -> None:
    fits = [measured(seed) for seed in range(6)]
    assert not any(fit.misfit for fit in fits)
    assert all(holds(fit) for fit in fits)


@pytest.mark.parametrize(("share", "speed"), [(0.04, 0.26), (0.06, 0.22), (0.01, 0.18)])
def test_friction_that_hides_behind_that_of_the_air_is_in_the_interval_of_a_coast_to_a_twentieth(
    share: float, speed: float
) -> None:
    shaft = replace(SHAFT, coast_share=0.05, stribeck=share * SHAFT.coulomb, stribeck_speed=speed * SHAFT.top)
    moved = move([shaft])[0]
    for seed in range(3):
        coast = record(shaft, moved, np.random.default_rng(seed))[1]
        fit = fit_coast_down(coast.time, coast.speed)
        off = fit.value("coulomb_deceleration") - SHAFT.coulomb / SHAFT.inertia
        assert abs(off) < 2.0 * fit.uncertainty("coulomb_deceleration")


@pytest.mark.parametrize("time_constant", [0.09, pytest.param(0.116, marks=pytest.mark.slow)])
def test_a_filter_that_is_slow_beside_a_light_shafts_ramps_moves_no_inertia(time_constant: float) -> None:
    """A quarter of its ramps is shorter than the filter: without it an inertia is off by 20 %."""
    shaft = Shaft(
        inertia=1e-4, coulomb=0.003, viscous=1e-4, torque=0.015, top=17.0, noise=3e-4, torque_noise=6e-3, samples=50, settling=0.05,
        speed_filter=time_constant,
    )  # fmt: skip
    moved = move([shaft])[0]
    for seed in range(3):
        fit = fit_ramps(record(shaft, moved, np.random.default_rng(seed)))
        assert Cause.SPEED_FILTER in causes(fit)
        assert abs(fit.value("inertia") - shaft.inertia) < 2.0 * fit.uncertainty("inertia")
        assert fit.uncertainty("inertia") < 0.03 * shaft.inertia


@pytest.mark.slow
@pytest.mark.parametrize(
    ("disturbed", "cause"),
    [
        ({"quadratic": 5e-7}, Cause.WINDAGE),
        ({"stribeck": 0.02, "stribeck_speed": 30.0}, Cause.STRIBECK),
        ({"stribeck": 0.02, "stribeck_speed": 40.0, "stribeck_power": 2.0}, Cause.STRIBECK),
        ({"speed_filter": 0.1, "settling": 0.0}, Cause.SPEED_FILTER),
        ({"torque_filter": 0.05, "settling": 0.0}, Cause.TORQUE_FILTER),
        ({"dropouts": 7}, Cause.DROPOUTS),
        ({"eccentricity": 0.005}, Cause.ECCENTRICITY),
        ({"cogging": 0.06, "cogging_order": 12, "steps": 20_000}, Cause.COGGING),
    ],
)
def test_a_disturbance_is_named_and_the_truth_is_held(disturbed: dict[str, float], cause: Cause) -> None:
    fit = measured(**disturbed)
    assert cause in causes(fit)
    assert holds(fit)


def test_quadratic_friction_is_measured() -> None:
    fit = measured(quadratic=5e-7)
    low, high = fit.interval("quadratic_friction", 0.999)
    assert low < 5e-7 < high
    assert fit.uncertainty("quadratic_friction") < 5e-8


def test_filters_that_are_stated_need_no_warning() -> None:
    fit = measured(stated=True, speed_filter=0.02, torque_filter=0.02)
    assert holds(fit)
    assert not causes(fit) & {Cause.SPEED_FILTER, Cause.TORQUE_FILTER}


@pytest.mark.parametrize("seed", [1, pytest.param(2, marks=pytest.mark.slow), pytest.param(3, marks=pytest.mark.slow)])
def test_two_filters_before_a_quiet_speed_are_both_named(seed: int) -> None:
    # Where the torque's filter is undone, its scatter is far above the speed's.
    fit = measured(seed, noise=1e-3, speed_filter=0.03, torque_filter=0.05)
    assert causes(fit) >= {Cause.TORQUE_FILTER, Cause.SPEED_FILTER}
    assert not causes(fit) & {Cause.COGGING, Cause.STRIBECK, Cause.ECCENTRICITY, Cause.UNEXPLAINED}
    assert holds(fit)
    assert fit.uncertainty("coulomb_friction") < 0.1 * SHAFT.coulomb


def test_a_torque_that_climbs_over_half_the_ramp_is_told_where_no_motion_fits() -> None:
    """A transducer of steps of 1 mN·m, its filter a mean over half a second."""
    small = Shaft(
        inertia=2e-4, coulomb=6e-3, viscous=1e-4, torque=0.05, top=160.0, noise=1e-3, torque_noise=0.0, samples=180, settling=0.05
    )  # fmt: skip
    driven, coast = (
        replace(ramp, speed=np.round(ramp.speed, 3), speed_resolution=1e-3)
        for ramp in record(small, move([small])[0], np.random.default_rng(1))
    )
    climbing = np.round(small.torque * np.minimum(0.1 + driven.time / 0.5, 1.0), 3)
    with pytest.raises(EstimationError, match=r"the torque of ramp 1 keeps changing, as behind a slow filter: shorten"):
        fit_ramps([replace(driven, torque=climbing), coast])


@pytest.mark.parametrize("share", [0.2, -0.1])
def test_friction_that_drifts_while_the_shaft_turns_is_told_and_is_that_at_the_beginning(share: float) -> None:
    """Grease that warms up, and a seal that tightens."""
    fit = measured(0, thinning=share)
    (finding,) = fit.misfit.findings
    assert finding.cause is Cause.FRICTION_DRIFT
    assert finding.figures["share"] * share < 0.0
    assert holds(fit)
    assert fit.uncertainty("coulomb_friction") < 0.3 * abs(share) * SHAFT.coulomb


@pytest.mark.slow
def test_a_cause_that_is_not_in_the_list_widens() -> None:
    """A tachometer that is not straight."""
    plain = measured()
    bent = [
        replace(ramp, speed=ramp.speed * (1.0 + 0.02 * np.sin(3.0 * np.pi * ramp.speed / SHAFT.top)))
        for ramp in record(SHAFT, motion(), np.random.default_rng(1))
    ]
    fit = fit_ramps(bent)
    assert fit.misfit
    assert fit.uncertainty("coulomb_friction") > 3 * plain.uncertainty("coulomb_friction")


def test_seven_zeros_among_47_000_readings_cost_seven_readings() -> None:
    random = np.random.default_rng(3)
    time = np.arange(46_996) * 2e-3
    rate, level = 0.01, 2.0
    clean = (150.0 + level / rate) * np.exp(-rate * time) - level / rate
    turning = clean > 10.0
    time, speed = time[turning], clean[turning] + random.normal(0.0, 0.05, np.count_nonzero(turning))
    speed[random.choice(speed.size, 7, replace=False)] = 0.0
    fit = fit_coast_down(time, speed)
    (finding,) = fit.misfit.findings
    assert finding.cause is Cause.DROPOUTS
    assert finding.figures == {"count": 7.0, "readings": float(speed.size)}
    assert abs(fit.value("coulomb_deceleration") - level) < 4 * fit.uncertainty("coulomb_deceleration")
    assert fit.uncertainty("coulomb_deceleration") < 0.01 * level


def test_a_gap_of_zeros_does_not_end_a_record() -> None:
    random = np.random.default_rng(4)
    time = np.linspace(0.0, 4.0, 800)
    speed = 200.0 - 30.0 * time - 2.0 * time**2 + random.normal(0.0, 0.1, time.size)
    speed[300:330] = 0.0
    fit = fit_coast_down(time, speed)
    assert causes(fit) >= {Cause.DROPOUTS}
    assert fit.residuals.size > 750


def test_a_record_that_is_mostly_dropouts_is_refused() -> None:
    speed = np.linspace(200.0, 100.0, 90)
    speed[20:60] = 0.0
    with pytest.raises(EstimationError, match="zero or outliers"):
        fit_ramps([SpeedRamp(np.linspace(0.0, 1.0, 90), speed, 0.1)])


def test_ripple_and_steep_beginnings_are_no_dropouts() -> None:
    time = np.linspace(0.0, 1.0, 200)
    assert not np.any(wild(100.0 * time + 2.0 * np.sin(60.0 * time), 0.01))
    assert not np.any(wild(100.0 * (1.0 - np.exp(-time / 0.05)), 0.01))


@pytest.mark.parametrize("more", [pytest.param(40.0, marks=pytest.mark.slow), 60.0])
def test_a_hand_that_brakes_halfway_leaves_no_friction(more: float) -> None:
    random = np.random.default_rng(4)
    time = np.arange(0.0, 4.0, 2e-3)
    speed = 314.0 - 50.0 * time - more * np.maximum(time - 2.0, 0.0) + random.normal(0.0, 0.1, time.size)
    time, speed = time[speed > 5.0], speed[speed > 5.0]
    misfit = fit_coast_down(time, speed).misfit
    assert misfit.withholding("coulomb_deceleration") is not None
    assert fit_coast_down(time[time < 2.0], speed[time < 2.0]).misfit.withholding("coulomb_deceleration") is None


def test_two_coast_downs_show_grease_that_warms_up() -> None:
    # χ² over the time constant is no parabola here: the grid's best place is far from the lowest one.
    random, bearing = np.random.default_rng(3), Bearing(60.0, 0.15, 0.0, 0.3, 4.0)
    first = bearing.coast(0.0, 400.0, random)
    fit = fit_coast_downs([first, bearing.coast(float(first.time[-1]), 400.0, random)])
    assert [(each.cause, each.answer) for each in fit.misfit.findings] == [(Cause.FRICTION_DRIFT, Answer.MODELLED)]
    for name, truth in (("coulomb_deceleration", 60.0), ("viscous_rate", 0.15)):
        low, high = fit.interval(name)
        assert low <= truth <= high
        assert fit.value(name) == pytest.approx(truth, rel=0.03)


def test_two_coast_downs_of_other_friction_hold_the_first() -> None:
    # As on another day: a drift that is steady in each record fits the speeds, and its figures were off by several half-widths.
    random, other = np.random.default_rng(5), 1.1
    first = Bearing(20.0, 0.8, 0.0).coast(0.0, 300.0, random)
    fit = fit_coast_downs([first, Bearing(20.0 * other, 0.8 * other, 0.0).coast(0.0, 300.0, random)])
    assert any(each.cause in (Cause.FRICTION_DRIFT, Cause.UNEXPLAINED) for each in fit.misfit.findings)
    for name, truth in (("coulomb_deceleration", 20.0), ("viscous_rate", 0.8)):
        low, high = fit.interval(name)
        assert low <= truth <= high
