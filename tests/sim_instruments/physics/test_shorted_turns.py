"""Shorted turns: what energy, direct current and the bridge say of them, each against an independent reckoning."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.circuits.windings import Windings
from sim_instruments.physics.motor.bearing import Bearing
from sim_instruments.physics.motor.defects import rubbing, shorted_turns, weak_pole
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.motor.shorted_turns import ShortedTurns
from sim_instruments.world.world import World

SHARE = 0.1


@pytest.fixture(params=["wye", "delta"])
def motor(request: pytest.FixtureRequest, lab: Any) -> VirtualMotor:
    return replace(
        lab.lg_400w(), connection=request.param, coulomb_friction=0.0, viscous_friction=0.0, bearing=Bearing()
    )


def driven(motor: VirtualMotor, speed: float) -> tuple[World, VirtualClock]:
    clock = VirtualClock()
    world = World(motor, clock)
    world.couple_dynamometer()
    world.dynamometer.set_mode("speed")
    world.dynamometer.command(speed)
    world.dynamometer.enable(True)
    clock.sleep(5.0)
    world.truth()
    return world, clock


def braking(motor: VirtualMotor, speed: float) -> float:
    """Return the mean torque (N·m) of the motor's currents over some turns at a speed (rad/s)."""
    world, clock = driven(motor, speed)
    begin = clock.now()
    clock.sleep(2.0 * math.pi / speed)
    segment = world._timeline.present
    return float(np.mean(segment.motor_torque(np.linspace(begin, clock.now(), 4000, endpoint=False))))


def test_what_the_shaft_gives_is_the_heat_of_the_loop(motor: VirtualMotor) -> None:
    """A loop of resistance μR and its own inductance, driven by its share of the EMF."""
    speed, p = 100.0, motor.pole_pairs
    plain = replace(motor, flux_harmonics=())
    found = braking(shorted_turns(plain, SHARE), speed)
    b = motor.phase_resistances[1]
    inductance = SHARE**2 * Windings(plain, 25.0).inductance_mean[1, 1] * 1.05
    emf = SHARE * p * speed * motor.flux_linkage
    reactance = p * speed * inductance
    if motor.connection == "wye":
        impedance = complex(SHARE * b, reactance)
        heat = 0.5 * emf**2 * SHARE * b / abs(impedance) ** 2
        assert found == pytest.approx(-heat / speed, rel=1e-3)
    else:
        # The rest of the delta is a path beside it: less than a tenth of a difference at a tenth of the turns.
        assert found == pytest.approx(-0.5 * emf**2 / (SHARE * b) / speed, rel=0.15)


def test_a_coast_is_braked_as_a_drive_is(lab: Any) -> None:
    motor = replace(lab.lg_400w(), flux_harmonics=())
    motor = shorted_turns(motor, SHARE)
    world = World(motor, VirtualClock())
    timeline = world._timeline
    shaft = timeline.constants.coasting_shaft(timeline.settings)
    for speed in (20.0, 300.0):
        assert shaft.bearing.drag(speed) == pytest.approx(-braking(motor, speed), rel=0.01)


def test_direct_current_passes_the_turns_by(motor: VirtualMotor) -> None:
    resistance = 0.5 * SHARE * motor.phase_resistances[1]
    shorted = replace(motor, shorted_turns=ShortedTurns(1, SHARE, resistance))
    a, b, c = motor.phase_resistances
    left = (1.0 - SHARE) * b + SHARE * b * resistance / (SHARE * b + resistance)
    assert shorted.without_short.phase_resistances == pytest.approx((a, left, c))
    between = {"wye": a + left, "delta": a * (left + c) / (a + left + c)}[motor.connection]
    clock = VirtualClock()
    world = World(shorted, clock)
    world.lock_rotor()
    world.connect({"A": "supply+", "B": "supply-"})
    world.attach_voltmeter("A", "B")
    world.supply.set_voltage(1.0)
    world.supply.set_current_limit(1.0)
    world.supply.switch(True)
    clock.sleep(3.0)
    assert world.voltmeter_voltage(0.1) / world.truth()["supply_current"] == pytest.approx(between, rel=1e-6)


def test_the_bridge_sees_a_transformer_with_a_shorted_secondary(lab: Any) -> None:
    motor = lab.lg_400w()
    readings = []
    for made in (motor, shorted_turns(motor, SHARE)):
        clock = VirtualClock()
        world = World(made, clock)
        world.lock_rotor()
        world.connect({"A": "lcr_high", "B": "lcr_low"})
        clock.sleep(1.0)
        readings.append(world.impedance(1e5, 1.0, 0.1))
    whole, shorted = readings
    # So fast that resistances hardly count: L − M²/L_s with M and L_s of the shorted turns.
    angle = 0.0
    matrix = Windings(motor, 25.0).inductance(angle)
    mutual = SHARE * (matrix[1, 1] - matrix[0, 1])
    own = SHARE**2 * matrix[1, 1] + 0.05 * SHARE**2 * Windings(motor, 25.0).inductance_mean[1, 1]
    expected = 1.0 - mutual**2 / own / (matrix[0, 0] + matrix[1, 1] - 2.0 * matrix[0, 1])
    assert shorted.imag / whole.imag == pytest.approx(expected, rel=0.02)


def test_a_reversed_magnet_takes_a_pole_pair_out_and_makes_the_half_waves_differ(lab: Any) -> None:
    motor = replace(lab.lg_400w(), flux_harmonics=())
    reversed_magnet = weak_pole(motor, 2.0)
    assert reversed_magnet.flux_linkage == pytest.approx(motor.flux_linkage * (1.0 - 1.0 / motor.pole_pairs))
    angles = np.linspace(0.0, 2.0 * math.pi, 4000, endpoint=False)
    emf = Windings(reversed_magnet, 25.0).emf_per_speed(angles)[0]
    # The flux of the weak pole is gone while the winding is over it and nearly whole over the other.
    flux = np.cumsum(emf) * (angles[1] - angles[0])
    flux -= flux.mean()
    assert -flux.min() > 1.2 * flux.max()


def test_rubbing_drags_once_a_turn(lab: Any) -> None:
    motor = rubbing(replace(lab.lg_400w(), cogging_torque=0.0), 0.1)
    speed = 20.0
    world, clock = driven(motor, speed)
    begin = clock.now()
    clock.sleep(2.0 * math.pi / speed)
    segment = world._timeline.present
    times = np.linspace(begin, clock.now(), 2000, endpoint=False)
    torque = segment.dynamometer_torque(times)
    machine = world._timeline.constants.dynamometer
    without = (
        motor.coulomb_friction + machine.coulomb_friction + speed * (motor.viscous_friction + machine.viscous_friction)
    )
    assert np.mean(torque) - without == pytest.approx(0.05, rel=0.02)
    assert np.ptp(torque) == pytest.approx(0.1, rel=0.05)
