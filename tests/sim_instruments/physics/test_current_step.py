"""Currents that a loop brings to what is commanded: the voltage's integral is the motor's flux, whatever the rotor does meanwhile."""

from typing import Any, Literal

import numpy as np
import pytest

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.circuits.current_step import CurrentStep
from sim_instruments.physics.circuits.rotor_frame import RotorFrame
from sim_instruments.world.machine_data import InverterStage, Leads
from sim_instruments.world.world import World
from tests.runs.flux_bench import motor_on
from tests.sim_instruments.flux_maps import MADE

MAP = MADE.map(80.0)
RESISTANCE, PAIRS, BANDWIDTH = 0.02, 4, 400.0
_PHASES = np.exp(2j * np.pi / 3.0 * np.arange(3)) * (2.0 / 3.0)
STAGE = InverterStage(dc_voltage=120.0, maximum_current=70.0, current_ripple=0.0)


def bench(inertia: float, bandwidth: float | None = BANDWIDTH, *, held: bool = False) -> tuple[World, VirtualClock]:
    """A bench whose inverter regulates no current."""
    clock = VirtualClock()
    motor: Any = motor_on(MAP, resistance=RESISTANCE, pole_pairs=PAIRS)
    world = World(
        motor.__class__(**{**vars(motor), "inertia": inertia}), clock, inverter=STAGE, leads=Leads(resistance=0.0)
    )
    world.connect({"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"})
    if held:
        world.lock_rotor()
    world.inverter.set_mode("dq")
    world.inverter.command_dq_current(0j, bandwidth=bandwidth)
    world.inverter.enable(True)
    clock.sleep(0.01)
    return world, clock


TERMINALS: tuple[Literal["A", "B", "C"], ...] = ("A", "B", "C")


def flux_at(state: Any) -> complex:
    psi_d, psi_q = MAP.flux(state.current.real, state.current.imag)
    return complex(complex(psi_d, psi_q) * np.exp(1j * state.electrical_angle))


@pytest.mark.parametrize(
    ("inertia", "held"), [pytest.param(0.015, False, marks=pytest.mark.slow), (2e-4, False), (0.015, True)]
)
def test_the_voltages_integral_is_the_flux_of_a_rotor_that_swings(inertia: float, held: bool) -> None:
    world, clock = bench(inertia, held=held)
    for channel, node in enumerate(TERMINALS, 1):
        world.attach_voltage_probe(channel, node, "star")
        world.attach_current_probe(channel + 3, node)
    begin, states = clock.now(), [world.inverter.rotor_state()]
    times = [begin]
    for current, seconds in ((-20 + 30j, 3e-3), (-20 - 30j, 6e-3), (-20 + 30j, 3e-3), (0j, 6e-3)):
        world.inverter.command_dq_current(current, bandwidth=BANDWIDTH)
        clock.sleep(seconds)
        times.append(clock.now())
        states.append(world.inverter.rotor_state())
    swung = max(abs(state.electrical_angle - states[0].electrical_angle) for state in states)
    assert (swung == 0.0) is held
    total, seen = 0j, flux_at(states[0])
    for first, last, state in zip(times, times[1:], states[1:], strict=False):
        # The command acts from its own instant on: what is sampled there is of before.
        at = np.linspace(first, last, 60001)
        at[0] += 1e-12
        u, i = (_PHASES @ np.array([world.probe_signal(k + shift, at) for k in (1, 2, 3)]) for shift in (0, 3))
        lost = u - RESISTANCE * i
        total += complex(np.sum(0.5 * (lost[1:] + lost[:-1]) * np.diff(at)))
        assert abs(seen + total - flux_at(state)) < 3e-4 * MAP.flux_linkage


def test_it_is_as_fast_as_the_loop_and_no_faster_than_the_voltage() -> None:
    frame = RotorFrame(0.1, lambda current, _: 1e-3 * current + 0.01)
    quick = CurrentStep.within(frame, 1.0, 0j, 3 + 4j, bandwidth=100.0, speed=0.0, limit=1e3)
    at = np.array([1.0, 1.0 + 1.0 / (200.0 * np.pi), quick.end])
    assert quick.currents(at) == pytest.approx((3 + 4j) * (1.0 - np.exp([0.0, -1.0, -np.inf])), abs=1e-6)
    slow = CurrentStep.within(frame, 1.0, 0j, 3 + 4j, bandwidth=1e4, speed=0.0, limit=2.0)
    # 1.9 V less the largest drop of 0.5 V, over 1 mH.
    assert np.abs(slow.slopes(np.array([1.001]))) == pytest.approx(1400.0)
    assert np.max(np.abs(slow.slopes(np.linspace(1.0, slow.end, 101)))) <= 1400.0 + 1e-9
    h = 1e-7
    middle = np.linspace(1.0005, slow.end - h, 50)
    numeric = (slow.currents(middle + h) - slow.currents(middle - h)) / (2.0 * h)
    assert slow.slopes(middle) == pytest.approx(numeric, rel=1e-3, abs=1.0)


def test_a_first_stroke_of_half_the_impulse_leaves_the_rotor_about_where_it_was() -> None:
    turned = []
    for first in (3e-3, 6e-3):
        world, clock = bench(2e-3)
        begin = world.inverter.rotor_state()
        for current, seconds in ((30j, first), (-30j, 6e-3), (30j, first), (0j, 0.2)):
            world.inverter.command_dq_current(current, bandwidth=BANDWIDTH)
            clock.sleep(seconds)
        end = world.inverter.rotor_state()
        assert end.speed == 0.0
        turned.append(abs(end.angle - begin.angle))
    assert turned[0] < 0.05 * turned[1]


def test_without_a_bandwidth_they_are_there_at_once() -> None:
    world, _ = bench(0.015, bandwidth=None)
    world.inverter.command_dq_current(-5 + 5j)
    assert world.inverter.rotor_state().current == pytest.approx(-5 + 5j)


def test_static_friction_holds_a_rotor_as_long_as_it_can() -> None:
    world, clock = bench(0.015)
    # 1.5·4·(ψ_d·0.2) stays below 0.2 N·m, the friction.
    world.inverter.command_dq_current(0.2j, bandwidth=BANDWIDTH)
    clock.sleep(0.02)
    assert world.inverter.rotor_state().speed == 0.0
    world.inverter.command_dq_current(20j, bandwidth=BANDWIDTH)
    clock.sleep(0.02)
    assert world.inverter.rotor_state().speed > 0.0
