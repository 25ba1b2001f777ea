import numpy as np
import pytest
from GTC import ureal

from procedures.core.misfit_text import sentence
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.mechanics.inertia import (
    fit_ramps,
    subtract_tare,
    torque_from_power,
    two_point,
)
from procedures.estimation.mechanics.turning import SpeedRamp
from tests.studies.worlds.shaft_records import fit_coast_down
from tests.studies.worlds.simulated import COULOMB, INERTIA, MECHANICS, TORQUE, VISCOUS, ramp_speed, ramps

UP, DOWN = np.linspace(0, 0.3, 100), np.linspace(0, 0.5, 120)
TOP = ramp_speed(MECHANICS, UP, TORQUE, 0.0)[-1]


def exact(sign: float = 1.0) -> list[SpeedRamp]:
    return [
        SpeedRamp(UP, sign * ramp_speed(MECHANICS, UP, TORQUE, 0.0), sign * TORQUE),
        SpeedRamp(DOWN, sign * ramp_speed(MECHANICS, DOWN, 0.0, TOP)),
    ]


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_exact_ramps_give_exact_parameters_in_both_directions(sign: float) -> None:
    fit = fit_ramps(exact(sign))
    # The mean over laws of friction at low speed that even these ramps do not rule out moves the viscous friction by 1e-4.
    assert fit.values[:3] == pytest.approx(MECHANICS, rel=2e-4)
    assert fit.names[3:] == ("initial_speed_1", "initial_speed_2", "quadratic_friction")


def test_a_torque_hardly_noisy_is_no_reason_to_refuse_a_long_record() -> None:
    """A shaft of a traction motor: what the noise of its torque moves is a billionth of what the friction moves."""
    random = np.random.default_rng(3)
    law, torque = (0.162, 1.08, 2.35e-3), 58.5
    up, down = np.linspace(0.04, 0.96, 154), np.linspace(0.05, 29.0, 4841)
    driven, coast = ramp_speed(law, up, torque, 0.0), ramp_speed(law, down, 0.0, 342.0)
    noisy = torque + 0.003 * random.standard_normal(up.size)
    speeds = [np.round(speed / 1e-3) * 1e-3 for speed in (driven, coast)]
    fit = fit_ramps([SpeedRamp(up, speeds[0], noisy, 1e-3), SpeedRamp(down, speeds[1], 0.0, 1e-3)])
    assert fit.values[:3] == pytest.approx(law, rel=2e-3)


def test_standstill_before_and_after_is_left_out() -> None:
    down = np.linspace(0, 3.0, 600)
    stopped = np.maximum(ramp_speed(MECHANICS, down, 0.0, TOP), 0.0)
    up_time = np.linspace(-0.2, 0.3, 200)
    up = np.where(up_time > 0, ramp_speed(MECHANICS, np.maximum(up_time, 0), TORQUE, 0.0), 0.0)
    assert fit_ramps([SpeedRamp(up_time, up, TORQUE), SpeedRamp(down, stopped)]).values[:3] == pytest.approx(
        MECHANICS, rel=1e-4
    )


def test_uneven_sampling_and_a_torque_that_changes() -> None:
    random = np.random.default_rng(1)
    time = np.sort(random.uniform(0, 0.3, 400))
    steps = 20_001
    fine = np.linspace(0, 0.3, steps)
    torque = 0.1 + 0.2 * fine
    k = VISCOUS / INERTIA
    from_torque = np.concatenate(([0.0], np.cumsum(np.exp(k * fine[1:]) * (torque[1:] - COULOMB) / INERTIA * fine[1])))
    speed = np.exp(-k * fine) * from_torque
    driven = SpeedRamp(time, np.interp(time, fine, speed), 0.1 + 0.2 * time)
    assert fit_ramps([driven, exact()[1]]).values[:2] == pytest.approx(MECHANICS[:2], rel=5e-3)


def test_scatter_of_the_torque_is_part_of_the_uncertainty() -> None:
    random = np.random.default_rng(2)
    up, down = ramps(random)
    noisy = fit_ramps([SpeedRamp(up.time, up.speed, TORQUE + random.normal(0, 0.01, up.time.size)), down])
    assert noisy.uncertainty("inertia") / INERTIA == pytest.approx(0.01 / TORQUE / np.sqrt(up.time.size), rel=0.3)
    assert abs(noisy.value("inertia") - INERTIA) < 4 * noisy.uncertainty("inertia")


def test_coast_down_alone_gives_friction_over_inertia() -> None:
    fit = fit_coast_down(DOWN, ramp_speed(MECHANICS, DOWN, 0.0, TOP))
    # What friction at low speed may still hide is on one side.
    assert fit.value("coulomb_deceleration") == pytest.approx(COULOMB / INERTIA, rel=1e-4)
    assert fit.value("viscous_rate") == pytest.approx(VISCOUS / INERTIA, rel=1e-3)
    assert fit.value("initial_speed") == pytest.approx(TOP)


