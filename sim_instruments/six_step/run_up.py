"""Run-up of a drive in time: the electrical circuit exact in every step, the speed carried along between steps."""

import math
from dataclasses import dataclass

import numpy as np

from sim_instruments.six_step.circuit import Real
from sim_instruments.six_step.drive import SixStepError
from sim_instruments.six_step.state import Bridge
from sim_instruments.six_step.steady_state import next_state, previous_state

_STATE_ANGLE = math.pi / 3


@dataclass(frozen=True)
class RunUp:
    """A run-up: times in s, mechanical speeds in rad/s, electrical angles since T1T2 began in rad, shape (n,).

    Winding currents a, b, c and currents' torque on the magnets at those times: A, shape (3, n), and N·m.
    """

    times: Real
    speeds: Real
    angles: Real
    winding_currents: Real
    torques: Real


def run_up(
    bridge: Bridge,
    duration: float,
    *,
    load_torque: float = 0.0,
    initial_speed: float = 0.0,
    initial_angle: float = 0.0,
    steps_per_state: int = 16,
) -> RunUp:
    """Switch the drive on and follow it for `duration` s against a `load_torque` in N·m that brakes when positive.

    A step lasts at most 1/`steps_per_state` of a state of 60° and 1/(2·`steps_per_state`) of the time constant
    (L11 − L12)/R_11. In it the circuit is solved exactly at the speed of the step's middle, and the exact torque impulse
    moves the speed: an error of second order in the step. At the default 16 steps the shipped motor's run-up keeps
    within 2e-5 of its final speed. Friction and a braking load hold the
    rotor at rest but never turn it back. Raises SixStepError for arguments out of range.
    """
    for name, value in (("duration", duration), ("load_torque", load_torque), ("initial_speed", initial_speed)):
        if not math.isfinite(value):
            raise SixStepError(f"{name} is {value:g}: a finite number is needed")
    if duration <= 0 or initial_speed < 0 or steps_per_state < 1 or not 0 <= initial_angle < _STATE_ANGLE:
        raise SixStepError(
            f"run-up of {duration:g} s from {initial_speed:g} rad/s at {initial_angle:g} rad, {steps_per_state} steps a "
            "state: duration > 0, initial_speed ≥ 0, 0 ≤ initial_angle < π/3 and steps_per_state ≥ 1 are allowed"
        )
    drive = bridge.drive
    longest = (drive.self_inductance - drive.mutual_inductance) / drive.resistance / (2 * steps_per_state)
    largest_angle = _STATE_ANGLE / steps_per_state
    time, speed, angle, states = 0.0, initial_speed, initial_angle, 0
    currents = np.zeros(3)
    rows: list[tuple[float, float, float, Real, float]] = []
    while True:
        torque = _torque(bridge, currents, angle)
        rows.append((time, speed, states * _STATE_ANGLE + angle, _turned(currents, states), torque))
        if time >= duration:
            break
        step = min(longest, duration - time)
        middle = _next_speed(bridge, speed, torque, load_torque, 0.5 * step)
        electrical = drive.pole_pairs * max(middle, speed)
        if electrical * step > largest_angle:
            step = largest_angle / electrical
            middle = _next_speed(bridge, speed, torque, load_torque, 0.5 * step)
        turn = drive.pole_pairs * middle * step
        reaches_end = angle + turn >= _STATE_ANGLE * (1 - 1e-12)
        if reaches_end and turn > 0:
            step *= min(1.0, (_STATE_ANGLE - angle) / turn)
            middle = _next_speed(bridge, speed, torque, load_torque, 0.5 * step)
        passage = bridge.run(currents, speed=middle, angle=angle, duration=step)
        average = sum(segment.torque_impulse() for segment in passage.segments) / step
        speed = _next_speed(bridge, speed, average, load_torque, step, at=middle)
        angle += drive.pole_pairs * middle * step
        currents = passage.end_currents
        time = duration if duration - time - step < 1e-12 * duration else time + step
        if angle >= _STATE_ANGLE * (1 - 1e-9):
            angle, states = max(angle - _STATE_ANGLE, 0.0), states + 1
            currents = previous_state(currents)
    times, speeds, angles, windings, torques = zip(*rows, strict=True)
    return RunUp(np.array(times), np.array(speeds), np.array(angles), np.column_stack(windings), np.array(torques))


def _next_speed(
    bridge: Bridge, speed: float, torque: float, load_torque: float, step: float, at: float | None = None
) -> float:
    drive = bridge.drive
    if speed == 0.0:
        # At rest friction and brake give only as much as the torque asks of them.
        surplus = torque - drive.coulomb_friction - load_torque
        return max(0.0, step * surplus / drive.inertia)
    resisting = drive.friction_torque(speed if at is None else at) + load_torque
    return max(0.0, speed + step * (torque - resisting) / drive.inertia)


def _torque(bridge: Bridge, currents: Real, angle: float) -> float:
    return float(currents @ bridge.emf_per_speed(angle))


def _turned(currents: Real, states: int) -> Real:
    for _ in range(states % 6):
        currents = next_state(currents)
    return currents
