"""A free rotor under current: where it comes to rest, and how it gets there."""

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from sim_instruments.clock.virtual_clock import VirtualClock
from sim_instruments.world.machine_data import Leads, SupplyStage
from sim_instruments.world.world import World

#: Ten per cent of a rated current of 29 A.
TENTH_OF_RATED = 0.02 / (1.5 * 4 * 8.5e-3 * math.sin(math.radians(7.8)))


def electrical_degrees(world: World) -> float:
    p = world.motor.pole_pairs
    return (math.degrees(world.dial_angle() * p) + 180.0) % 360.0 - 180.0


@pytest.mark.parametrize(("start", "side"), [(60.0, 1), (-60.0, -1), (120.0, 1), (-150.0, -1)])
def test_friction_holds_the_rotor_off_by_7_8_degrees_on_the_side_it_came_from(
    lab: Any, start: float, side: int
) -> None:
    # The terminals joined at − brake the rotor so strongly that it creeps to the edge of the band (E11).
    motor = lab.lg_400w(phase_resistances=(16e-3,) * 3)
    clock = VirtualClock()
    world = World(motor, clock, initial_angle=math.radians(start) / 4)
    lab.energise(world, 0.3, TENTH_OF_RATED, lab.series_parallel)
    clock.sleep(5.0)
    rest = electrical_degrees(world)
    assert rest == pytest.approx(side * 7.8, abs=0.06)
    assert world.truth()["shaft_speed"] == 0.0
    assert abs(world.truth()["motor_torque"]) <= 0.02 * (1 + 1e-9)


def test_more_current_aligns_better(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(), clock, supply=SupplyStage(maximum_current=40.0), initial_angle=0.3)
    lab.energise(world, 1.0, 29.0, lab.series_parallel)
    clock.sleep(5.0)
    assert abs(electrical_degrees(world)) < 1.5


def test_friction_large_enough_holds_it_where_it_is(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(coulomb_friction=0.2), clock, initial_angle=0.3)
    lab.energise(world, 0.3, TENTH_OF_RATED, lab.series_parallel)
    clock.sleep(2.0)
    assert world.dial_angle() == 0.3
    world.nudge_to_next_rest()
    clock.sleep(4.0)
    assert world.dial_angle() > 0.3
    assert world.shaft_speed(0.1) == 0.0


@pytest.mark.parametrize("name", ["lg_400w", "outrunner", "gimbal"])
@pytest.mark.parametrize("direction", [1, -1])
def test_there_are_as_many_rests_in_a_turn_as_pole_pairs(lab: Any, name: str, direction: int) -> None:
    motor = getattr(lab, name)()
    clock = VirtualClock()
    world = World(motor, clock, initial_angle=0.02)
    lab.energise(world, 5.0, 3.0 if name != "gimbal" else 0.4, lab.series_parallel)
    clock.sleep(3.0)
    rests = [world.dial_angle()]
    for _ in range(motor.pole_pairs):
        pull = world.nudge_to_next_rest(direction)
        clock.sleep(pull + 2.0)
        rests.append(world.dial_angle())
    steps = np.diff(rests)[1:] * direction
    assert np.allclose(steps, 2 * math.pi / motor.pole_pairs, atol=0.01 / motor.pole_pairs)


def swing_by_integration(motor: Any, start: float, current: float, end: float, tolerance: float = 1e-9) -> np.ndarray:
    """Regulated current in A, with B and C joined: shaft angle from dq torque and the loop B–C, all by hand."""
    p, flux, r = motor.pole_pairs, motor.flux_linkage, motor.phase_resistances[0]
    ld, lq = motor.d_axis_inductance, motor.q_axis_inductance
    mean, half = 0.5 * (ld + lq), 0.5 * (ld - lq)

    def slopes(_: float, y: np.ndarray) -> list[float]:
        # Space vector: α from the regulated current, β from the loop: i_B = −I/2 + x, i_C = −I/2 − x, β = 2x/√3.
        angle, speed, beta = y
        theta, we = p * angle, p * speed
        id_, iq = (
            current * math.cos(theta) + beta * math.sin(theta),
            -current * math.sin(theta) + beta * math.cos(theta),
        )
        torque = 1.5 * p * (flux * iq + (ld - lq) * id_ * iq)
        # ψ_β = mean·β + half·(sin 2θ·I − cos 2θ·β) + λ·sin θ; the joined terminals force r·β + dψ_β/dt = 0.
        inductance = mean - half * math.cos(2 * theta)
        motion = half * 2 * we * (math.cos(2 * theta) * current + math.sin(2 * theta) * beta)
        emf = flux * we * math.cos(theta)
        return [
            speed,
            (torque - motor.coulomb_friction * math.copysign(1, speed) - motor.viscous_friction * speed)
            / motor.inertia,
            -(r * beta + motion + emf) / inductance,
        ]

    solution = solve_ivp(
        slopes,
        (0, end),
        [start, -1e-9, 0.0],
        rtol=tolerance,
        atol=0.01 * tolerance,
        t_eval=np.linspace(0, end, 101),
        method="Radau",
    )
    return np.asarray(solution.y[:2])


