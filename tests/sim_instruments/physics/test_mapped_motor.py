"""A motor on a flux map against equations written out anew, its energy balance, and its small signals."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import solve_ivp
from scipy.optimize import fsolve

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.physics.circuits.source import absent
from sim_instruments.physics.mapped.network import MappedNetwork
from sim_instruments.physics.mapped.periodic_flux import PeriodicFlux
from sim_instruments.physics.mapped.windings import MappedWindings
from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.iron import Iron
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.world.machine_data import DynamometerMachine, InverterStage, Leads
from sim_instruments.world.world import World
from tests.sim_instruments.flux_maps import BALDOR_FILE, MADE, MadeMotor, made_motors, needs_baldor, reach_of

R, PAIRS = 40e-3, 4
PHASES = np.arange(3) * (2.0 * math.pi / 3.0)
SHORT = {"A": "link", "B": "link", "C": "link"}
INVERTER = {"A": "inverter_u", "B": "inverter_v", "C": "inverter_w"}
IRON = Iron(hysteresis_loss=3.0, eddy_loss=0.01)


def on_map(lab: Any, flux_map: FluxMap, **changes: Any) -> VirtualMotor:
    values: dict[str, Any] = {
        "phase_resistances": (R, R, R),
        "flux_linkage": flux_map.flux_linkage,
        "flux_map": flux_map,
        "thermal_resistance": 0.0,
        "coulomb_friction": 0.0,
        "viscous_friction": 0.0,
        **changes,
    }
    made: VirtualMotor = lab.lg_400w(**values)
    return made


def turned(flux_map: FluxMap, degrees: float) -> FluxMap:
    """Return the map in a frame turned by an angle: its cross term is there at no current."""
    rotate = np.exp(1j * math.radians(degrees))
    d, q = np.meshgrid(flux_map.table.d_currents, flux_map.table.q_currents, indexing="ij")
    current = (d + 1j * q).ravel()
    seen = current * rotate
    flux = np.array(flux_map.flux(seen.real, seen.imag))
    back = (flux[0] + 1j * flux[1]) / rotate
    return FluxMap.from_points(current.real, current.imag, back.real, back.imag)


def probes(world: World) -> None:
    for channel, terminal in enumerate("ABC", start=1):
        world.attach_current_probe(channel, terminal)  # type: ignore[arg-type]


def currents(world: World, times: np.ndarray) -> np.ndarray:
    return np.array([world.probe_signal(channel, times) for channel in (1, 2, 3)])


def dq(phases: np.ndarray, angle: Any) -> np.ndarray:
    """Return d + j·q of three phases at an electrical angle."""
    result: np.ndarray = (2.0 / 3.0) * (phases.T @ np.exp(1j * PHASES)) * np.exp(-1j * np.asarray(angle))
    return result


# Against equations written out anew


@pytest.mark.parametrize("degrees", [35.0, pytest.param(200.0, marks=pytest.mark.slow)])
@pytest.mark.parametrize("terminals", ["one against two", "two"])
def test_a_step_on_a_held_rotor(lab: Any, degrees: float, terminals: str) -> None:
    angle, made = math.radians(degrees), MADE.map(80.0, 41)
    wiring = lab.series_parallel if terminals == "one against two" else {"A": "supply+", "B": "supply-"}
    world, clock = lab.ideal_world(on_map(lab, made), initial_angle=angle / PAIRS)
    probes(world)
    world.lock_rotor()
    lab.energise(world, 3.0, 100.0, wiring)
    clock.sleep(0.03)
    times = np.linspace(2e-5, 0.03, 60)

    # Fluxes are the states here; loop by loop: the driven direction's flux, and for two loops the other's.
    along = np.array([1.0, -0.5, -0.5]) if terminals == "one against two" else np.array([1.0, -1.0, 0.0])
    across = np.array([0.0, 1.0, -1.0])
    directions = [along, across] if terminals == "one against two" else [along]
    axes = np.array([np.cos(angle - PHASES), -np.sin(angle - PHASES)])

    def phase_currents(loops: np.ndarray) -> np.ndarray:
        return np.asarray(loops @ np.array(directions))

    def linked(loops: np.ndarray) -> np.ndarray:
        d, q = (2.0 / 3.0) * axes @ phase_currents(loops)
        flux = axes.T @ np.array(made.flux(d, q))
        return np.array([direction @ flux for direction in directions])

    begin = linked(np.zeros(len(directions)))
    latest = np.zeros(len(directions))

    def loops_of(flux: np.ndarray) -> np.ndarray:
        """Return the loop currents that link so much more than none, by Newton's method from the latest ones."""
        nonlocal latest
        for _ in range(8):
            left = flux + begin - linked(latest)
            if np.abs(left).max() < 1e-13:
                break
            columns = [
                (linked(latest + step) - linked(latest - step)) / 2e-3 for step in 1e-3 * np.eye(len(directions))
            ]
            latest = latest + np.linalg.solve(np.array(columns).T, left)
        return latest

    def slope(time: float, flux: np.ndarray) -> np.ndarray:
        # The supply's ramp takes 3 V / (1e7 V/s).
        source = np.array([3.0 * min(time / 3e-7, 1.0), 0.0])[: len(directions)]
        carried = phase_currents(loops_of(flux))
        return source - R * np.array([direction @ carried for direction in directions])

    solution = solve_ivp(
        slope,
        (0.0, 0.1),
        np.zeros(len(directions)),
        method="DOP853",
        t_eval=times,
        rtol=1e-9,
        atol=1e-12,
        max_step=5e-3,
    )
    right = np.array([phase_currents(loops_of(flux)) for flux in solution.y.T])
    assert np.abs(currents(world, times).T - right).max() < 2e-5 * np.abs(right).max()


