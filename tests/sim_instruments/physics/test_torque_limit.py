"""A dynamometer that is to hold a speed against more than its machine gives."""

import math
from typing import Any

import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage
from sim_instruments.world.world import World

MOST = 0.3
WIRED = {"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"}
SPEED = 100.0


def held(motor: Any, current: float) -> tuple[World, VirtualClock]:
    clock = VirtualClock()
    world = World(
        motor, clock, inverter=InverterStage(current_ripple=0.0), dynamometer=DynamometerMachine(maximum_torque=MOST)
    )
    world.connect(WIRED)
    world.couple_dynamometer()
    world.dynamometer.set_mode("speed")
    world.dynamometer.command(SPEED)
    world.dynamometer.enable(True)
    clock.sleep(2.0)
    assert world.dynamometer.speed(0.1) == pytest.approx(SPEED, rel=1e-3)
    world.inverter.set_mode("current")
    world.inverter.command_q_current(current)
    world.inverter.enable(True)
    return world, clock


@pytest.mark.parametrize("way", [-1.0, 1.0])
def test_beyond_it_the_speed_gives_way_and_the_torque_is_the_limit(lab: Any, way: float) -> None:
    motor = lab.lg_400w(coulomb_friction=0.0, viscous_friction=0.0, cogging_torque=0.0)
    machine = DynamometerMachine(maximum_torque=MOST)
    current = way * 1.3 * MOST / motor.torque_constant
    world, clock = held(motor, current)
    clock.sleep(0.05)
    assert world.dynamometer.torque(0.01) == pytest.approx(-way * MOST, rel=1e-6)
    inertia = motor.inertia + machine.inertia
    drag = machine.coulomb_friction + machine.viscous_friction * SPEED
    expected = SPEED + (way * 0.3 * MOST - drag) / inertia * 0.05
    assert world.truth()["shaft_speed"] == pytest.approx(expected, rel=0.01)


def test_within_it_the_speed_is_held_and_it_comes_back_once_the_load_has_gone(lab: Any) -> None:
    motor = lab.lg_400w(cogging_torque=0.0)
    size = MOST / motor.torque_constant
    world, clock = held(motor, -0.7 * size)
    clock.sleep(1.0)
    assert world.dynamometer.speed(0.1) == pytest.approx(SPEED, rel=1e-3)
    world.inverter.command_q_current(-1.5 * size)
    clock.sleep(0.1)
    assert world.truth()["shaft_speed"] < 0.9 * SPEED
    world.inverter.command_q_current(0.0)
    clock.sleep(1.0)
    assert world.dynamometer.speed(0.1) == pytest.approx(SPEED, rel=1e-3)
    assert abs(world.dynamometer.torque(2.0 * math.pi / SPEED)) < MOST