def test_a_swing_against_equations_written_otherwise(lab: Any) -> None:
    motor = lab.lg_400w(phase_resistances=(0.5,) * 3, q_axis_inductance=140e-6, coulomb_friction=0.01)
    clock = VirtualClock()
    world = World(
        motor,
        clock,
        supply=SupplyStage(60.0, 100.0, 0.0, 1e7),
        leads=Leads(0.0, 0.0, 0.0),
        initial_angle=1.2 / 4,
    )
    world.lock_rotor()
    lab.energise(world, 60.0, 4.0, lab.series_parallel)
    clock.sleep(1.0)
    world.release_rotor()
    # Sliding friction is taken a thousandth below the static one, which shows in the fifth digit.
    expected = swing_by_integration(motor, 0.3, 4.0, 0.015)
    assert expected[1].max() < 0.0, "the comparison must end before the rotor turns back"
    for index in (20, 60, 100):
        clock.sleep(1.0 + 0.015 * index / 100 - clock.now())
        assert world.dial_angle() == pytest.approx(expected[0, index], abs=6e-5)
        assert world.truth()["shaft_speed"] == pytest.approx(expected[1, index], rel=1e-3)


@pytest.mark.slow
def test_creeping_against_a_stiff_circuit(lab: Any) -> None:
    # Rotor and braking loop ring at 50000 rad/s against each other while the rotor takes a second to creep home.
    motor = lab.lg_400w(
        phase_resistances=(0.023,) * 3,
        d_axis_inductance=19e-6,
        q_axis_inductance=29e-6,
        flux_linkage=0.0625,
        pole_pairs=6,
        inertia=3.6e-6,
        coulomb_friction=0.06,
        thermal_resistance=0.0,
    )
    world, clock = lab.ideal_world(motor, initial_angle=0.2)
    world.lock_rotor()
    lab.energise(world, 60.0, 4.0, lab.series_parallel)
    clock.sleep(1.0)
    world.release_rotor()
    # Ten thousand times as exact as the comparison; a tighter tolerance takes seconds.
    expected = swing_by_integration(motor, 0.2, 4.0, 0.3, tolerance=1e-6)[0]
    for index in (10, 50, 100):
        clock.sleep(1.0 + 0.3 * index / 100 - clock.now())
        assert world.dial_angle() == pytest.approx(expected[index], abs=1e-4)
    assert expected[-1] < 0.15
    clock.sleep(10.0)
    assert world.shaft_speed(0.0) == 0.0
    assert abs(world.truth()["motor_torque"]) == pytest.approx(0.06, rel=2e-3)


ACROSS = {"B": "supply+", "C": "supply-"}


def ringing_world(lab: Any, motor: Any, start: float, current: float) -> World:
    """Let go of a rotor under a regulated current from B to C that is there already, at 1 s."""
    world, clock = lab.ideal_world(motor, initial_angle=start)
    world.lock_rotor()
    lab.energise(world, 60.0, current, ACROSS)
    clock.sleep(1.0)
    world.release_rotor()
    return world


