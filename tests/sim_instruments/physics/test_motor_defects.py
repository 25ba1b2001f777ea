"""What can be wrong inside a motor, and the cogging that a slow turn shows."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.world import World


def peaks(motor: VirtualMotor) -> list[float]:
    """Return the peak EMF (V) of A, B, C against the star at 1 rad/s."""
    clock = VirtualClock()
    world = World(motor, clock, star_point_accessible=True)
    for channel, node in ((1, "A"), (2, "B"), (3, "C")):
        world.attach_voltage_probe(channel, node, "N")  # type: ignore[arg-type]
    world.turn_shaft(1.0)
    clock.sleep(2.0 * math.pi)
    times = np.linspace(0.1, 2.0 * math.pi - 0.1, 4000)
    return [float(np.abs(world.probe_signal(channel, times)).max()) for channel in (1, 2, 3)]


def test_a_weak_phase_has_less_emf(lab: Any) -> None:
    motor = lab.lg_400w()
    whole = motor.flux_linkage * motor.pole_pairs
    assert peaks(replace(motor, emf_shares=(1.0, 0.8, 1.0))) == pytest.approx([whole, 0.8 * whole, whole], rel=1e-4)


def test_even_shares_change_no_bit(lab: Any) -> None:
    assert peaks(lab.lg_400w()) == peaks(replace(lab.lg_400w(), emf_shares=(1.0, 1.0, 1.0)))


def test_exchanged_wires_turn_the_phase_order_round(lab: Any) -> None:
    clock = VirtualClock()
    motor = lab.lg_400w()
    order = {}
    for name, made in (("right", motor), ("wrong", replace(motor, exchanged=("B", "C")))):
        world = World(made, clock)
        world.attach_voltage_probe(1, "A", "star")
        world.attach_voltage_probe(2, "B", "star")
        world.turn_shaft(1.0)
        clock.sleep(7.0)
        times = np.linspace(clock.now() - 6.0, clock.now(), 6000)
        a, b = world.probe_signal(1, times), world.probe_signal(2, times)
        slope = np.gradient(a, times)
        # Of −sin θ, where B lags A by a third of a turn the slope of A is against B.
        order[name] = float(np.sum(slope * b))
    assert order["right"] < 0.0 < order["wrong"]


def test_a_swap_of_wires_outside_puts_exchanged_ones_right_again(lab: Any) -> None:
    world = World(replace(lab.lg_400w(), exchanged=("B", "C")), VirtualClock())
    world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    assert world._timeline.settings.sockets() == ("inverter_u", "inverter_w", "inverter_v")
    world.set_swapped(("B", "C"))
    assert world._timeline.settings.sockets() == ("inverter_u", "inverter_v", "inverter_w")


@pytest.mark.parametrize(
    ("wrong", "said"),
    [
        ({"emf_shares": (1.0, -0.1, 1.0)}, "emf_shares"),
        ({"exchanged": ("B", "B")}, "exchanged"),
        ({"insulation_resistance": 0.0}, "insulation_resistance"),
        ({"frame_capacitance": -1e-9}, "frame_capacitance"),
    ],
)
def test_what_no_motor_has(lab: Any, wrong: dict[str, object], said: str) -> None:
    with pytest.raises(ValueError, match=said):
        lab.lg_400w(**wrong)


def torque_over_a_turn(motor: VirtualMotor, *, fixture: bool) -> tuple[np.ndarray, np.ndarray]:
    """Return angles (rad) and the dynamometer's torque (N·m) at them, turning slowly."""
    clock = VirtualClock()
    world = World(motor, clock, fixture=fixture)
    world.couple_dynamometer()
    world.dynamometer.enable(True)
    world.dynamometer.command(0.5)
    clock.sleep(1.0)
    angles, torques = [], []
    for _ in range(500):
        clock.sleep(2.0 * math.pi / 0.5 / 500)
        angles.append(world.dial_angle())
        torques.append(world.dynamometer.torque())
    return np.array(angles), np.array(torques)


def test_a_slow_turn_shows_the_cogging_by_order_amplitude_and_phase(lab: Any) -> None:
    motor = lab.lg_400w(cogging_torque=0.02, cogging_order=24, cogging_phase=0.7)
    angles, torques = torque_over_a_turn(motor, fixture=True)
    # The machine has to hold against the motor's cogging.
    phasor = 2.0 * np.mean(torques * np.exp(-1j * 24 * angles))
    assert abs(phasor) == pytest.approx(0.02, rel=0.01)
    assert np.angle(phasor) == pytest.approx(0.7 - math.pi / 2.0, abs=0.02)


def test_the_dynamometer_feels_it_whoever_does_the_hand_work(lab: Any) -> None:
    motor = lab.lg_400w(cogging_torque=0.02, cogging_order=24)
    with_fixture, by_hand = (torque_over_a_turn(motor, fixture=fixture)[1] for fixture in (True, False))
    assert np.ptp(by_hand) == pytest.approx(0.04, rel=0.02)
    assert by_hand == pytest.approx(with_fixture, abs=1e-6)


def test_the_mean_over_whole_periods_is_the_friction_alone(lab: Any) -> None:
    motor = lab.lg_400w(cogging_torque=0.02, cogging_order=24)
    clock = VirtualClock()
    world = World(motor, clock, fixture=True)
    world.couple_dynamometer()
    world.dynamometer.enable(True)
    world.dynamometer.command(0.5)
    clock.sleep(30.0)
    friction = world.dynamometer.torque(2.0 * math.pi / 0.5)
    world = World(replace(motor, cogging_torque=0.0), clock, fixture=True)
    world.couple_dynamometer()
    world.dynamometer.enable(True)
    world.dynamometer.command(0.5)
    clock.sleep(30.0)
    assert friction == pytest.approx(world.dynamometer.torque(2.0 * math.pi / 0.5), abs=2e-5)