def test_two_points_as_in_the_note() -> None:
    found = two_point(0.0, 0.0, 1.0, 800.0, 0.1, 2.0, 800.0, 3.0, 600.0)
    assert found.inertia == pytest.approx(1e-4)
    assert found.no_load_torque == pytest.approx(0.02)


def test_two_points_are_biased_by_viscous_friction_over_different_speeds() -> None:
    heavy = np.array([INERTIA, COULOMB, 2e-4])
    w = [float(ramp_speed(heavy, np.array([t]), TORQUE, 0.0)[0]) for t in (0.02, 0.08)]
    c = [float(ramp_speed(heavy, np.array([t]), 0.0, 200.0)[0]) for t in (0.0, 0.1)]
    assert two_point(0.02, w[0], 0.08, w[1], TORQUE, 0.0, c[0], 0.1, c[1]).inertia / INERTIA - 1 < -0.05


def test_tare_is_subtracted_with_its_uncertainty() -> None:
    coupled = {
        "inertia": ureal(1e-3, 3e-6),
        "coulomb_friction": ureal(0.05, 1e-3),
        "viscous_friction": ureal(4e-4, 1e-5),
    }
    tare = {"inertia": ureal(4e-4, 4e-6), "coulomb_friction": ureal(0.02, 1e-3), "viscous_friction": ureal(1e-4, 1e-5)}
    motor = subtract_tare(coupled, tare)
    assert (motor["inertia"].x, motor["inertia"].u) == pytest.approx((6e-4, 5e-6))
    plain = subtract_tare({n: q.x for n, q in coupled.items()}, {n: q.x for n, q in tare.items()})
    assert plain == pytest.approx({"inertia": 6e-4, "coulomb_friction": 0.03, "viscous_friction": 3e-4})
    with pytest.raises(EstimationError, match=r"0\.0004 kg.m², is not below"):
        subtract_tare(dict.fromkeys(tare, 4e-4), dict.fromkeys(tare, 4e-4))


def test_torque_from_shaft_power_is_that_of_the_mechanical_speed() -> None:
    speed = np.linspace(0.0, 300.0, 50)
    assert torque_from_power(0.2 * speed, speed) == pytest.approx(0.2)
    with pytest.raises(EstimationError, match="stands still"):
        torque_from_power([1.0, 1.0], [0.0, 0.0])


@pytest.mark.parametrize(
    ("records", "message"),
    [
        ([], "no ramp"),
        (exact()[1:], "no ramp has a driving torque"),
        ([SpeedRamp(UP, exact()[0].speed, -TORQUE), exact()[1]], "torque's sign is reversed"),
        ([SpeedRamp(UP, np.full(100, 50.0), TORQUE)], "does not change"),
        ([SpeedRamp(UP[:4], UP[:4], TORQUE)], "at least 5"),
        ([SpeedRamp(UP, np.where(UP > 0.1, np.nan, 1.0), TORQUE)], "not numbers"),
        ([SpeedRamp(UP[::-1], exact()[0].speed, TORQUE)], "does not increase"),
    ],
)
def test_ramps_that_carry_no_estimate_are_refused(records, message) -> None:
    with pytest.raises(EstimationError, match=message):
        fit_ramps(records)


def test_a_rising_speed_is_no_coast_down() -> None:
    with pytest.raises(EstimationError, match="does not fall"):
        fit_coast_down(UP, exact()[0].speed)
    with pytest.raises(EstimationError, match="not steeper"):
        two_point(0.0, 0.0, 1.0, -800.0, 0.1, 2.0, 800.0, 3.0, 600.0)


def test_a_friction_that_would_be_negative_withholds_both() -> None:
    # Friction that falls over all of the range, by a law that no term has.
    random, dt, fine, w = np.random.default_rng(2), 0.01, 20, 300.0
    speeds = []
    while w > 6.0:
        speeds.append(w)
        for _ in range(fine):
            w -= (100.0 + 0.15 * w + 1.0e2 * (w / 100.0) / (1.0 + (w / 100.0) ** 2)) * dt / fine
    speed = np.array(speeds) + random.normal(0.0, 0.3, len(speeds))
    fit = fit_coast_down(np.arange(speed.size) * dt, speed)
    assert fit.value("coulomb_deceleration") < 0.0
    for name in ("coulomb_deceleration", "viscous_rate"):
        withheld = fit.misfit.withholding(name)
        assert withheld is not None
        assert "negative friction" in sentence(withheld).render()


def test_a_tare_that_is_not_known_well_enough_is_no_wrong_coupling() -> None:
    coupled = dict.fromkeys(("coulomb_friction", "viscous_friction"), ureal(1e-2, 1e-4)) | {
        "inertia": ureal(1.7e-4, 1e-6)
    }
    with pytest.raises(EstimationError, match=r"their difference is known to 0\.19 kg·m² only"):
        subtract_tare(coupled, coupled | {"inertia": ureal(3.8e-4, 0.094)})
    with pytest.raises(EstimationError, match="coupled for the second run only"):
        subtract_tare(coupled, coupled | {"inertia": ureal(3.8e-4, 1e-6)})
