"""Bearing, air, slots and shaft sensors through the dynamometer's driver."""

import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from procedures.core.bench import Role
from sim_instruments.disturbances.bench import Disturbances, ShaftSensors
from sim_instruments.physics.motor.bearing import Bearing
from sim_instruments.physics.motor.motor import VirtualMotor
from tests.bench.virtual.disturbances.conftest import Make, Stand
from tests.sim_instruments.motors import BENCH_MOTOR

#: Of motor and dynamometer together.
INERTIA, COULOMB, VISCOUS = 2.0e-4, 0.02, 3.0e-5
#: What the transducer reads besides a torque: noise (N·m).
NOISE = 4e-4


def with_bearing(bearing: Bearing, **more: float) -> VirtualMotor:
    return replace(BENCH_MOTOR, bearing=bearing, **more)


def coupled(one: Stand) -> Stand:
    one.world.couple_dynamometer()
    return one


def torque_at(one: Stand, speed: float) -> float:
    """Return the mean torque (N·m) at a speed (rad/s)."""
    dynamometer = one.driver(Role.DYNAMOMETER)
    with dynamometer.driving_speed(speed):
        one.sleep(0.5)
        readings = [dynamometer.measure().torque for _ in range(50)]
    return float(np.mean(readings))


def test_windage_grows_with_the_square_of_the_speed(stand: Make) -> None:
    one = coupled(stand(motor=with_bearing(Bearing(windage=2.0e-6))))
    for speed in (50.0, 100.0):
        expected = COULOMB + VISCOUS * speed + 2.0e-6 * speed**2
        assert torque_at(one, speed) == pytest.approx(expected, abs=NOISE)


def test_stribeck_friction_fades_with_speed(stand: Make) -> None:
    one = coupled(stand(motor=with_bearing(Bearing(stribeck_torque=0.1, stribeck_speed=20.0, stribeck_exponent=2.0))))
    for speed in (5.0, 20.0, 40.0):
        expected = COULOMB + VISCOUS * speed + 0.1 * math.exp(-((speed / 20.0) ** 2))
        assert torque_at(one, speed) == pytest.approx(expected, abs=NOISE)


def test_stribeck_friction_holds_at_standstill(stand: Make) -> None:
    """0.02 N·m of Coulomb friction and 0.1 N·m on top: 0.115 N·m stands, 0.125 N·m does not."""
    one = coupled(stand(motor=with_bearing(Bearing(stribeck_torque=0.1, stribeck_speed=20.0))))
    dynamometer = one.driver(Role.DYNAMOMETER)
    with dynamometer.driving_torque(0.115):
        one.sleep(0.2)
        assert dynamometer.measure().speed == 0.0
    with dynamometer.driving_torque(0.125):
        one.sleep(0.2)
        assert dynamometer.measure().speed > 10.0


@pytest.mark.parametrize(
    "bearing", [Bearing(windage=1.0e-6), Bearing(stribeck_torque=0.02, stribeck_speed=15.0)], ids=["air", "film"]
)
def test_a_coast_follows_its_friction(stand: Make, bearing: Bearing) -> None:
    one = coupled(stand(motor=with_bearing(bearing)))
    dynamometer = one.driver(Role.DYNAMOMETER)
    with dynamometer.driving_speed(100.0):
        one.sleep(0.2)
    begin, first = one.bench.clock.now(), one.world.shaft_velocity()

    def slope(_: float, speed: np.ndarray) -> np.ndarray:
        film = bearing.stribeck_torque * np.exp(-speed / bearing.stribeck_speed)
        return -(COULOMB + VISCOUS * speed + bearing.windage * speed**2 + film) / INERTIA

    solution = solve_ivp(slope, (0.0, 1.5), [first], rtol=1e-10, atol=1e-10, dense_output=True)
    for _ in range(10):
        one.sleep(0.05)
        reading = dynamometer.measure()
        # The transducer shows the mean over the 20 ms before.
        before = np.linspace(reading.time - 0.02, reading.time, 41) - begin
        assert reading.speed == pytest.approx(float(np.mean(solution.sol(before)[0])), abs=0.2)


def test_a_coasting_shaft_feels_its_slots_where_it_is_more_than_dry_friction(stand: Make) -> None:
    """Energy goes to and fro: ω² swings by 2·A/(N·J) either way, 8.33 rad²/s² here, 0.083 rad/s at 50 rad/s."""
    motor = with_bearing(Bearing(), cogging_torque=0.02, cogging_order=24)
    swings = []
    without = replace(motor, bearing=Bearing(cogging_while_turning=False))
    for one in (coupled(stand(motor=motor)), coupled(stand(motor=without))):
        with one.driver(Role.DYNAMOMETER).driving_speed(50.0):
            one.sleep(0.2)
        speeds, times = [], []
        for _ in range(400):
            one.sleep(2.0e-4)
            speeds.append(one.world.shaft_velocity())
            times.append(one.bench.clock.now())
        trend = np.polyval(np.polyfit(times, np.square(speeds), 2), times)
        swings.append(float(np.ptp(np.square(speeds) - trend)))
    assert swings[0] == pytest.approx(2.0 * 2.0 * 0.02 / (24 * INERTIA), rel=0.05)
    assert swings[1] < 0.02 * swings[0]


