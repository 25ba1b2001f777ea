"""The inverter: rotating field in and out of step, and regulated torque."""

import math
from typing import Any

import numpy as np
import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.field import Synchronous, q_current_within
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage
from sim_instruments.world.world import World

WIRED = {"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"}
STAGE = InverterStage(current_ripple=0.0)


def running(motor: Any, frequency: float, current: float, seconds: float, **more: Any) -> tuple[World, VirtualClock]:
    clock = VirtualClock()
    world = World(motor, clock, **{"inverter": STAGE, **more})
    world.connect(WIRED)
    world.attach_current_probe(4, "A")
    world.inverter.command_frequency(frequency)
    world.inverter.command_amplitude(current)
    world.inverter.enable(True)
    clock.sleep(seconds)
    return world, clock


def crossings(world: World, clock: VirtualClock, window: float) -> float:
    """Frequency (Hz) of the current probe's signal from its rising zero crossings."""
    times = np.linspace(clock.now() - window, clock.now(), 200_001)
    signal = world.probe_signal(4, times)
    rising = times[1:][(signal[:-1] < 0.0) & (signal[1:] >= 0.0)]
    return float((len(rising) - 1) / (rising[-1] - rising[0]))


@pytest.mark.parametrize("name", ["lg_400w", "outrunner"])
def test_rotor_runs_at_sixty_f_over_p(lab: Any, name: str) -> None:
    motor = getattr(lab, name)()
    world, clock = running(motor, 53.76, 5.0, 5.0)
    assert 60.0 * 53.76 / (world.shaft_speed(1.0) * 60.0 / (2 * math.pi)) == pytest.approx(motor.pole_pairs)
    assert crossings(world, clock, 1.0) == pytest.approx(53.76, rel=1e-4)
    truth = world.truth()
    assert truth["inverter_in_step"]
    # The field carries exactly the friction at that speed.
    friction = motor.coulomb_friction + motor.viscous_friction * truth["shaft_speed"]
    assert truth["motor_torque"] == pytest.approx(friction, rel=2e-3)


def test_ramp_is_gradual_and_direction_follows_the_sign(lab: Any) -> None:
    world, clock = running(lab.lg_400w(), -40.0, 5.0, 1.0)
    assert world.inverter.output_frequency() == pytest.approx(-20.0)
    assert world.truth()["shaft_speed"] == pytest.approx(-20.0 * 2 * math.pi / 4)
    clock.sleep(2.0)
    assert world.inverter.output_frequency() == pytest.approx(-40.0)
    world.inverter.command_frequency(0.0)
    clock.sleep(3.0)
    assert world.truth()["shaft_speed"] == 0.0


def test_swapped_wires_turn_it_backwards(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(), clock)
    world.connect(WIRED)
    world.set_swapped(("B", "C"))
    world.inverter.command_frequency(40.0)
    world.inverter.command_amplitude(5.0)
    world.inverter.enable(True)
    clock.sleep(4.0)
    assert world.truth()["shaft_speed"] == pytest.approx(-20.0 * math.pi)


def test_too_little_current_leaves_the_rotor_standing_while_the_current_keeps_its_frequency(lab: Any) -> None:
    world, clock = running(lab.lg_400w(), 60.0, 0.2, 5.0)
    assert world.shaft_speed(1.0) == 0.0
    assert not world.truth()["inverter_in_step"]
    assert crossings(world, clock, 1.0) == pytest.approx(60.0, rel=1e-4)


def test_viscous_load_pulls_it_out_of_step_on_the_way_up(lab: Any) -> None:
    motor = lab.lg_400w(viscous_friction=1e-3)
    stage = InverterStage(dc_voltage=400.0, current_ripple=0.0)
    # Pull-out of 2 A is 0.102 N·m; friction reaches it near 80 rad/s, that is 50 Hz.
    world, clock = running(motor, 100.0, 2.0, 2.0, inverter=stage)
    assert world.truth()["inverter_in_step"]
    clock.sleep(5.0)
    assert not world.truth()["inverter_in_step"]
    assert world.shaft_speed(0.1) == 0.0


def test_emf_beyond_the_link_loses_control_of_current_and_rotor(lab: Any) -> None:
    motor = lab.lg_400w(d_axis_inductance=2e-3, q_axis_inductance=2e-3)
    world, _ = running(motor, 1000.0, 5.0, 60.0)
    assert world.shaft_speed(1.0) == 0.0
    assert world.inverter.current_amplitude() == pytest.approx(
        48.0 / math.sqrt(3) / math.hypot(16e-3, 2 * math.pi * 1000 * 2e-3), rel=1e-3
    )
    assert world.inverter.current_amplitude() < 5.0


def test_ripple_is_seen_by_the_current_probe(lab: Any) -> None:
    world, clock = running(lab.lg_400w(), 50.0, 4.0, 5.0, inverter=InverterStage(current_ripple=0.02))
    times = clock.now() - np.linspace(0.0, 0.02, 40_001)
    seen = world.probe_signal(4, times)
    smooth = np.fft.rfft(seen[:-1])
    assert 2 * np.abs(smooth[1]) / 40_000 == pytest.approx(4.0, rel=1e-3)
    assert 2 * np.abs(smooth[320]) / 40_000 == pytest.approx(0.08, rel=1e-2)


