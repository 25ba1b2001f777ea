"""What circulates in a delta: with open terminals, under the inverter, and while it coasts."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage
from sim_instruments.world.world import World

WIRED = {"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"}
SPEED = 100.0


@pytest.fixture(params=["third harmonic", "weak winding"])
def motor(request: pytest.FixtureRequest, lab: Any) -> VirtualMotor:
    sound = lab.outrunner(phase_resistances=(0.15, 0.15, 0.15), q_axis_inductance=60e-6)
    if request.param == "weak winding":
        return replace(sound, emf_shares=(0.8, 1.0, 1.0))
    return replace(sound, flux_harmonics=((3, 0.1, 0.3), (9, 0.02, 0.0)))


def turned(motor: VirtualMotor, *, inverter: bool, current: float = 0.0) -> tuple[World, np.ndarray]:
    """Return the world of a motor turned by the dynamometer, and times over a turn."""
    clock = VirtualClock()
    world = World(
        motor,
        clock,
        inverter=InverterStage(current_ripple=0.0),
        dynamometer=DynamometerMachine(speed_ripple=0.0),
    )
    world.couple_dynamometer()
    world.connect(WIRED)
    world.dynamometer.set_mode("speed")
    world.dynamometer.command(SPEED)
    world.dynamometer.enable(True)
    clock.sleep(3.0)
    world.truth()
    if inverter:
        world.inverter.set_mode("current")
        world.inverter.command_q_current(current)
        world.inverter.enable(True)
        clock.sleep(0.5)
    world.truth()
    begin = clock.now()
    clock.sleep(2.0 * math.pi / SPEED)
    world.truth()
    return world, np.linspace(begin, clock.now(), 4000, endpoint=False)


def test_the_inverter_leaves_what_the_magnets_drive_round_a_delta(motor: VirtualMotor) -> None:
    rms = []
    for inverter in (False, True):
        world, times = turned(motor, inverter=inverter)
        segment = world._timeline.present
        rms.append(np.sqrt(np.mean(segment.winding_currents(times) ** 2, axis=1)))
        assert np.abs(segment.terminal_currents(times)).max() < 1e-9
        assert np.abs(segment.circuit.drops(times).sum(axis=0)).max() < 1e-9
    assert rms[0].min() > 0.1
    assert rms[1] == pytest.approx(rms[0], rel=1e-4)


def test_unlike_windings_share_a_current_by_kirchhoff(lab: Any) -> None:
    """Round the delta the voltages add up to nothing, whatever the windings are, and the shaft feels what flows."""
    motor = lab.outrunner(phase_resistances=(0.15, 0.45, 0.15), q_axis_inductance=60e-6)
    world, times = turned(motor, inverter=True, current=5.0)
    segment = world._timeline.present
    drops = segment.circuit.drops(times)
    assert np.abs(drops.sum(axis=0)).max() < 1e-9 * np.abs(drops).max()
    sizes = np.sqrt(np.mean(segment.winding_currents(times) ** 2, axis=1))
    assert sizes[1] < 0.95 * sizes[0]


def test_a_coasting_delta_is_braked_by_its_circulating_current(motor: VirtualMotor) -> None:
    """What the shaft loses beyond friction is the heat of the current that circulates."""
    rates = []
    for one in (motor, replace(motor, flux_harmonics=(), emf_shares=(1.0, 1.0, 1.0))):
        world, times = turned(one, inverter=False)
        heat = float(np.mean(world._timeline.present.copper_loss(times)))
        clock = world._timeline._clock
        world.dynamometer.enable(False)
        world.truth()
        first = clock.now()
        clock.sleep(0.01)
        world.truth()
        speed, slope = (
            float(getattr(world._timeline.present.motion, of)(np.array([first + 1e-3]))[0])
            for of in ("speed", "acceleration")
        )
        rates.append((slope, heat / speed))
    inertia = motor.inertia + DynamometerMachine().inertia
    (braked, torque), (plain, nothing) = rates
    assert nothing < 1e-9
    assert inertia * (plain - braked) == pytest.approx(torque, rel=0.02)