def sensing(**values: float) -> Disturbances:
    return Disturbances(sensors=ShaftSensors(**values))  # type: ignore[arg-type]


def test_filters_lag_behind_a_ramp(stand: Make) -> None:
    one = coupled(stand(sensing(speed_filter=0.05, torque_filter=0.05)))
    dynamometer = one.driver(Role.DYNAMOMETER)
    with dynamometer.driving_torque(0.1):
        begin = one.bench.clock.now()
        one.sleep(0.05)
        early = dynamometer.measure()
        one.sleep(0.35)
        late, truth = dynamometer.measure(), one.world.shaft_velocity()
        read = one.bench.clock.now()
    passed = early.time - begin
    # The frames on the line take a little of the time constant.
    assert early.torque == pytest.approx(0.1 * (1.0 - math.exp(-passed / 0.05)), abs=0.006)
    assert late.torque == pytest.approx(0.1, abs=NOISE)
    # A ramp is shown as late as the time constant; the driver's further frames take their time too.
    acceleration = (0.1 - COULOMB - VISCOUS * truth) / INERTIA
    truth -= acceleration * (read - late.time)
    assert truth - late.speed == pytest.approx(0.05 * acceleration, rel=0.02)


def test_readings_drop_out_as_zeros(stand: Make) -> None:
    one = coupled(stand(sensing(dropouts=0.05)))
    dynamometer = one.driver(Role.DYNAMOMETER)
    # One that waits for the speed bears no zeros.
    one.world.dynamometer.command(50.0)
    one.world.dynamometer.enable(True)
    one.sleep(1.0)
    speeds = np.array([dynamometer.measure().speed for _ in range(1000)])
    assert np.count_nonzero(speeds == 0.0) == pytest.approx(50, abs=25)
    assert np.all((speeds == 0.0) | (np.abs(speeds - 50.0) < 0.1))


@pytest.mark.parametrize(
    ("filters", "share"),
    [({}, math.sin(0.5) / 0.5), ({"speed_filter": 0.05, "torque_filter": 0.05}, 1.0 / math.hypot(1.0, 2.5))],
)
def test_an_eccentric_encoder_and_shafts_out_of_line_show_once_a_turn(
    stand: Make, filters: dict[str, float], share: float
) -> None:
    """At 50 rad/s a mean over 20 ms leaves sinc(0.5) of it, a filter of 50 ms 1/√(1 + 2.5²)."""
    one = coupled(stand(sensing(speed_runout=0.01, torque_runout=0.05, **filters)))
    dynamometer = one.driver(Role.DYNAMOMETER)
    # One that waits for a steady speed waits for ever.
    one.world.dynamometer.command(50.0)
    one.world.dynamometer.enable(True)
    one.sleep(1.0)
    readings = []
    for _ in range(300):
        one.sleep(1.3e-3)
        readings.append(dynamometer.measure())
    speeds, torques = np.array([r.speed for r in readings]), np.array([r.torque for r in readings])
    assert np.ptp(speeds) == pytest.approx(2.0 * 0.01 * 50.0 * share, rel=0.02)
    assert np.ptp(torques) == pytest.approx(2.0 * 0.05 * share, rel=0.05)


def test_a_speed_counted_from_pulses_comes_in_steps(stand: Make) -> None:
    """60 pulses a turn within 20 ms: steps of 2π/(60·0.02 s) = 5.236 rad/s, right in the mean."""
    one = coupled(stand(sensing(pulses=60)))
    dynamometer = one.driver(Role.DYNAMOMETER)
    one.world.dynamometer.command(50.0)
    one.world.dynamometer.enable(True)
    one.sleep(1.0)
    speeds = np.array([dynamometer.measure().speed for _ in range(600)])
    step = 2.0 * math.pi / (60.0 * 0.02)
    assert np.allclose(speeds / step, np.rint(speeds / step), atol=1e-3)
    assert len(set(np.rint(speeds / step))) == 2
    assert np.mean(speeds) == pytest.approx(50.0, abs=0.4)


def test_the_torques_zero_drifts_and_the_floor_shakes(stand: Make) -> None:
    one = coupled(stand(sensing(torque_drift=0.01)))
    dynamometer = one.driver(Role.DYNAMOMETER)
    first = dynamometer.measure()
    one.sleep(20.0)
    second = dynamometer.measure()
    assert second.torque - first.torque == pytest.approx(0.01 * (second.time - first.time), abs=2.0 * NOISE)
    shaken = coupled(stand(sensing(vibration=0.03, vibration_frequency=7.0))).driver(Role.DYNAMOMETER)
    torques = [shaken.measure().torque for _ in range(400)]
    assert np.ptp(torques) == pytest.approx(0.06, rel=0.05)


@pytest.mark.parametrize(
    "values", [{"dropouts": 1.0}, {"speed_filter": -1.0}, {"vibration_frequency": 0.0}, {"torque_drift": math.nan}]
)
def test_sensors_that_cannot_be_are_refused(values: dict[str, float]) -> None:
    with pytest.raises(ValueError, match=next(iter(values))):
        ShaftSensors(**values)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="windage"):
        Bearing(windage=-1.0)
