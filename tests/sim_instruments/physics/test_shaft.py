"""Hand, dynamometer and coasting: motion, torque and the EMF that goes with it."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.motion.motion import Drag, Wavering
from sim_instruments.world.machine_data import DynamometerMachine
from sim_instruments.world.world import World

MACHINE = DynamometerMachine(inertia=1e-4, coulomb_friction=0.01, viscous_friction=2e-5, speed_ripple=0.0)


@pytest.fixture
def coupled(lab: Any) -> tuple[World, VirtualClock]:
    clock = VirtualClock()
    world = World(lab.lg_400w(), clock, dynamometer=MACHINE)
    world.couple_dynamometer()
    return world, clock


def test_speed_mode_ramps_then_holds(coupled: tuple[World, VirtualClock]) -> None:
    world, clock = coupled
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    clock.sleep(0.1)
    assert world.dynamometer.speed() == pytest.approx(50.0)
    # J·α and the friction of both machines.
    assert world.dynamometer.torque() == pytest.approx(1.25e-4 * 500 + 0.03 + 4e-5 * 50)
    clock.sleep(0.9)
    assert world.dynamometer.speed(0.1) == pytest.approx(100.0)
    assert world.dynamometer.torque(0.1) == pytest.approx(0.03 + 4e-5 * 100)
    assert world.shaft_speed(1.0) == pytest.approx(90.0)
    world.dynamometer.command(-100.0)
    clock.sleep(0.4)
    assert world.dynamometer.speed(0.4) == pytest.approx(0.0, abs=1e-9)
    assert world.shaft_speed(0.4) == pytest.approx(50.0)
    clock.sleep(0.5)
    assert world.dynamometer.torque(0.1) == pytest.approx(-0.034)


def test_ripple_is_once_a_turn_and_starts_without_a_step(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(), clock, dynamometer=DynamometerMachine(speed_ripple=1e-3))
    world.couple_dynamometer()
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    clock.sleep(1.0)
    assert world.dynamometer.speed() == pytest.approx(100.0, rel=2e-3)
    times = np.linspace(0.2, 0.9, 5000)
    speed = world._timeline.sample(lambda segment, at: segment.motion.speed(at), times)
    assert np.ptp(speed) == pytest.approx(0.2, rel=1e-2)
    assert np.allclose(speed, 100.0 * (1 + 1e-3 * np.sin(100.0 * (times - 0.2))), atol=1e-6)


def test_torque_mode_and_coasting_against_integration(coupled: tuple[World, VirtualClock]) -> None:
    world, clock = coupled
    world.dynamometer.enable(True)
    world.dynamometer.set_mode("torque")
    world.dynamometer.command(0.08)

    def slopes(torque: float) -> Any:
        return lambda _, y: [y[1], (torque - 0.03 * np.sign(y[1]) - 4e-5 * y[1]) / 1.25e-4]

    up = solve_ivp(slopes(0.08), (0.0, 1.5), [0.0, 1e-12], rtol=1e-10, atol=1e-10)
    clock.sleep(1.5)
    assert world.dynamometer.speed() == pytest.approx(up.y[1, -1], rel=1e-7)
    assert world.dial_angle() == pytest.approx(up.y[0, -1], rel=1e-7)
    assert world.dynamometer.torque(0.5) == pytest.approx(0.08)
    world.dynamometer.enable(False)
    down = solve_ivp(slopes(0.0), (0.0, 1.0), up.y[:, -1], rtol=1e-10, atol=1e-10)
    clock.sleep(1.0)
    assert world.dynamometer.speed() == pytest.approx(down.y[1, -1], rel=1e-7)
    assert world.dynamometer.torque(0.5) == 0.0
    clock.sleep(60.0)
    assert world.dynamometer.speed() == 0.0
    stands = world.dial_angle()
    clock.sleep(60.0)
    assert world.dial_angle() == stands


def test_static_friction_holds_and_opposing_torque_reverses(coupled: tuple[World, VirtualClock]) -> None:
    world, clock = coupled
    world.dynamometer.enable(True)
    world.dynamometer.set_mode("torque")
    world.dynamometer.command(0.029)
    clock.sleep(5.0)
    assert world.dial_angle() == 0.0
    world.dynamometer.command(0.06)
    clock.sleep(0.5)
    assert world.dynamometer.speed() > 0.0
    world.dynamometer.command(-0.06)
    clock.sleep(2.0)
    assert world.dynamometer.speed() < 0.0
    world.dynamometer.command(1.0)
    clock.sleep(10.0)
    assert world.dynamometer.speed() == pytest.approx(MACHINE.maximum_speed)
    assert world.dynamometer.torque(0.1) == pytest.approx(0.03 + 4e-5 * MACHINE.maximum_speed)


@settings(max_examples=25)
@given(
    speed=st.floats(-500.0, 500.0),
    torque=st.floats(-1.0, 1.0),
    inertia=st.floats(1e-6, 1e-1),
    viscous=st.one_of(st.just(0.0), st.floats(1e-9, 1e-2)),
    passed=st.floats(1e-6, 10.0),
)
def test_drag_obeys_its_own_equation(
    speed: float, torque: float, inertia: float, viscous: float, passed: float
) -> None:
    motion = Drag(3.0, 0.5, speed, torque, inertia, viscous)
    at = np.array([3.0, 3.0 + passed])
    seen, acceleration, angle = motion.speed(at), motion.acceleration(at), motion.angle(at)
    assert np.allclose(
        inertia * acceleration, torque - viscous * seen, rtol=1e-6, atol=1e-9 * (abs(torque) + viscous * abs(speed) + 1)
    )
    # The momentum balance over the whole way.
    balance = torque * passed - viscous * (angle[1] - angle[0]) - inertia * (seen[1] - seen[0])
    assert abs(balance) <= 1e-7 * (abs(torque) * passed + inertia * abs(speed) + viscous * abs(speed) * passed) + 1e-15
    reached = motion.time_of_speed(float(seen[1]))
    if math.isfinite(reached) and abs(acceleration[1]) > 1e-6 * abs(acceleration[0]) > 0.0:
        assert motion.speed(np.array([reached]))[0] == pytest.approx(seen[1], rel=1e-6, abs=1e-9)


def test_wavering_speed_is_the_slope_of_its_angle() -> None:
    motion = Wavering(1.0, 0.3, 2.0, 0.4, 5.0, 0.7)
    times = np.linspace(1.0, 5.0, 50)
    slope = (motion.angle(times + 1e-6) - motion.angle(times - 1e-6)) / 2e-6
    assert np.allclose(slope, motion.speed(times), atol=1e-8)


def test_emf_of_an_open_wye_with_harmonics(lab: Any) -> None:
    harmonics = ((3, 0.1, 0.2), (5, 0.03, -0.4))
    clock = VirtualClock()
    world = World(lab.lg_400w(flux_harmonics=harmonics), clock, dynamometer=MACHINE, star_point_accessible=True)
    world.couple_dynamometer()
    world.attach_voltage_probe(1, "A", "N")
    world.attach_voltage_probe(2, "A", "star")
    world.attach_voltage_probe(3, "A", "B")
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    clock.sleep(2.0)
    times = np.linspace(1.0, 1.5, 4000)
    theta = 4 * (0.5 * 500 * 0.2**2 + 100.0 * (times - 0.2))

    def emf(angle: np.ndarray) -> np.ndarray:
        return -400 * 8.5e-3 * (np.sin(angle) + sum(a * np.sin(h * angle + phase) for h, a, phase in harmonics))

    a, b, c = (emf(theta - k * 2 * math.pi / 3) for k in range(3))
    assert np.allclose(world.probe_signal(1, times), a, atol=1e-9)
    assert np.allclose(world.probe_signal(2, times), a - (a + b + c) / 3, atol=1e-9)
    assert np.allclose(world.probe_signal(3, times), a - b, atol=1e-9)


def test_triple_harmonics_of_a_delta_stay_inside(lab: Any) -> None:
    motor = lab.outrunner(phase_resistances=(0.15,) * 3, flux_harmonics=((3, 0.2, 0.0),))
    clock = VirtualClock()
    world = World(motor, clock, dynamometer=MACHINE)
    world.couple_dynamometer()
    world.attach_voltage_probe(1, "A", "B")
    world.attach_voltage_probe(2, "A", "star")
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    clock.sleep(1.0)
    times = np.linspace(0.5, 0.9, 20001)
    theta = 7 * (10.0 + 100.0 * (times - 0.2))
    assert np.allclose(world.probe_signal(1, times), -700 * 5e-3 * np.sin(theta), atol=1e-9)
    assert world.probe_signal(2, times).max() == pytest.approx(700 * motor.flux_linkage_y, rel=1e-4)
    # What circulates is the third harmonic's EMF over resistance and zero-sequence reactance, and brakes the shaft.
    circulating = 0.2 * 700 * 5e-3 / math.hypot(0.15, 3 * 700 * motor.winding_zero_sequence_inductance)
    loss = 3 * 0.15 * circulating**2 / 2
    seen = world.dynamometer.torque(20 * math.pi / 700) - (0.015 + 3e-5 * 100)
    assert seen == pytest.approx(loss / 100.0, rel=1e-3)


def test_turning_by_hand(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(), clock, seed=5)
    world.turn_shaft(0.2, wobble=0.5)
    clock.sleep(20.0)
    assert world.dial_angle() == pytest.approx(4.0, rel=0.02)
    assert world.shaft_speed(20.0) == pytest.approx(world.dial_angle() / 20.0)
    world.hold_shaft()
    held = world.dial_angle()
    clock.sleep(1.0)
    assert world.dial_angle() == held
    world.turn_shaft(50.0)
    clock.sleep(0.5)
    world.let_go()
    clock.sleep(10.0)
    # Coasting from 50 rad/s against dry and viscous friction.
    tau = 2.5e-5 / 2e-5
    way = tau * (50.0 - 1000.0 * math.log(1.0 + 50.0 / 1000.0))
    assert world.dial_angle() - held == pytest.approx(25.0 + way, rel=1e-6)
    with pytest.raises(ValueError, match="wobble"):
        world.turn_shaft(1.0, wobble=1.5)


def test_same_seed_same_wobble(lab: Any) -> None:
    angles = []
    for seed in (1, 1, 2):
        clock = VirtualClock()
        world = World(lab.lg_400w(), clock, seed=seed)
        world.turn_shaft(1.0, wobble=0.5)
        clock.sleep(0.3)
        angles.append(world.dial_angle())
    assert angles[0] == angles[1] != angles[2]


def test_a_stuck_rotor_stays_and_the_drive_pushes(coupled: tuple[World, VirtualClock]) -> None:
    world, clock = coupled
    world.set_stuck_rotor(True)
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    clock.sleep(2.0)
    assert world.dial_angle() == 0.0
    assert world.dynamometer.torque(0.1) == pytest.approx(MACHINE.maximum_torque)


def test_coupling_and_hands_are_kept_off_a_turning_shaft(coupled: tuple[World, VirtualClock]) -> None:
    world, clock = coupled
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    clock.sleep(1.0)
    with pytest.raises(RuntimeError, match="stop it"):
        world.uncouple_dynamometer()
    with pytest.raises(RuntimeError, match="disable it"):
        world.hold_shaft()
    with pytest.raises(ValueError, match="allowed are 'speed' and 'torque'"):
        world.dynamometer.set_mode("position")  # type: ignore[arg-type]
