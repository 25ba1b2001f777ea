"""The inverter with d and q current at the rotor's own angle: currents, torque, and the voltages of its loop."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.circuits.bridge_error import BridgeError
from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage, Leads
from sim_instruments.world.sources.inverter_output import RotorState
from sim_instruments.world.world import World
from tests.sim_instruments.motors import BENCH_MOTOR

WIRED = {"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"}
IDEAL = InverterStage(current_ripple=0.0)
REAL = InverterStage(
    current_ripple=0.0, dead_time=2.0e-6, device_drop=0.4, device_resistance=0.02, knee_current=0.8, dc_voltage=60.0
)


def driven(
    current: complex, speed: float = 100.0, motor: Any = BENCH_MOTOR, **world: Any
) -> tuple[World, VirtualClock]:
    """A bench whose dynamometer turns the shaft (rad/s) while the currents flow."""
    clock = VirtualClock()
    made = World(motor, clock, **{"inverter": IDEAL, "leads": Leads(resistance=0.0), **world})
    made.connect(WIRED)
    made.couple_dynamometer()
    made.dynamometer.command(speed)
    made.dynamometer.enable(True)
    clock.sleep(3.0)
    made.inverter.set_mode("dq")
    made.inverter.command_dq_current(current)
    made.inverter.enable(True)
    clock.sleep(0.1)
    return made, clock


def equations(state: RotorState, current: complex, motor: VirtualMotor = BENCH_MOTOR) -> complex:
    """u = R·i + jω·(λ + Ld·id + j·Lq·iq), at 25 °C."""
    flux = complex(
        motor.flux_linkage_y + motor.d_axis_inductance_y * current.real, motor.q_axis_inductance_y * current.imag
    )
    return motor.stator_resistance_y * current + 1j * state.electrical_speed * flux


@pytest.mark.parametrize("current", [0j, -3 + 5j, 4 - 2j, 6j, -6 + 0j])
@pytest.mark.parametrize("speed", [100.0, -60.0])
def test_voltages_are_those_of_the_motor_and_torque_is_that_of_its_flux(current: complex, speed: float) -> None:
    world, _ = driven(current, speed)
    state = world.inverter.rotor_state()
    assert state.current == pytest.approx(current, rel=1e-12)
    # A tenth of a second warms the winding by a hundredth of a degree.
    assert state.voltage == pytest.approx(equations(state, current), rel=2e-4, abs=1e-9)
    reluctance = (BENCH_MOTOR.d_axis_inductance - BENCH_MOTOR.q_axis_inductance) * current.real
    torque = 1.5 * BENCH_MOTOR.pole_pairs * (BENCH_MOTOR.flux_linkage + reluctance) * current.imag
    assert world.truth()["motor_torque"] == pytest.approx(torque, rel=1e-9, abs=1e-9)
    assert not state.limited


def test_the_terminals_bear_these_voltages_and_currents(lab: Any) -> None:
    world, clock = driven(-3 + 5j, motor=lab.outrunner())
    for channel, terminal in enumerate("ABC", 1):
        world.attach_voltage_probe(channel, terminal, "star")
    world.attach_current_probe(4, "A")
    clock.sleep(0.2)
    state = world.inverter.rotor_state()
    period = 2.0 * math.pi / abs(state.electrical_speed)
    times = clock.now() - np.linspace(0.0, 2.0 * period, 2001)[:-1]
    angles = state.electrical_angle - state.electrical_speed * (clock.now() - times)
    terminals = np.array([world.probe_signal(channel, times) for channel in (1, 2, 3)])
    axes = np.exp(1j * np.arange(3)[:, np.newaxis] * 2.0 * math.pi / 3.0)
    found = (2.0 / 3.0) * np.mean(np.sum(terminals * axes, axis=0) * np.exp(-1j * angles))
    assert complex(found) == pytest.approx(state.voltage, rel=2e-3)
    assert world.probe_signal(4, times) == pytest.approx(np.real((-3 + 5j) * np.exp(1j * angles)), abs=0.02)


def lost_by_legs(amplitude: float, stage: InverterStage) -> float:
    """The fundamental of what legs with sinusoidal currents lose, by a sum over a period."""
    angles = (np.arange(4096) + 0.5) * 2.0 * math.pi / 4096
    currents = amplitude * np.cos(angles)
    step = stage.dead_time * stage.switching_frequency * stage.dc_voltage + stage.device_drop
    lost = step * np.clip(currents / stage.knee_current, -1.0, 1.0) + stage.device_resistance * currents
    return float(2.0 * np.mean(lost * np.cos(angles)))


@pytest.mark.parametrize("current", [0.3j, -3 + 5j, 0.5 - 0.2j, 8 + 0j])
def test_dead_time_and_drops_are_commanded_on_top_along_the_current(current: complex) -> None:
    world, _ = driven(current, inverter=REAL)
    state = world.inverter.rotor_state()
    more = lost_by_legs(abs(current), REAL) * current / abs(current)
    assert state.voltage == pytest.approx(equations(state, current) + more, rel=2e-4)


def test_a_standing_rotor_has_each_legs_own_loss() -> None:
    world, clock = driven(2 + 1j, inverter=REAL, initial_angle=0.1)
    world.dynamometer.command(0.0)
    clock.sleep(3.0)
    state = world.inverter.rotor_state()
    assert state.electrical_speed == 0.0
    phases = [(state.current * np.exp(1j * (state.electrical_angle - k * 2.0943951023931953))).real for k in range(3)]
    step = REAL.dead_time * REAL.switching_frequency * REAL.dc_voltage + REAL.device_drop
    legs = [
        0.5 * one + step * max(-1.0, min(1.0, one / REAL.knee_current)) + REAL.device_resistance * one for one in phases
    ]
    stator = (2.0 / 3.0) * sum(leg * np.exp(1j * k * 2.0943951023931953) for k, leg in enumerate(legs))
    assert state.voltage == pytest.approx(complex(stator * np.exp(-1j * state.electrical_angle)), rel=1e-3)


@settings(deadline=None, max_examples=25)
@given(st.floats(0.0, 5.0), st.just(0.0) | st.floats(1e-3, 3.0), st.floats(0.0, 0.2), st.floats(1e-3, 20.0))
def test_the_fundamental_is_that_of_the_legs(step: float, knee: float, resistance: float, amplitude: float) -> None:
    error = BridgeError(step, knee, resistance)
    angles = (np.arange(20_000) + 0.5) * 2.0 * math.pi / 20_000
    lost = 2.0 * np.mean(error.of_legs(amplitude * np.cos(angles)) * np.cos(angles))
    assert float(error.fundamental(np.array([amplitude]))[0]) == pytest.approx(float(lost), rel=1e-3, abs=1e-6)


@pytest.mark.parametrize("stage", [IDEAL, REAL])
@pytest.mark.parametrize("speed", [330.0, -400.0, 620.0])
def test_the_voltage_circle_bounds_the_currents_and_says_so(stage: InverterStage, speed: float) -> None:
    world, _ = driven(-2 + math.copysign(8.0, speed) * 1j, speed, inverter=stage)
    state = world.inverter.rotor_state()
    assert state.limited
    assert abs(state.voltage) == pytest.approx(stage.maximum_phase_voltage, rel=1e-6)
    more = 0j if stage is IDEAL else lost_by_legs(abs(state.current), REAL) * state.current / abs(state.current)
    assert state.voltage == pytest.approx(equations(state, state.current) + more, rel=1e-3)
    # The d current is held for as long as a q current allows it.
    if abs(speed) < 350.0:
        assert state.current.real == pytest.approx(-2.0, rel=1e-9)
        assert 0.0 < state.current.imag < 8.0


def test_a_field_weakening_current_reaches_a_speed_that_none_without_does() -> None:
    slow, _ = driven(0j, 400.0)
    weak, _ = driven(-8 + 0j, 400.0)
    assert slow.inverter.rotor_state().limited
    assert not weak.inverter.rotor_state().limited


def test_a_free_shaft_is_turned_by_the_torque_up_to_where_the_voltage_ends() -> None:
    clock = VirtualClock()
    world = World(BENCH_MOTOR, clock, inverter=IDEAL)
    world.connect(WIRED)
    world.inverter.set_mode("dq")
    world.inverter.command_dq_current(-1 + 2j)
    world.inverter.enable(True)
    clock.sleep(0.01)
    torque = 1.5 * 4 * (0.02 + 0.5e-3) * 2.0
    assert world.truth()["shaft_speed"] == pytest.approx((torque - 0.01) / 1.0e-4 * 0.01, rel=0.01)
    clock.sleep(5.0)
    state = world.inverter.rotor_state()
    assert state.limited
    assert abs(state.voltage) < IDEAL.maximum_phase_voltage * 1.001
    # Held there by the friction's torque.
    friction = 0.01 + 1.0e-5 * state.speed
    assert world.truth()["motor_torque"] == pytest.approx(friction, rel=1e-3)
    world.inverter.command_dq_current(-1 + 0j)
    clock.sleep(30.0)
    assert world.truth()["shaft_speed"] == 0.0


@pytest.mark.parametrize("further", [0j, 2j])
def test_a_shaft_beyond_the_voltage_is_braked_and_comes_back_to_its_dynamometer(further: complex) -> None:
    """Field weakening lets a light motor run away from a weak dynamometer; without it the currents that flow then brake."""
    weak = DynamometerMachine(inertia=1.0e-6, maximum_torque=0.1)
    world, clock = driven(-20 + 6j, 100.0, replace(BENCH_MOTOR, inertia=1.0e-6), dynamometer=weak)
    clock.sleep(0.2)
    fastest = world.truth()["shaft_speed"]
    assert fastest > 400.0
    world.inverter.command_dq_current(further)
    speeds = [fastest]
    for _ in range(4):
        clock.sleep(0.05)
        speeds.append(world.truth()["shaft_speed"])
    assert max(speeds) <= fastest * (1.0 + 1e-9)
    assert speeds[-1] < 0.95 * fastest
    if not further:
        # No torque of the motor is left, and the dynamometer holds its speed again.
        clock.sleep(3.0)
        assert world.truth()["shaft_speed"] == pytest.approx(100.0, rel=1e-3)


def test_what_sensors_do_not_see_stands_still_in_the_stator() -> None:
    world, clock = driven(5j)
    world.attach_current_probe(4, "A")
    world.inverter.command_dq_current(5j, offset=0.3 - 0.1j)
    clock.sleep(0.5)
    state = world.inverter.rotor_state()
    times = clock.now() - np.linspace(0.0, 10.0 * 2.0 * math.pi / state.electrical_speed, 4001)[:-1]
    assert float(np.mean(world.probe_signal(4, times))) == pytest.approx(0.3, abs=2e-3)


def test_a_map_takes_the_constants_place() -> None:
    grid = np.linspace(-20.0, 20.0, 21)
    d, q = (part.ravel() for part in np.meshgrid(grid, grid, indexing="ij"))
    # From one energy, so that the axes see each other: ψ = ∂W/∂i.
    size = np.sqrt(1.0 + (d / 15.0) ** 2 + (q / 10.0) ** 2)
    bowl = FluxMap.from_points(d, q, 0.02 + 1.0e-3 * d / size, 2.0e-3 * q / size)
    motor = VirtualMotor(
        connection="wye",
        phase_resistances=(0.5, 0.5, 0.5),
        d_axis_inductance=1.0e-3,
        q_axis_inductance=2.0e-3,
        flux_linkage=0.02,
        pole_pairs=4,
        inertia=1.0e-4,
        flux_map=bowl,
    )
    world, _ = driven(-4 + 8j, motor=motor)
    state = world.inverter.rotor_state()
    d_flux, q_flux = (float(part) for part in bowl.flux(-4.0, 8.0))
    flux = complex(d_flux, q_flux)
    assert state.voltage == pytest.approx(0.5 * (-4 + 8j) + 1j * state.electrical_speed * flux, rel=1e-3)
    torque = 1.5 * 4 * (flux.conjugate() * (-4 + 8j)).imag
    assert world.truth()["motor_torque"] == pytest.approx(torque, rel=1e-6)