def test_a_free_rotor_is_drawn_to_the_current(lab: Any) -> None:
    made = MADE.map(80.0, 41)
    motor = on_map(lab, made, viscous_friction=1e-3)
    world, clock = lab.ideal_world(motor, initial_angle=0.15)
    probes(world)
    lab.energise(world, 1.5, 100.0, lab.series_parallel)
    clock.sleep(0.05)
    times = np.linspace(1e-4, 0.05, 60)

    def slope(time: float, state: np.ndarray) -> np.ndarray:
        angle, speed, d_flux, q_flux = state
        theta = PAIRS * angle
        source = 1.5 * min(time / 1.5e-7, 1.0)
        voltage = (2.0 / 3.0) * source * np.exp(-1j * theta)
        d, q = made.currents(d_flux, q_flux)
        torque = 1.5 * PAIRS * float(d_flux * q - q_flux * d)
        along = voltage.real - R * d + PAIRS * speed * q_flux
        across = voltage.imag - R * q - PAIRS * speed * d_flux
        return np.array([speed, (torque - 1e-3 * speed) / motor.inertia, float(along), float(across)])

    begin = [0.15, 0.0, made.flux_linkage, 0.0]
    solution = solve_ivp(slope, (0.0, 0.05), begin, method="DOP853", t_eval=times, rtol=1e-9, atol=1e-12, max_step=1e-3)
    d, q = made.currents(solution.y[2], solution.y[3])
    assert (
        np.abs(dq(currents(world, times), PAIRS * solution.y[0]) - (d + 1j * q)).max() < 5e-4 * np.abs(d + 1j * q).max()
    )


@pytest.mark.parametrize("iron", [Iron(), IRON])
@pytest.mark.parametrize("speed", [5.0, 40.0, 150.0])
def test_three_shorted_terminals(lab: Any, iron: Iron, speed: float) -> None:
    made = MADE.map(120.0, 41)
    windings = MappedWindings(on_map(lab, made, iron=iron), 25.0)
    turn = PeriodicFlux(MappedNetwork(windings, ("link", "link", "link")), absent(0.0)).turn(PAIRS * speed)
    omega = PAIRS * speed
    lost = iron.hysteresis_loss + iron.eddy_loss * omega

    def left(unknown: np.ndarray) -> list[float]:
        # Magnetising currents; those at the terminals hold the loss's share.
        d, q = unknown
        d_flux, q_flux = (float(each) for each in made.flux(d, q))
        return [R * (d - lost * q_flux) - omega * q_flux, R * (q + lost * d_flux) + omega * d_flux]

    d, q = fsolve(left, [-40.0, -10.0], xtol=1e-13)
    d_flux, q_flux = (float(each) for each in made.flux(d, q))
    terminal = complex(d - lost * q_flux, q + lost * d_flux)
    # The orbit's fundamental is that current, seen from the first phase.
    phases = windings.incidence @ (MappedNetwork(windings, ("link", "link", "link")).basis @ turn.loops.T)
    angles = 2.0 * math.pi / len(turn.loops) * np.arange(len(turn.loops))
    assert np.abs(dq(phases, angles) - terminal).max() < 1e-8 * abs(terminal)
    assert turn.torque == pytest.approx(1.5 * PAIRS * (d_flux * q - q_flux * d), rel=1e-9)