def test_disabling_lets_it_coast(lab: Any) -> None:
    world, clock = running(lab.lg_400w(), 60.0, 5.0, 5.0)
    before = world.shaft_speed(0.0)
    world.inverter.enable(False)
    clock.sleep(0.02)
    tau = 2.5e-5 / 2e-5
    expected = (before + 1000.0) * math.exp(-0.02 / tau) - 1000.0
    assert world.shaft_speed(0.0) == pytest.approx(expected)
    assert world.inverter.output_frequency() == 0.0
    clock.sleep(10.0)
    assert world.shaft_speed(0.0) == 0.0


def test_q_current_on_a_driven_shaft_makes_its_torque(lab: Any) -> None:
    clock = VirtualClock()
    machine = DynamometerMachine(speed_ripple=0.0)
    world = World(lab.lg_400w(), clock, dynamometer=machine)
    world.connect(WIRED)
    world.couple_dynamometer()
    world.dynamometer.enable(True)
    world.dynamometer.command(100.0)
    world.inverter.set_mode("current")
    world.inverter.enable(True)
    readings = []
    for current in (0.0, 2.0, 4.0, -2.0):
        world.inverter.command_q_current(current)
        clock.sleep(1.0)
        assert world.inverter.q_current() == pytest.approx(current)
        readings.append(world.dynamometer.torque(0.2))
    constant = 1.5 * 4 * 8.5e-3
    assert readings[0] == pytest.approx(0.03 + 4e-5 * 100)
    assert np.diff(readings) == pytest.approx([-2 * constant, -2 * constant, 6 * constant], rel=1e-3)


def test_q_current_runs_a_free_shaft_up_to_where_the_voltage_ends(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(), clock, inverter=STAGE)
    world.connect(WIRED)
    world.inverter.set_mode("current")
    world.inverter.command_q_current(2.0)
    world.inverter.enable(True)
    clock.sleep(0.1)
    # 1.5·p·λ·i − dry friction over J, viscous friction slowing a little.
    tau, final = 2.5e-5 / 2e-5, (0.102 - 0.02) / 2e-5
    assert world.shaft_speed(0.0) == pytest.approx(final * -math.expm1(-0.1 / tau))
    clock.sleep(20.0)
    electrical = world.shaft_speed(0.0) * 4
    needed = math.hypot(16e-3 * 2 + electrical * 8.5e-3, electrical * 76.5e-6 * 2)
    assert needed == pytest.approx(48.0 / math.sqrt(3), rel=1e-3)
    assert world.inverter.q_current() < 2.0
    assert world.truth()["motor_torque"] == pytest.approx(0.02 + 2e-5 * electrical / 4, rel=1e-6)


def test_a_missing_phase_is_a_fault(lab: Any) -> None:
    world, clock = running(lab.lg_400w(), 60.0, 5.0, 5.0)
    world.set_open_phase("B")
    assert world.inverter.fault == "output phase missing"
    assert not world.inverter.enabled
    clock.sleep(10.0)
    assert world.shaft_speed(0.0) == 0.0


def test_a_locked_rotor_sees_the_field_pass(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(), clock, inverter=STAGE)
    world.connect(WIRED)
    world.lock_rotor()
    world.inverter.command_frequency(20.0)
    world.inverter.command_amplitude(3.0)
    world.inverter.enable(True)
    clock.sleep(3.0)
    assert world.dial_angle() == 0.0
    assert world.inverter.output_frequency() == pytest.approx(20.0)


def test_pull_out_of_a_round_rotor_is_the_q_axis_torque() -> None:
    field = Synchronous(0.1, 1e-3, 1e-3, 0.01, 4, 5.0)
    assert field.pull_out_torque == pytest.approx(0.3)
    assert field.load_angle(0.15) == pytest.approx(math.pi / 6, abs=1e-5)
    assert field.load_angle(-0.15) == pytest.approx(-math.pi / 6, abs=1e-5)
    assert field.voltage(0.0, 0.0) == pytest.approx(0.5)


def test_q_current_keeps_within_the_voltage() -> None:
    speeds = np.linspace(-4000.0, 4000.0, 81)
    limits = {"voltage": 20.0, "resistance": 0.1, "inductance": 1e-4, "flux_linkage": 0.008}
    for wanted in (-30.0, 3.0, 30.0):
        current = q_current_within(wanted, speeds, **limits)
        voltage = np.hypot(0.1 * current + speeds * 0.008, speeds * 1e-4 * current)
        flows = current != 0.0
        assert np.all(voltage[flows] <= 20.0 * (1 + 1e-9))
        full = np.hypot(0.1 * wanted + speeds * 0.008, speeds * 1e-4 * wanted) <= 20.0
        assert np.allclose(current[full], wanted)


def test_a_supply_beside_it_comes_to_its_level_and_falls_again(lab: Any) -> None:
    world, clock = running(lab.lg_400w(), 20.0, 5.0, 2.0)
    world.supply.set_voltage(5.0)
    world.supply.switch(True)
    clock.sleep(1.0)
    assert world.supply.voltage() == pytest.approx(5.0)
    # One segment up and one that holds: it does not rise again and again.
    assert clock.now() - world._timeline.present.start > 0.9
    world.supply.switch(False)
    clock.sleep(1.0)
    assert world.supply.voltage() == 0.0
