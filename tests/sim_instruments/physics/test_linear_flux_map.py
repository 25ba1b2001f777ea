"""A flux map that is a plane is the motor of its constants, in every circuit of the bench."""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.world import World

REACH = 80.0
Motors = Callable[[Any], VirtualMotor]


def wye(lab: Any) -> VirtualMotor:
    made: VirtualMotor = lab.lg_400w(
        phase_resistances=(16.3e-3, 15.1e-3, 17.0e-3),
        q_axis_inductance=120e-6,
        flux_harmonics=((5, 0.03, 0.2), (7, 0.01, 0.0)),
        emf_shares=(1.0, 0.95, 1.0),
        turn_shares=(1.0, 1.0, 0.97),
        cogging_torque=0.01,
        thermal_resistance=0.0,
    )
    return made


def delta(lab: Any) -> VirtualMotor:
    made: VirtualMotor = lab.outrunner(flux_harmonics=((3, 0.05, 0.0), (5, 0.03, 0.2)), thermal_resistance=0.0)
    return made


def mapped(motor: VirtualMotor) -> VirtualMotor:
    """Return the motor on the plane through its constants, those of the Y-equivalent."""
    axis = np.linspace(-REACH, REACH, 5)
    d, q = (each.ravel() for each in np.meshgrid(axis, axis, indexing="ij"))
    d_flux, q_flux = motor.flux_linkage_y + motor.d_axis_inductance_y * d, motor.q_axis_inductance_y * q
    return replace(motor, flux_map=FluxMap.from_points(d, q, d_flux, q_flux))


both = pytest.mark.parametrize("motor", [wye, delta])


def worlds(lab: Any, motor: Motors, **more: Any) -> list[World]:
    given = motor(lab)
    return [lab.ideal_world(one, **more)[0] for one in (given, mapped(given))]


def signals(world: World, times: np.ndarray) -> np.ndarray:
    """Return the terminals' currents and two voltages against each other."""
    for channel, terminal in enumerate("ABC", start=1):
        world.attach_current_probe(channel, terminal)  # type: ignore[arg-type]
    world.attach_voltage_probe(4, "A", "B")
    world.attach_voltage_probe(5, "C", "star")
    return np.array([world.probe_signal(channel, times) for channel in range(1, 6)])


def agree(first: np.ndarray, second: np.ndarray, allowed: float) -> None:
    for one, other in zip(first, second, strict=True):
        # What joined terminals leave between them is nothing beside the EMF's volts.
        assert np.abs(one - other).max() <= allowed * max(float(np.abs(one).max()), 10.0)


def test_the_constants_of_a_plane_are_its_slopes(lab: Any) -> None:
    for motor in (wye(lab), delta(lab)):
        same = mapped(motor)
        assert same.d_axis_inductance == pytest.approx(motor.d_axis_inductance, rel=1e-12)
        assert same.q_axis_inductance == pytest.approx(motor.q_axis_inductance, rel=1e-12)


@both
def test_a_step_on_a_held_rotor(lab: Any, motor: Motors) -> None:
    times = np.linspace(1e-5, 0.05, 200)
    seen = []
    for world in worlds(lab, motor, initial_angle=0.13):
        world.lock_rotor()
        lab.energise(world, 0.5, 100.0, {"A": "supply+", "B": "supply-"})
        world.clock.sleep(0.05)
        seen.append(signals(world, times))
    agree(seen[0], seen[1], 1e-6)


@both
@pytest.mark.parametrize("limit", [100.0, 3.0])
def test_a_free_rotor_swings(lab: Any, motor: Motors, limit: float) -> None:
    times, seen = np.linspace(1e-5, 0.2, 400), []
    for world in worlds(lab, motor, initial_angle=0.13):
        lab.energise(world, 0.15, limit, lab.series_parallel)
        world.clock.sleep(0.2)
        seen.append(np.vstack([signals(world, times), [world.dial_angle()] * len(times)]))
    agree(seen[0], seen[1], 2e-4)


@both
def test_the_bridge(lab: Any, motor: Motors) -> None:
    for angle in (0.0, 0.1, 0.3):
        readings = []
        for world in worlds(lab, motor, initial_angle=angle):
            world.connect({"A": "lcr_high", "B": "lcr_low", "C": "lcr_low"})
            world.lock_rotor()
            world.clock.sleep(1.0)
            readings.append(world.impedance(1000.0, 1.0, 0.1))
        assert readings[1] == pytest.approx(readings[0], rel=1e-9)


@both
@pytest.mark.parametrize("wiring", [{}, {"A": "link", "B": "link"}, {"A": "link", "B": "link", "C": "link"}])
def test_a_turning_rotor(lab: Any, motor: Motors, wiring: Any) -> None:
    seen, torques = [], []
    for world in worlds(lab, motor):
        world.connect(wiring)
        world.couple_dynamometer()
        world.dynamometer.set_mode("speed")
        world.dynamometer.enable(True)
        world.dynamometer.command(90.0)
        world.clock.sleep(3.0)
        now = world.clock.now()
        seen.append(signals(world, now - np.linspace(0.0, 0.02, 300)))
        torques.append(world.dynamometer.torque(0.5))
    agree(seen[0], seen[1], 2e-5)
    assert torques[1] == pytest.approx(torques[0], rel=1e-5)


@both
def test_a_short_brakes_a_coasting_rotor(lab: Any, motor: Motors) -> None:
    speeds = []
    for world in worlds(lab, motor):
        world.couple_dynamometer()
        world.dynamometer.set_mode("speed")
        world.dynamometer.enable(True)
        world.dynamometer.command(60.0)
        world.clock.sleep(2.0)
        world.connect({"A": "link", "B": "link", "C": "link"})
        world.dynamometer.enable(False)
        course = []
        for _ in range(5):
            world.clock.sleep(0.01)
            course.append(world.shaft_speed(0.0))
        speeds.append(course)
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-4, abs=1e-3)


@both
def test_a_rotating_field_takes_the_rotor_along(lab: Any, motor: Motors) -> None:
    seen = []
    for world in worlds(lab, motor):
        world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        world.inverter.command_amplitude(8.0)
        world.inverter.enable(True)
        world.inverter.command_frequency(20.0)
        world.clock.sleep(3.0)
        now = world.clock.now()
        seen.append(
            np.vstack([signals(world, now - np.linspace(0.0, 0.05, 300)), np.full(300, world.shaft_speed(0.1))])
        )
    agree(seen[0], seen[1], 2e-3)


@both
def test_a_regulated_current_drives_the_rotor(lab: Any, motor: Motors) -> None:
    speeds = []
    for world in worlds(lab, motor):
        world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
        world.inverter.set_mode("current")
        world.inverter.command_q_current(2.0)
        world.inverter.enable(True)
        world.clock.sleep(0.1)
        speeds.append((world.shaft_speed(0.0), world.inverter.q_current()))
    assert speeds[1] == pytest.approx(speeds[0], rel=1e-6)
    assert math.isclose(speeds[0][1], 2.0)