# Energy


@pytest.mark.slow
@given(made_motors(), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0), st.floats(-400.0, 400.0), st.booleans())
@settings(max_examples=25)
def test_power_in_is_copper_iron_and_shaft(motor: MadeMotor, d: float, q: float, speed: float, delta: bool) -> None:
    reach = reach_of(motor)
    made = motor.map(reach, 17)
    impedance = made.q_axis_inductance
    given_motor = VirtualMotor(
        connection="delta" if delta else "wye",
        phase_resistances=(0.1 * impedance, 0.2 * impedance, 0.15 * impedance),
        d_axis_inductance=1.0,
        q_axis_inductance=1.0,
        flux_linkage=made.flux_linkage * (math.sqrt(3.0) if delta else 1.0),
        pole_pairs=3,
        inertia=1.0,
        iron=Iron(hysteresis_loss=0.02 / impedance, eddy_loss=1e-4 / impedance),
        flux_harmonics=((5, 0.05, 0.3),),
        turn_shares=(1.0, 0.96, 1.0),
        flux_map=made,
    )
    windings = MappedWindings(given_motor, 25.0)
    # A current that turns with the rotor: over a turn nothing is stored.
    angles = np.linspace(0.0, 2.0 * math.pi, 240, endpoint=False)
    current = reach * complex(d, q) * np.exp(1j * angles)
    winding = np.real(current * np.exp(-1j * PHASES[:, np.newaxis]))
    slopes = speed * np.real(1j * current * np.exp(-1j * PHASES[:, np.newaxis]))
    speeds = np.full(len(angles), speed)
    power = float(np.sum(windings.drops(angles, speeds, winding, slopes) * winding, axis=0).mean())
    copper = float((windings.resistance @ winding**2).mean())
    iron = float(windings.iron_loss(angles, winding, speeds).mean())
    shaft = float(windings.torque(angles, winding, speeds).mean()) * speed / 3
    # Between its points a table of a motor that conserves energy does so nearly.
    assert power == pytest.approx(copper + iron + shaft, abs=2e-4 * (copper + iron + abs(shaft)))


def test_a_short_brakes_a_coasting_rotor_by_what_it_heats(lab: Any) -> None:
    made = MADE.map(120.0, 41)
    motor = on_map(lab, made, iron=IRON, inertia=2e-3, phase_resistances=(R, 1.2 * R, 0.9 * R), viscous_friction=1e-3)
    world, clock = lab.ideal_world(
        motor, dynamometer=DynamometerMachine(inertia=0.0, coulomb_friction=0.0, viscous_friction=0.0)
    )
    probes(world)
    world.couple_dynamometer()
    world.dynamometer.set_mode("speed")
    world.dynamometer.enable(True)
    world.dynamometer.command(150.0)
    clock.sleep(5.0)
    world.connect(SHORT)
    world.dynamometer.enable(False)
    start, first = clock.now(), world.shaft_speed(0.0)
    clock.sleep(0.06)
    edges = start + np.linspace(0.0, 0.06, 4001)
    seen = currents(world, edges)
    heat = np.array([R, 1.2 * R, 0.9 * R]) @ seen**2
    speeds = np.array([world._timeline.sample(lambda segment, times: segment.motion.speed(times), edges)])[0]
    iron = world._timeline.sample(lambda segment, times: segment.iron_loss(times), edges)
    taken = 0.5 * motor.inertia * (first**2 - world.shaft_speed(0.0) ** 2)
    given_off = np.trapezoid(heat + iron + 1e-3 * speeds**2, edges)
    assert world.shaft_speed(0.0) < 0.8 * first
    # The energy in the coils' fields, and that the currents follow the speed at once, are left out of this balance.
    assert taken == pytest.approx(given_off, rel=0.02)


