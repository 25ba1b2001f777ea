"""Iron and contacts through the drivers of supply, oscilloscope, bridge and voltmeter."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from drivers.interfaces import ChannelSettings, Regulated, Slope, Trigger
from procedures.core.bench import Role
from sim_instruments.disturbances.bench import Contacts, Disturbances
from sim_instruments.physics.motor.iron import Iron
from tests.bench.virtual.disturbances.conftest import Make, Stand
from tests.bench.virtual.disturbances.test_channels import phasor
from tests.sim_instruments.motors import BENCH_MOTOR

IRON = Iron(eddy_coupling=0.5, eddy_resistance=2.0)
D_INDUCTANCE, RESISTANCE = 1.0e-3, 0.5


def test_eddy_currents_are_a_second_time_constant_of_the_step(stand: Make) -> None:
    one = stand(motor=replace(BENCH_MOTOR, iron=IRON))
    world, scope, supply = one.world, one.driver(Role.OSCILLOSCOPE), one.driver(Role.SUPPLY)
    world.lock_rotor()
    world.connect({"A": "supply+", "B": "supply-", "C": "supply-"})
    world.attach_voltage_probe(1, "A", "B")
    world.attach_current_probe(4, "A")
    scope.configure_channel(1, ChannelSettings(4.0, 1.0))
    scope.configure_channel(4, ChannelSettings(8.0, 2.0))
    scope.configure_acquisition(0.02, 5000, pre_trigger=0.2)
    scope.configure_trigger(Trigger(1, 1.0, Slope.RISING))
    scope.initiate()
    with supply.energised(2.0, 9.0):
        waves = scope.fetch([1, 4], timeout=5.0)
    time, current = waves[4].time, waves[4].values
    k = IRON.eddy_coupling
    # One phase against two: 1.5 of a phase's values; the shorted windings carry currents of the same shares.
    inertance = np.array([[1.5 * D_INDUCTANCE, 1.5 * k * D_INDUCTANCE], [k * D_INDUCTANCE, D_INDUCTANCE]])

    def slope(at: float, state: np.ndarray) -> np.ndarray:
        voltage = np.interp(at, waves[1].time, waves[1].values)
        drops = np.array([voltage - 1.5 * RESISTANCE * state[0], -IRON.eddy_resistance * state[1]])
        return np.asarray(np.linalg.solve(inertance, drops))

    solution = solve_ivp(slope, (time[0], time[-1]), [0.0, 0.0], t_eval=time, max_step=2e-5)
    assert np.max(np.abs(np.convolve(current - solution.y[0], np.full(21, 1.0 / 21.0), "valid"))) < 0.04
    # Without eddy currents the current is another one by far more.
    plain = solve_ivp(
        lambda at, i: (np.interp(at, waves[1].time, waves[1].values) - 1.5 * RESISTANCE * i) / (1.5 * D_INDUCTANCE),
        (time[0], time[-1]),
        [0.0],
        t_eval=time,
        max_step=2e-5,
    )
    assert np.max(np.abs(current - plain.y[0])) > 0.1


@pytest.mark.parametrize("frequency", [100.0, 1000.0, 10_000.0])
def test_eddy_currents_make_the_bridges_reading_depend_on_frequency(stand: Make, frequency: float) -> None:
    one = stand(motor=replace(BENCH_MOTOR, iron=IRON))
    bridge = one.driver(Role.LCR_METER)
    one.world.connect({"A": "lcr_high", "B": "lcr_low", "C": "lcr_low"})
    bridge.configure(frequency)
    one.sleep(1.0)
    reading = bridge.measure()
    reactance = 2j * math.pi * frequency * D_INDUCTANCE
    shorted = IRON.eddy_coupling**2 * reactance**2 / (IRON.eddy_resistance + reactance)
    expected = 1.5 * (RESISTANCE + reactance - shorted)
    assert reading.resistance == pytest.approx(expected.real, rel=2e-3)
    assert reading.inductance == pytest.approx(expected.imag / (2.0 * math.pi * frequency), rel=2e-3)


def emf(one: Stand, speed: float) -> float:
    """Return the amplitude (V) of a line's EMF over its electrical speed, at a speed (rad/s)."""
    scope = one.driver(Role.OSCILLOSCOPE)
    one.world.attach_voltage_probe(1, "A", "B")
    scope.configure_channel(1, ChannelSettings(0.4 * speed))
    scope.configure_acquisition(0.2, 10_000)
    with one.driver(Role.DYNAMOMETER).driving_speed(speed):
        scope.configure_trigger(Trigger(None))
        scope.initiate()
        one.sleep(0.5)
        wave = scope.fetch([1], timeout=5.0)[1]
    return abs(phasor(wave, 4.0 * speed)) / (4.0 * speed)


def test_the_flux_linkage_falls_with_the_skin_effect(stand: Make) -> None:
    one = stand(motor=replace(BENCH_MOTOR, iron=Iron(emf_corner=50.0)))
    one.world.couple_dynamometer()
    for speed in (20.0, 80.0, 160.0):
        root = cmath.sqrt(1j * 4.0 * speed / (2.0 * math.pi) / 50.0)
        share = abs(cmath.tanh(root) / root)
        assert emf(one, speed) == pytest.approx(math.sqrt(3.0) * 0.02 * share, rel=2e-3)


