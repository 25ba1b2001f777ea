"""The iron's loss on the shaft and in the currents, and magnets that warm up behind the winding."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sim_instruments.physics.mapped.windings import MappedWindings
from sim_instruments.physics.motor.iron import Iron
from sim_instruments.physics.motor.magnets import Magnets
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import DynamometerMachine
from sim_instruments.world.world import World
from tests.sim_instruments.flux_maps import MADE

IRON = Iron(hysteresis_loss=8.0, eddy_loss=0.05)
MACHINE = DynamometerMachine(
    inertia=0.0, coulomb_friction=0.0, viscous_friction=0.0, maximum_torque=100.0, speed_ripple=0.0
)


def by_constants(lab: Any, **changes: Any) -> VirtualMotor:
    values: dict[str, Any] = {"coulomb_friction": 0.0, "viscous_friction": 0.0, "thermal_resistance": 0.0, "iron": IRON}
    made: VirtualMotor = lab.lg_400w(**{**values, **changes})
    return made


def on_map(lab: Any, **changes: Any) -> VirtualMotor:
    flux_map = MADE.map(120.0, 31)
    return by_constants(lab, flux_map=flux_map, flux_linkage=flux_map.flux_linkage, **changes)


def delta(lab: Any, **changes: Any) -> VirtualMotor:
    values: dict[str, Any] = {"coulomb_friction": 0.0, "viscous_friction": 0.0, "thermal_resistance": 0.0, "iron": IRON}
    made: VirtualMotor = lab.outrunner(**{**values, **changes})
    return made


every = pytest.mark.parametrize("motor", [by_constants, on_map, delta])


def turned(lab: Any, motor: VirtualMotor, speed: float) -> World:
    world, clock = lab.ideal_world(motor, dynamometer=MACHINE)
    world.couple_dynamometer()
    world.dynamometer.set_mode("speed")
    world.dynamometer.enable(True)
    world.dynamometer.command(speed)
    clock.sleep(5.0)
    made: World = world
    return made


def expected_brake(motor: VirtualMotor, speed: float, flux: float) -> float:
    omega = motor.pole_pairs * speed
    return 1.5 * motor.pole_pairs * (IRON.hysteresis_loss + IRON.eddy_loss * omega) * flux**2


@every
def test_open_terminals_are_braked_by_the_iron(lab: Any, motor: Any) -> None:
    given = motor(lab)
    for speed in (20.0, 200.0):
        found = turned(lab, given, speed).dynamometer.torque(0.1)
        # The loss' own current across the flux changes that by a thousandth or two.
        assert found == pytest.approx(expected_brake(given, speed, given.flux_linkage_y), rel=5e-3)
        back = turned(lab, given, -speed).dynamometer.torque(0.1)
        assert back == pytest.approx(-found, rel=1e-9)


@every
def test_the_true_friction_is_what_a_coasting_shaft_shows(lab: Any, motor: Any) -> None:
    given = motor(lab, coulomb_friction=0.01, viscous_friction=1e-4)
    for speed in (20.0, 200.0):
        found = turned(lab, given, speed).dynamometer.torque(0.1)
        assert found == pytest.approx(given.open_coulomb_friction + given.open_viscous_friction * speed, rel=5e-3)


@every
def test_a_coasting_shaft_stops_by_the_iron_alone(lab: Any, motor: Any) -> None:
    given = motor(lab, inertia=1e-3)
    world = turned(lab, given, 100.0)
    world.dynamometer.enable(False)
    start = world.clock.now()
    world.clock.sleep(0.05)
    brake = expected_brake(given, 100.0, given.flux_linkage_y)
    slope = given.open_viscous_friction / given.inertia
    still = brake / given.inertia / slope
    assert world.shaft_speed(0.0) == pytest.approx(
        100.0 - still * -math.expm1(-slope * (world.clock.now() - start)), rel=1e-3
    )
    world.clock.sleep(60.0)
    assert world.shaft_speed(0.0) == 0.0


def test_hysteresis_holds_a_shaft_that_stands(lab: Any) -> None:
    given = on_map(lab)
    holding = expected_brake(given, 0.0, given.flux_linkage_y)
    world, clock = lab.ideal_world(given, dynamometer=MACHINE)
    world.couple_dynamometer()
    world.dynamometer.set_mode("torque")
    world.dynamometer.enable(True)
    world.dynamometer.command(0.9 * holding)
    clock.sleep(1.0)
    assert world.shaft_speed(0.0) == 0.0
    world.dynamometer.command(1.2 * holding)
    clock.sleep(0.01)
    assert world.shaft_speed(0.0) > 0.0


def test_the_current_that_is_lost_stands_across_the_flux(lab: Any) -> None:
    windings = MappedWindings(on_map(lab), 25.0)
    speed, current = np.array([900.0]), np.array([-20.0 + 35.0j])
    flux = windings.flux_linkages_y(current, speed)
    magnetising = current - (IRON.hysteresis_loss + IRON.eddy_loss * speed) * 1j * flux
    assert windings.flux_linkages_y(magnetising, np.zeros(1)) == pytest.approx(flux, rel=1e-12)


def test_an_inverter_carries_the_loss(lab: Any) -> None:
    # At one current in the rotor's frame: the torque on the shaft lacks what the iron takes, and the power adds up.
    given = on_map(lab)
    torques = []
    for iron in (Iron(), IRON):
        world = turned(lab, replace(given, iron=iron), 60.0)
        world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        world.inverter.set_mode("dq")
        world.inverter.enable(True)
        world.inverter.command_dq_current(-10.0 + 20.0j)
        world.clock.sleep(1.0)
        torques.append(-world.dynamometer.torque(0.1))
    made, current, magnetising = MADE.map(120.0, 31), -10.0 + 20.0j, -10.0 + 20.0j
    lost = IRON.hysteresis_loss + IRON.eddy_loss * 4 * 60.0
    for _ in range(30):
        flux = complex(*(float(each) for each in made.flux(magnetising.real, magnetising.imag)))
        magnetising = current - lost * 1j * flux
    without = complex(*(float(each) for each in made.flux(current.real, current.imag)))
    assert torques[0] == pytest.approx(6.0 * (without.conjugate() * current).imag, rel=1e-6)
    assert torques[1] == pytest.approx(6.0 * (flux.conjugate() * magnetising).imag, rel=1e-6)
    assert torques[1] < torques[0]


# Magnets


def test_magnets_follow_the_winding_behind_it(lab: Any) -> None:
    magnets = Magnets(time_constant=100.0, winding_share=0.5)
    given = on_map(lab, magnets=magnets, thermal_time_constant=1e9, iron=Iron())
    world = turned(lab, given, 100.0)
    world.attach_voltage_probe(1, "A", "star")
    world.set_winding_temperature(125.0)
    start = world.clock.now()
    for after in (50.0, 200.0, 1000.0):
        world.clock.sleep(after - (world.clock.now() - start))
        warm = 25.0 + 0.5 * 100.0 * -math.expm1(-after / 100.0)
        assert world.truth()["magnet_temperature"] == pytest.approx(warm, abs=0.02)
        times = world.clock.now() - np.linspace(0.0, 0.05, 4001)
        largest = float(world.probe_signal(1, times).max())
        omega = 4 * 100.0
        # The circuit takes a new magnet temperature every hundredth of the time constant.
        assert largest / omega == pytest.approx(given.flux_linkage_y * (1.0 - 0.001 * (warm - 25.0)), rel=6e-4)


@pytest.mark.slow
def test_magnets_are_warmed_by_the_iron(lab: Any) -> None:
    given = by_constants(lab, magnets=Magnets(time_constant=50.0, thermal_resistance=20.0))
    world = turned(lab, given, 300.0)
    loss = expected_brake(given, 300.0, given.flux_linkage_y) * 300.0
    world.clock.sleep(600.0)
    # Warmer magnets link less flux, and the iron loses less.
    rise = world.truth()["magnet_temperature"] - 25.0
    assert rise == pytest.approx(20.0 * loss * (1.0 - 0.001 * rise) ** 2, rel=0.01)
    assert rise > 1.0


def test_magnets_without_a_time_constant_are_as_warm_as_the_winding(lab: Any) -> None:
    world = turned(lab, on_map(lab), 50.0)
    world.set_winding_temperature(80.0)
    assert world.truth()["magnet_temperature"] == 80.0


def test_weaker_magnets_are_another_d_current_on_the_map(lab: Any) -> None:
    given = on_map(lab, iron=Iron())
    hot = MappedWindings(given, 25.0, 125.0)
    made = MADE.map(120.0, 31)
    assert hot.law.at(0.0, 0.0)[0] == pytest.approx(0.9 * made.flux_linkage, rel=1e-12)
    shift = made.currents(0.9 * made.flux_linkage, 0.0)[0]
    assert hot.law.at(7.0, 30.0) == pytest.approx(made.at(7.0 + float(shift), 30.0), rel=1e-9)


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"magnets": {"time_constant": 0.0}}, "time_constant is 0.0"),
        ({"magnets": {"winding_share": 1.5}}, "winding_share is 1.5"),
        ({"magnets": {"thermal_resistance": -1.0}}, "thermal_resistance is -1.0"),
        ({"iron": {"hysteresis_loss": -1.0}}, "hysteresis_loss is -1.0"),
        ({"iron": {"eddy_loss": math.inf}}, "eddy_loss is inf"),
        ({"iron": {"eddy_loss": 0.1, "emf_corner": 100.0}}, "not simulated with a flux map or with the iron's loss"),
    ],
)
def test_what_cannot_be(lab: Any, changes: Any, sentence: str) -> None:
    with pytest.raises(ValueError, match=sentence):
        by_constants(
            lab,
            **{name: (Magnets if name == "magnets" else Iron)(**values) for name, values in changes.items()},
        )


def test_a_map_holds_its_saturation(lab: Any) -> None:
    with pytest.raises(ValueError, match="flux map holds its saturation"):
        on_map(lab, d_axis_saturation_current=50.0)


@pytest.mark.parametrize("voltage", [0.3, pytest.param(1.5, marks=pytest.mark.slow)])
def test_a_free_rotor_comes_to_rest_under_hysteresis_while_the_current_decays(lab: Any, voltage: float) -> None:
    # The flux, and with it the hysteresis, falls with the current: the rotor must stand or move, and not both in turn.
    world, clock = lab.ideal_world(on_map(lab), initial_angle=0.1)
    lab.energise(world, voltage, 100.0, lab.series_parallel)
    clock.sleep(2.0)
    assert world.shaft_speed(0.0) == 0.0
    world.supply.switch(False)
    clock.sleep(1.0)
    assert world.supply.current() == 0.0
    assert world.shaft_speed(0.0) == 0.0
    assert len(world._timeline._past) < 40
