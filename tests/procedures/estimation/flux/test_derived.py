"""What follows from a map, against truths that are solved otherwise."""

import numpy as np
import pytest

from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.flux.capability import TorqueLimit, largest_torque
from procedures.estimation.flux.conserving import fit_conserving
from procedures.estimation.flux.flux_map import MeasuredFluxMap
from procedures.estimation.flux.inductances import characteristic_current, inductances_at, reciprocity
from procedures.estimation.flux.mtpa import maximum_torque_per_ampere, torque_figure
from procedures.estimation.flux.plan import grid_locations
from tests.studies.worlds.flux_truths import TrueMotor, true_motors

MOTORS = {name: motor for name, motor in true_motors(None).items() if motor.symmetric}


def exact_map(motor: TrueMotor, count: int = 80, gain: float = 0.003) -> MeasuredFluxMap:
    """A map without scatter, of `count` locations."""
    points = grid_locations(motor.largest_current, count)
    flux = motor.flux(points[:, 0] + 1j * points[:, 1])
    values = np.column_stack((flux.real, flux.imag))
    scatter = np.full(values.size, (1e-5 * np.max(np.abs(flux))) ** 2)
    return MeasuredFluxMap(points, values, np.diag(scatter), True, shared={"voltage": gain * values.ravel()})


@pytest.fixture(params=sorted(MOTORS))
def motor(request: pytest.FixtureRequest) -> TrueMotor:
    return MOTORS[str(request.param)]


def test_angle_of_most_torque(motor: TrueMotor) -> None:
    measured = exact_map(motor)
    for share in (0.3, 0.6, 1.0):
        current = share * motor.largest_current
        beta = np.linspace(0.0, np.pi, 20001)
        i = current * np.exp(1j * beta)
        torque = 1.5 * motor.pole_pairs * (np.conj(motor.flux(i)) * i).imag
        best = int(np.argmax(torque))
        (made,) = maximum_torque_per_ampere(measured, current, motor.pole_pairs)
        assert made.angle.value == pytest.approx(np.degrees(beta[best]) - 90.0, abs=0.7)
        assert made.torque.value == pytest.approx(torque[best], rel=0.01)
        # A voltage gain goes straight into the torque.
        low, high = made.torque.coverage_interval
        assert (high - low) / 2.0 >= 0.9 * 0.003 * 0.95 * made.torque.value
        assert not made.at_edge


def test_torque_over_speed_meets_both_limits() -> None:
    motor = MOTORS["bridged IPMSM"]
    measured = exact_map(motor)
    voltage, most = 60.0, motor.largest_current
    speeds = motor.electrical_speed * np.array([0.3, 1.0, 2.0, 4.0])
    made = largest_torque(
        measured, speeds, voltage=voltage, current=most, resistance=motor.resistance, pole_pairs=motor.pole_pairs
    )
    arc = most * np.exp(1j * np.linspace(0.0, np.pi, 100001))
    inside = (np.linspace(0.01, 1.0, 200)[:, None] * most * np.exp(1j * np.linspace(0.0, np.pi, 721))).ravel()
    every = np.concatenate((arc, inside))
    flux = motor.flux(every)
    torque = 1.5 * motor.pole_pairs * (np.conj(flux) * every).imag
    assert {point.limit for point in made} >= {TorqueLimit.CURRENT, TorqueLimit.CURRENT_AND_VOLTAGE}
    for point in made:
        fits = np.abs(motor.resistance * every + 1j * point.electrical_speed * flux) <= voltage
        assert point.torque.value == pytest.approx(np.max(torque[fits]), rel=0.01)
        assert point.voltage <= voltage * 1.0001
        assert np.hypot(point.i_d, point.i_q) <= most * 1.0001


def test_the_voltage_alone_limits_a_motor_with_a_short_circuit_current_within_its_map() -> None:
    motor = MOTORS["reluctance, little magnet"]
    measured = exact_map(motor)
    made = largest_torque(
        measured, 12.0 * motor.electrical_speed, voltage=60.0, current=20.0, resistance=0.6, pole_pairs=2
    )
    assert made[0].limit is TorqueLimit.VOLTAGE
    assert np.hypot(made[0].i_d, made[0].i_q) < 19.0