def test_a_short_brakes_with_the_torque_that_its_heat_needs(lab: Any) -> None:
    motor = on_map(lab, MADE.map(120.0, 41), iron=IRON, phase_resistances=(R, 1.2 * R, 0.9 * R))
    machine = DynamometerMachine(maximum_torque=100.0, coulomb_friction=0.0, viscous_friction=0.0, speed_ripple=0.0)
    world, clock = lab.ideal_world(motor, dynamometer=machine)
    probes(world)
    world.connect(SHORT)
    world.couple_dynamometer()
    world.dynamometer.set_mode("speed")
    world.dynamometer.enable(True)
    for speed in (10.0, 50.0, 200.0):
        world.dynamometer.command(speed)
        clock.sleep(2.0)
        period = 2.0 * math.pi / speed
        now = clock.now()
        times = now - period * (np.arange(720) + 0.5) / 720
        heat = float((np.array([R, 1.2 * R, 0.9 * R]) @ currents(world, times) ** 2).mean())
        iron = float(world._timeline.sample(lambda segment, at: segment.iron_loss(at), times).mean())
        assert world.dynamometer.torque(period) * speed == pytest.approx(heat + iron, rel=1e-5)


# Small signals


@pytest.mark.parametrize("frame", [0.0, 4.0])
def test_the_bridge_reads_the_slopes_of_the_fluxes(lab: Any, frame: float) -> None:
    made = turned(MADE.map(80.0, 41), frame) if frame else MADE.map(80.0, 41)
    step = 1e-3
    for degrees in (0.0, 20.0, 45.0, 90.0, 130.0):
        angle = math.radians(degrees)
        motor = on_map(lab, made, flux_linkage=float(made.flux(0.0, 0.0)[0]))
        world, clock = lab.ideal_world(motor, initial_angle=angle / PAIRS)
        world.connect({"A": "lcr_high", "B": "lcr_low", "C": "lcr_low"})
        world.lock_rotor()
        clock.sleep(1.0)
        # A change of the current in A and half of it back through B and C each.
        axes = np.array([np.cos(angle), -np.sin(angle)])
        after, before = (np.array(made.flux(*(sign * step * axes))) for sign in (1.0, -1.0))
        own = axes @ (after - before) / (2.0 * step)
        if frame == 0.0:
            # B and C together: no current flows between them only where A's axis is one of the rotor's.
            other = np.array([np.sin(angle), np.cos(angle)])
            changes = (np.array(made.flux(*(sign * step * other))) for sign in (1.0, -1.0))
            after_other, before_other = changes
            mutual = axes @ (after_other - before_other) / (2.0 * step)
            beside = other @ (after_other - before_other) / (2.0 * step)
            omega = 2.0 * math.pi * 1000.0
            across = 1j * omega * mutual
            right = 1.5 * (R + 1j * omega * own - across**2 / (R + 1j * omega * beside))
        else:
            matrix = np.array(made.differential_inductances(0.0, 0.0)).reshape(2, 2)
            assert matrix[0, 1] == pytest.approx(matrix[1, 0], rel=1e-3)
            assert abs(matrix[0, 1]) > 1e-6
            other = np.array([np.sin(angle), np.cos(angle)])
            omega = 2.0 * math.pi * 1000.0
            first, between, last = axes @ matrix @ axes, axes @ matrix @ other, other @ matrix @ other
            right = 1.5 * (R + 1j * omega * first - (1j * omega * between) ** 2 / (R + 1j * omega * last))
        assert world.impedance(1000.0, 1.0, 0.1) == pytest.approx(right, rel=2e-4)


# The measured map on the bench


@needs_baldor
def test_the_measured_motor_makes_its_torque(lab: Any) -> None:
    baldor = FluxMap.from_csv(BALDOR_FILE)
    clock = VirtualClock()
    motor = VirtualMotor(
        "wye", (0.63,) * 3, 1.0, 1.0, baldor.flux_linkage, 2, 0.015, flux_map=baldor, thermal_resistance=0.0
    )
    machine = DynamometerMachine(maximum_torque=200.0, coulomb_friction=0.0, viscous_friction=0.0, speed_ripple=0.0)
    world = World(motor, clock, inverter=InverterStage(dc_voltage=600.0), leads=Leads(), dynamometer=machine)
    assert motor.flux_linkage_y == pytest.approx(0.444, abs=5e-4)
    world.connect(INVERTER)
    world.couple_dynamometer()
    world.dynamometer.set_mode("speed")
    world.dynamometer.enable(True)
    world.dynamometer.command(400.0 * math.pi / 30.0)
    world.inverter.set_mode("dq")
    world.inverter.enable(True)
    torques = {}
    for degrees in (49.7, 50.7, 51.7):
        world.inverter.command_dq_current(20.0j * np.exp(1j * math.radians(degrees)))
        clock.sleep(5.0)
        torques[degrees] = -world.dynamometer.torque(0.15)
    assert torques[50.7] == pytest.approx(55.5, abs=0.05)
    assert torques[50.7] > max(torques[49.7], torques[51.7])
