"""Joined terminals of a turning rotor: currents by the closed form and by integration, and the braking that they make."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.windings import Windings
from sim_instruments.physics.closed_loops import ClosedLoops, PeriodicCurrents
from sim_instruments.physics.motion.motion import Ramp, Wavering
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import Leads
from sim_instruments.world.world import World

MOTOR = VirtualMotor(
    connection="wye",
    phase_resistances=(0.05, 0.05, 0.05),
    d_axis_inductance=1.0e-3,
    q_axis_inductance=2.5e-3,
    flux_linkage=0.1,
    pole_pairs=4,
    inertia=0.01,
)
ALL = {"A": "link", "B": "link", "C": "link"}


def shorted(motor=MOTOR, sockets=("link", "link", "link"), lead=0.0):
    return Network(Windings(motor, 25.0), sockets, lead_resistance=lead)


@settings(deadline=None, max_examples=40)
@given(
    connection=st.sampled_from(["wye", "delta"]),
    speed=st.floats(1.0, 3000.0),
    saliency=st.floats(0.5, 6.0),
    lead=st.floats(0.0, 0.02),
)
def test_amplitude_and_torque_are_the_closed_form_s(connection, speed, saliency, lead):
    motor = replace(MOTOR, connection=connection, q_axis_inductance=saliency * MOTOR.d_axis_inductance)
    network = shorted(motor, lead=lead)
    circuit = ClosedLoops(network, Ramp(0.0, 0.3, speed / motor.pole_pairs))
    times = np.linspace(0.0, 6.0 * math.pi / speed, 400)
    currents = network.terminal_currents(circuit.winding_currents(times))
    amplitude = np.sqrt(2.0 / 3.0 * np.sum(currents**2, axis=0))
    r, ld, lq = motor.stator_resistance_y + lead, motor.d_axis_inductance_y, motor.q_axis_inductance_y
    flux = motor.flux_linkage_y
    expected = flux * speed * math.hypot(r, speed * lq) / (r**2 + speed**2 * ld * lq)
    np.testing.assert_allclose(amplitude, expected, rtol=1e-9)
    torque = network.windings.torque(circuit.motion.angle(times) * 4, circuit.winding_currents(times))
    np.testing.assert_allclose(torque, -1.5 * 4 * r * expected**2 / speed, rtol=1e-8)
    assert circuit.periodic.braking_torque(np.array([speed / 4]))[0] == pytest.approx(-torque[0], rel=1e-9)


@pytest.mark.slow
@pytest.mark.parametrize("sockets", [("link", "link", "link"), ("link", "link", "open")])
def test_harmonics_saliency_and_unlike_phases_are_what_integration_gives(sockets):
    motor = replace(MOTOR, phase_resistances=(0.05, 0.06, 0.045), flux_harmonics=((5, 0.05, 0.4), (7, 0.03, 1.0)))
    network, speed = shorted(motor, sockets, lead=0.003), 80.0
    circuit = ClosedLoops(network, Ramp(0.0, 0.1, speed / 4))
    windings, basis = network.windings, network.basis

    def slope(time, loops):
        angle = 0.4 + speed * time
        emf = speed * (basis.T @ windings.emf_per_speed(np.array([angle]))[:, 0])
        turning = speed * (basis.T @ windings.inductance_slope(angle) @ basis @ loops)
        return np.linalg.solve(network.inertance(angle), -network.damping @ loops - turning - emf)

    until = 60 * 2.0 * math.pi / speed
    found = solve_ivp(slope, (0.0, until), np.zeros(network.loops), rtol=1e-9, atol=1e-9, dense_output=True)
    times = np.linspace(until - 2.0 * math.pi / speed, until, 60)
    expected = basis @ found.sol(times)
    np.testing.assert_allclose(circuit.winding_currents(times), expected, atol=2e-5 * np.abs(expected).max())


def test_a_speed_that_wavers_changes_the_currents_as_it_should():
    network = shorted()
    motion = Wavering(0.0, 0.0, 20.0, 0.005, 20.0)
    times = np.linspace(0.0, 0.3, 500)
    currents = ClosedLoops(network, motion).winding_currents(times)
    amplitude = np.sqrt(2.0 / 3.0 * np.sum(currents**2, axis=0))
    speed = motion.speed(times) * 4
    expected = 0.1 * speed * np.hypot(0.05, speed * 2.5e-3) / (0.05**2 + speed**2 * 2.5e-6)
    np.testing.assert_allclose(amplitude, expected, rtol=1e-6)


def test_joined_terminals_are_at_one_potential_but_for_their_leads():
    network = shorted(lead=0.004)
    circuit = ClosedLoops(network, Ramp(0.0, 0.0, 30.0))
    times = np.linspace(0.0, 0.1, 300)
    windings = circuit.winding_currents(times)
    potentials = network.node_potentials(circuit.drops(times), windings, circuit.source_voltage(times))
    # A lead drops its own current: against the mean of the three, which is the link.
    np.testing.assert_allclose(potentials[:3] - potentials[4], -0.004 * windings, atol=1e-9)


def test_no_current_at_rest_and_no_loop_without_a_link():
    assert PeriodicCurrents(shorted()).braking_torque(np.array([0.0]))[0] == 0.0
    assert not shorted(sockets=("open", "open", "open")).joins_terminals
    assert not shorted(sockets=("supply+", "supply-", "open")).joins_terminals


def test_a_coasting_shaft_is_braked_by_the_short():
    def coast(wiring):
        clock = VirtualClock()
        world = World(MOTOR, clock, seed=1, leads=Leads(resistance=0.0))
        world.connect(wiring)
        world.couple_dynamometer()
        world.dynamometer.enable(True)
        world.dynamometer.set_mode("speed")
        world.dynamometer.command(100.0)
        clock.sleep(2.0)
        assert world.shaft_velocity() == pytest.approx(100.0, rel=1e-3)
        world.dynamometer.enable(False)
        clock.sleep(0.01)
        return world.shaft_velocity(), world

    machine = World(MOTOR, VirtualClock()).dynamometer.machine
    inertia = MOTOR.inertia + machine.inertia
    braking = PeriodicCurrents(shorted())

    def slope(_, speed):
        drag = (
            machine.coulomb_friction + machine.viscous_friction * speed + braking.braking_torque(np.maximum(speed, 0.0))
        )
        return -drag / inertia

    expected = solve_ivp(slope, (0.0, 0.01), [100.0], rtol=1e-9, atol=1e-9).y[0, -1]
    braked, world = coast(ALL)
    free, _ = coast({})
    assert braked == pytest.approx(expected, rel=1e-3)
    assert free > 99.0 > braked
    assert world.truth()["motor_torque"] < 0.0


def test_the_dynamometer_feels_the_short():
    clock = VirtualClock()
    world = World(MOTOR, clock, seed=1, leads=Leads(resistance=0.0))
    world.connect(ALL)
    world.couple_dynamometer()
    world.dynamometer.enable(True)
    world.dynamometer.set_mode("speed")
    world.dynamometer.command(10.0)
    clock.sleep(1.0)
    machine = world.dynamometer.machine
    drag = machine.coulomb_friction + machine.viscous_friction * 10.0
    braking = PeriodicCurrents(shorted()).braking_torque(np.array([10.0]))[0]
    # Its currents warm the winding a little.
    assert world.dynamometer.torque(0.1) == pytest.approx(drag + braking, rel=3e-3)