def test_inductances_are_the_slopes(motor: TrueMotor) -> None:
    measured = exact_map(motor)
    i_d, i_q, h = -0.3 * motor.largest_current, 0.4 * motor.largest_current, 1e-4 * motor.largest_current
    made = inductances_at(measured, i_d, i_q)

    def flux(d: float, q: float) -> complex:
        return complex(motor.flux(np.array([d + 1j * q]))[0])

    along_d = (flux(i_d + h, i_q) - flux(i_d - h, i_q)) / (2.0 * h)
    along_q = (flux(i_d, i_q + h) - flux(i_d, i_q - h)) / (2.0 * h)
    for figure, true in (
        (made.dd, along_d.real),
        (made.qd, along_d.imag),
        (made.dq, along_q.real),
        (made.qq, along_q.imag),
    ):
        low, high = figure.coverage_interval
        margin = high - low
        assert low - margin <= true <= high + margin
    assert made.apparent_q is not None
    assert made.apparent_q.value == pytest.approx(flux(i_d, i_q).imag / i_q, rel=0.01)
    assert inductances_at(measured, 0.0, i_q).apparent_d is None


def test_field_weakening_current() -> None:
    motor = MOTORS["reluctance, little magnet"]
    made = characteristic_current(exact_map(motor))
    assert made is not None
    # Along the d axis this motor is straight: 0.06 V·s over 18 mH.
    assert made.value == pytest.approx(0.06 / 18e-3, rel=0.01)
    assert characteristic_current(exact_map(MOTORS["surface magnets"])) is None
    with pytest.raises(EstimationError, match="no magnet"):
        characteristic_current(exact_map(MOTORS["reluctance"]))


def test_the_second_product_conserves_energy(motor: TrueMotor) -> None:
    measured = exact_map(motor)
    surface, h = fit_conserving(measured), 1e-4 * motor.largest_current
    assert np.max(np.abs(surface.residuals)) < 0.005 * measured.full_scale
    random = np.random.default_rng(1)
    at = motor.largest_current * 0.6 * random.uniform(-1.0, 1.0, (20, 2))
    d, q = np.array([h, 0.0]), np.array([0.0, h])
    dq, qd = (surface(at + q) - surface(at - q))[:, 0], (surface(at + d) - surface(at - d))[:, 1]
    assert dq == pytest.approx(qd, abs=1e-6 * measured.full_scale)
    true = motor.flux(at[:, 0] + 1j * at[:, 1])
    assert np.max(np.abs(surface(at) - np.column_stack((true.real, true.imag)))) < 0.01 * measured.full_scale


def test_a_wrong_resistance_shows_in_the_reciprocity() -> None:
    motor = MOTORS["surface magnets"]
    measured, wrong, speed = exact_map(motor), 0.05, motor.electrical_speed
    flux = measured.flux + wrong / speed * np.column_stack((measured.points[:, 1], -measured.points[:, 0]))
    off = MeasuredFluxMap(measured.points, flux, measured.covariance, False)
    at = np.array([[-3.0, 5.0], [-8.0, 7.0]])
    assert reciprocity(off, at) == pytest.approx(2.0 * wrong / speed, rel=0.2)


def test_a_current_beyond_the_map_is_refused() -> None:
    with pytest.raises(EstimationError, match="not within the map"):
        maximum_torque_per_ampere(exact_map(MOTORS["surface magnets"]), 30.0, 4)


def test_torque_at_a_point_is_that_of_the_map() -> None:
    motor = MOTORS["surface magnets"]
    measured = exact_map(motor)
    place = int(np.argmax(measured.points[:, 1]))
    made = torque_figure(measured, *measured.points[place], motor.pole_pairs)
    assert made.value == pytest.approx(measured.torque(motor.pole_pairs)[place], rel=1e-4)