def ringing_by_integration(motor: Any, start: float, current: float, end: float) -> tuple[Any, list[float]]:
    """Shaft angle over time and turning points of the same, one half swing after the other, from the dq torque."""
    p, flux = motor.pole_pairs, motor.flux_linkage
    amplitude = 2.0 / math.sqrt(3.0) * current

    def slopes(_: float, y: np.ndarray, way: float) -> list[float]:
        theta = p * y[0] - math.pi / 2
        id_, iq = amplitude * math.cos(theta), -amplitude * math.sin(theta)
        torque = 1.5 * p * (flux + (motor.d_axis_inductance - motor.q_axis_inductance) * id_) * iq
        drag = 0.999 * motor.coulomb_friction * way + motor.viscous_friction * y[1]
        return [y[1], (torque - drag) / motor.inertia]

    def standing(_: float, y: np.ndarray, way: float) -> float:
        return float(y[1] * way)

    standing.terminal, standing.direction = True, -1  # type: ignore[attr-defined]
    time, state, pieces, turns = 0.0, [start, 0.0], [], []
    while time < end:
        way = math.copysign(1.0, slopes(0.0, np.array(state), 0.0)[1])
        solved = solve_ivp(
            slopes, (time, end), state, args=(way,), events=standing, dense_output=True, rtol=1e-10, atol=1e-12
        )
        pieces.append((time, solved.sol))
        time, state = float(solved.t[-1]), [float(solved.y[0, -1]), 0.0]
        turns.append(time)

    def angle(at: float) -> float:
        return float(next(piece for begin, piece in reversed(pieces) if begin <= at)(at)[0])

    return angle, turns[:-1]


def test_many_half_swings_against_equations_written_otherwise(lab: Any) -> None:
    motor = lab.lg_400w(
        phase_resistances=(0.5,) * 3, q_axis_inductance=140e-6, coulomb_friction=2e-3, thermal_resistance=0.0
    )
    world = ringing_world(lab, motor, 0.1, 4.0)
    angle, turns = ringing_by_integration(motor, 0.1, 4.0, 0.2)
    assert len(turns) > 10
    for share in np.linspace(0.01, 1.0, 40):
        world.clock.sleep(1.0 + 0.2 * share - world.clock.now())
        assert world.dial_angle() == pytest.approx(angle(0.2 * share), abs=2e-5)
    way = np.abs(np.diff([0.1, *(angle(turn) for turn in turns), angle(0.2)])).sum()
    assert world.shaft_speed(0.2) == pytest.approx(way / 0.2, rel=1e-4)


def test_every_half_swing_loses_what_friction_takes(lab: Any) -> None:
    motor = lab.lg_400w(coulomb_friction=1e-3, viscous_friction=0.0, q_axis_inductance=73e-6)
    world = ringing_world(lab, motor, 0.15, 10.0)
    world.clock.sleep(0.3)
    segments = [*world._timeline._past, world._timeline.present]
    turns = [(segment, time) for segment in segments for time in segment.reversals]
    assert len(turns) > 20
    # Between two turning points the magnets' work is what friction took, cos being their potential.
    angles = np.array([segment.motion.angle(np.array([time]))[0] for segment, time in turns])
    peak = 1.5 * motor.flux_linkage * 10.0 * 2.0 / math.sqrt(3.0)
    work = np.diff(peak * np.cos(4 * angles - math.pi / 2))
    assert work == pytest.approx(0.999e-3 * np.abs(np.diff(angles)), rel=2e-3)


@pytest.mark.parametrize("friction", [1e-3, 1e-4])
def test_a_long_ringing_ends_within_the_band_and_takes_few_segments(lab: Any, friction: float) -> None:
    world = ringing_world(lab, lab.lg_400w(coulomb_friction=friction), 0.1, 10.0)
    world.clock.sleep(8.0)
    assert world.shaft_speed(0.0) == 0.0
    assert abs(world.truth()["motor_torque"]) <= friction * (1 + 1e-9)
    segments = [*world._timeline._past, world._timeline.present]
    assert sum(len(segment.reversals) for segment in segments) > 1.5 * len(segments)
    assert world.shaft_speed(8.0) > 0.0