def test_magnets_that_warm_up_with_speed_lose_flux(stand: Make) -> None:
    one = stand(motor=replace(BENCH_MOTOR, iron=Iron(magnet_rise=40.0, magnet_rise_speed=100.0)))
    one.world.couple_dynamometer()
    for speed in (50.0, 100.0):
        share = 1.0 - 0.001 * 40.0 * (speed / 100.0) ** 2
        assert emf(one, speed) == pytest.approx(math.sqrt(3.0) * 0.02 * share, rel=2e-3)


def test_iron_that_cannot_be_is_refused() -> None:
    for values, name in (({"eddy_coupling": 1.0}, "eddy_coupling"), ({"emf_corner": 0.0}, "emf_corner")):
        with pytest.raises(ValueError, match=name):
            Iron(**values)
    with pytest.raises(ValueError, match="saturation"):
        replace(BENCH_MOTOR, iron=IRON, d_axis_saturation_current=5.0)


def sensed(one: Stand) -> float:
    """Return the voltmeter's reading (V)."""
    voltmeter = one.driver(Role.VOLTMETER)
    voltmeter.configure(0.1, 10.0)
    value: float = voltmeter.measure_voltage().value
    return value


def test_a_thermal_emf_fades(stand: Make) -> None:
    one = stand(Disturbances(contacts=Contacts(thermal_emf=1.0e-3, thermal_time=30.0)))
    one.world.attach_voltmeter("A", "B")
    attached = one.bench.clock.now()
    for _ in range(3):
        one.sleep(10.0)
        reading = sensed(one)
        passed = one.bench.clock.now() - attached
        assert reading == pytest.approx(1.0e-3 * math.exp(-passed / 30.0), rel=0.02)


def test_a_contact_warms_under_load(stand: Make) -> None:
    """Two of 20 mΩ at 1 A, doubled by 2 A: 40 mV, and a quarter more when warm, in the supply's loop whoever senses them."""
    contacts = Contacts(resistance=0.02, doubling_current=2.0, heating_time=5.0, remaking=0.0)
    one, plain, own = (
        stand(Disturbances(contacts=each)) for each in (contacts, Contacts(), replace(contacts, kelvin=True))
    )
    shown, fed = [], []
    for each in (one, plain, own):
        each.world.lock_rotor()
        each.world.connect({"A": "supply+", "B": "supply-"})
        each.world.attach_voltmeter("A", "B")
        voltmeter = each.driver(Role.VOLTMETER)
        voltmeter.configure(10.0, 10.0)
        supply = each.driver(Role.SUPPLY)
        with supply.energised(5.0, 1.0, Regulated.CURRENT):
            begin = each.bench.clock.now()
            each.sleep(5.0)
            values = [voltmeter.measure_voltage().value]
            middle = each.bench.clock.now() - begin
            each.sleep(60.0)
            values.append(voltmeter.measure_voltage().value)
            fed.append(supply.measure_voltage().value)
        shown.append(np.array(values))
    cold_and_warm = shown[0] - shown[1]
    assert cold_and_warm[0] == pytest.approx(0.04 * (1.0 + 0.25 * (1.0 - math.exp(-middle / 5.0))), rel=0.02)
    assert cold_and_warm[1] == pytest.approx(0.05, rel=0.01)
    assert shown[2] == pytest.approx(shown[1], abs=1e-4)
    assert fed == pytest.approx([shown[0][1], shown[1][1], shown[0][1]], abs=2e-3)


def test_the_bridge_sees_a_contact_that_its_short_correction_has_not(stand: Make) -> None:
    for kelvin, contact in ((False, 0.05), (True, 0.0)):
        one = stand(Disturbances(contacts=Contacts(resistance=0.05, remaking=0.0, kelvin=kelvin)))
        bridge = one.driver(Role.LCR_METER)
        one.world.connect({"A": "lcr_high", "B": "lcr_low", "C": "lcr_low"})
        bridge.configure(100.0)
        one.sleep(1.0)
        assert bridge.measure().resistance == pytest.approx(1.5 * (RESISTANCE + contact), rel=2e-3)


def test_a_clamp_put_on_anew_is_another_contact(stand: Make) -> None:
    one = stand(Disturbances(contacts=Contacts(resistance=0.05, remaking=0.5)))
    one.driver(Role.LCR_METER).configure(100.0)
    shown = []
    for _ in range(40):
        one.world.connect({"A": "lcr_high", "B": "lcr_low", "C": "lcr_low"})
        one.sleep(1.0)
        shown.append(one.world.impedance(100.0, 1.0, 0.1).real - 1.5 * RESISTANCE)
    assert shown[-1] == pytest.approx(one.world.impedance(100.0, 1.0, 0.1).real - 1.5 * RESISTANCE)
    # One, and half of two.
    relative = math.sqrt(math.expm1(0.25)) * math.sqrt(1.0 + 2.0 / 16.0) / 1.5
    assert np.std(np.log(shown), ddof=1) == pytest.approx(relative, abs=0.1)