def test_a_delta_swings_like_its_y_equivalent(lab: Any) -> None:
    # The delta's circulating current decays at 15000/s, so it follows at once.
    wye = lab.lg_400w(phase_resistances=(0.1, 0.1, 0.1), coulomb_friction=2e-3)
    delta = lab.lg_400w(
        connection="delta",
        phase_resistances=(0.3, 0.3, 0.3),
        d_axis_inductance=3 * 73e-6,
        q_axis_inductance=3 * 76.5e-6,
        zero_sequence_inductance=20e-6,
        flux_linkage=8.5e-3 * math.sqrt(3.0),
        coulomb_friction=2e-3,
    )
    seen = []
    for motor, shift in ((wye, 0.0), (delta, math.pi / 6 / 4)):
        world = ringing_world(lab, motor, 0.2 + shift, 4.0)
        world.attach_voltage_probe(1, "B", "C")
        world.clock.sleep(0.15)
        times = np.linspace(1.0, 1.15, 200)
        voltage = world.probe_signal(1, times)
        seen.append((world._timeline.angles(times) - shift, voltage))
    assert np.allclose(seen[0][0], seen[1][0], atol=2e-5)
    assert np.allclose(seen[0][1], seen[1][1], atol=2e-3 * np.abs(seen[0][1]).max())


def test_energy_of_a_swing_is_accounted_for(lab: Any) -> None:
    motor = lab.lg_400w(thermal_resistance=0.0)
    clock = VirtualClock()
    world = World(motor, clock, initial_angle=0.25)
    for channel, terminal in enumerate("ABC", start=1):
        world.attach_current_probe(channel, terminal)  # type: ignore[arg-type]
        world.attach_voltage_probe(10 + channel, terminal, "star")  # type: ignore[arg-type]
    lab.energise(world, 0.1, 10.0, lab.series_parallel)
    span, steps = 0.012, 20001
    clock.sleep(span)
    times = np.linspace(0.0, span, steps)
    i = np.array([world.probe_signal(channel, times) for channel in (1, 2, 3)])
    v = np.array([world.probe_signal(10 + channel, times) for channel in (1, 2, 3)])
    speed = np.array([segment_speed(world, times)])[0]
    delivered = np.trapezoid((i * v).sum(axis=0), times)
    windings = world._timeline.windings()
    lost = np.trapezoid(windings.resistance @ i**2, times)
    friction = np.trapezoid(0.02 * np.abs(speed) + 2e-5 * speed**2, times)
    kinetic = 0.5 * motor.inertia * speed[-1] ** 2
    stored = 0.5 * i[:, -1] @ windings.inductance(4 * world.dial_angle()) @ i[:, -1]
    assert kinetic > 0.01 * delivered
    assert delivered == pytest.approx(lost + friction + kinetic + stored, rel=2e-3)


def segment_speed(world: World, times: np.ndarray) -> np.ndarray:
    return world._timeline.sample(lambda segment, at: segment.motion.speed(at), times)


def test_a_q_axis_step_moves_an_unlocked_rotor(lab: Any) -> None:
    wiring = {"A": "supply+", "B": "supply-", "C": "supply-"}
    seen = {}
    for locked in (True, False):
        clock = VirtualClock()
        world = World(lab.lg_400w(), clock, initial_angle=math.pi / 8)
        world.attach_current_probe(4, "A")
        if locked:
            world.lock_rotor()
        lab.energise(world, 0.1, 10.0, wiring)
        clock.sleep(0.05)
        seen[locked] = world.probe_signal(4, np.linspace(0.0, 0.05, 200))
        assert (world.dial_angle() == math.pi / 8) is locked
    assert np.abs(seen[True] - seen[False]).max() > 0.1 * seen[True].max()


def test_alignment_to_q_is_a_quarter_turn_from_d(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(coulomb_friction=1e-4), clock, initial_angle=1.2 / 4)
    lab.energise(world, 0.5, 10.0, {"B": "supply+", "C": "supply-"})
    clock.sleep(5.0)
    assert electrical_degrees(world) == pytest.approx(90.0, abs=0.1)


def test_without_current_the_hand_finds_no_rest(lab: Any) -> None:
    clock = VirtualClock()
    world = World(lab.lg_400w(), clock)
    pull = world.nudge_to_next_rest()
    clock.sleep(pull + 1.0)
    assert 2 * math.pi * 0.05 <= world.dial_angle() <= 2 * math.pi * 0.1 + 1e-3
    with pytest.raises(ValueError, match="use 1"):
        world.nudge_to_next_rest(0)
    world.lock_rotor()
    with pytest.raises(RuntimeError, match="locked"):
        world.nudge_to_next_rest()
