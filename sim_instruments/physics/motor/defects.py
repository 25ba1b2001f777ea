"""Defects of a motor at the end of the line, as changes of a virtual one. Phases and windings are numbered 0, 1, 2."""

import math
from dataclasses import replace
from typing import Literal

from sim_instruments.physics.motor.hall import SimulatedHallSensors
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.physics.motor.shorted_turns import ShortedTurns

Three = tuple[float, float, float]


def bad_joint(motor: VirtualMotor, share: float, winding: int = 1) -> VirtualMotor:
    """Return the motor with a joint in one winding that adds this share of its resistance."""
    return replace(motor, phase_resistances=_changed(motor.phase_resistances, winding, 1.0 + share))


def missing_turns(motor: VirtualMotor, share: float, winding: int = 1) -> VirtualMotor:
    """Return the motor without this share of one winding's turns: R and EMF go with them, L with their square."""
    return replace(
        motor,
        phase_resistances=_changed(motor.phase_resistances, winding, 1.0 - share),
        turn_shares=_changed(motor.turn_shares, winding, 1.0 - share),
    )


def fewer_turns(motor: VirtualMotor, share: float) -> VirtualMotor:
    """Return the motor without this share of the turns of all windings, of the same wire."""
    a, b, c = motor.phase_resistances
    left = 1.0 - share
    return replace(rewound(motor, left), phase_resistances=(left * a, left * b, left * c))


def rewound(motor: VirtualMotor, ratio: float) -> VirtualMotor:
    """Return the motor with so many times its turns in all windings, of wire as much thinner: the same copper in the same slots."""
    a, b, c = motor.phase_resistances
    square = ratio**2
    return replace(
        motor,
        phase_resistances=(square * a, square * b, square * c),
        d_axis_inductance=square * motor.d_axis_inductance,
        q_axis_inductance=square * motor.q_axis_inductance,
        zero_sequence_inductance=square * motor.winding_zero_sequence_inductance,
        flux_linkage=ratio * motor.flux_linkage,
        flux_map=None if motor.flux_map is None else motor.flux_map.scaled(1.0 / ratio, ratio),
    )


def shorted_turns(motor: VirtualMotor, share: float, winding: int = 1, resistance: float = 0.0) -> VirtualMotor:
    """Return the motor with this share of one winding's turns shorted through a resistance (Ω)."""
    return replace(motor, shorted_turns=ShortedTurns(winding, share, resistance))


def weak_magnets(motor: VirtualMotor, share: float) -> VirtualMotor:
    """Return the motor whose magnets have all lost this share of their flux, as by heat."""
    return replace(motor, flux_linkage=(1.0 - share) * motor.flux_linkage)


def weak_pole(motor: VirtualMotor, share: float) -> VirtualMotor:
    """Return the motor one of whose poles has lost this share of its flux: 1 is a missing magnet, 2 one that was put in reversed.

    Holds for windings with a coil under every pole of a phase, all in series: each turn of the rotor sees every magnet the same
    way, and the lost half wave of flux (cosine over a pole, the return flux spread evenly) is in every electrical period. Of its series
    1/π + cos φ / 2 + 2/π·Σ (−1)^(k+1)·cos 2kφ / (4k² − 1) the fundamental and the even orders 2 and 4 are taken; they come
    on top of the motor's own harmonics. Raises ValueError for a motor that is left without a flux.
    """
    lost = share / motor.pole_pairs
    left = 1.0 - 0.5 * lost
    if left <= 0.0:
        raise ValueError(f"weak_pole(): {share:g} of a pole's flux is all that {motor.pole_pairs} pole pairs have")
    own = tuple((order, amplitude / left, phase) for order, amplitude, phase in motor.flux_harmonics)
    even = ((2, 4.0 / (3.0 * math.pi) * lost / left, math.pi), (4, 8.0 / (15.0 * math.pi) * lost / left, 0.0))
    return replace(motor, flux_linkage=left * motor.flux_linkage, flux_harmonics=(*own, *even))


def tight_bearing(motor: VirtualMotor, torque: float) -> VirtualMotor:
    """Return the motor whose bearings drag by a torque (N·m) more."""
    return replace(motor, coulomb_friction=motor.coulomb_friction + torque)


def cogging(motor: VirtualMotor, torque: float) -> VirtualMotor:
    """Return the motor with a cogging torque larger by an amplitude (N·m)."""
    return replace(motor, cogging_torque=motor.cogging_torque + torque)


def rubbing(motor: VirtualMotor, torque: float) -> VirtualMotor:
    """Return the motor whose rotor touches the stator once a turn, with a torque (N·m) at the most."""
    return replace(motor, rubbing_torque=torque)


def insulation(motor: VirtualMotor, resistance: float) -> VirtualMotor:
    """Return the motor with an insulation resistance (Ω)."""
    return replace(motor, insulation_resistance=resistance)


def other_poles(motor: VirtualMotor, more: int = 1) -> VirtualMotor:
    """Return a motor with so many more pole pairs and the same figures otherwise."""
    return replace(motor, pole_pairs=motor.pole_pairs + more)


def exchanged(motor: VirtualMotor) -> VirtualMotor:
    """Return the motor with the wires of two terminals exchanged."""
    return replace(motor, exchanged=("B", "C"))


def hall_missing(motor: VirtualMotor) -> VirtualMotor:
    """Return the motor without its Hall sensors: not fitted, or their connector off."""
    _halls(motor)
    return replace(motor, halls=None)


def hall_stuck(motor: VirtualMotor, level: Literal["low", "high"], sensor: int = 2) -> VirtualMotor:
    """Return the motor with a Hall sensor that no longer switches."""
    return replace(motor, halls=replace(_halls(motor), stuck=((sensor, level),)))


def hall_inverted(motor: VirtualMotor, sensor: int = 2) -> VirtualMotor:
    """Return the motor with a Hall sensor that sees the magnets the other way round."""
    return replace(motor, halls=replace(_halls(motor), inverted=(sensor,)))


def hall_exchanged(motor: VirtualMotor) -> VirtualMotor:
    """Return the motor with the leads of two Hall sensors exchanged."""
    return replace(motor, halls=replace(_halls(motor), order=(1, 3, 2)))


def hall_misplaced(motor: VirtualMotor, angle: float, sensor: int = 1) -> VirtualMotor:
    """Return the motor with one Hall sensor off its place by an electrical angle (rad)."""
    halls = _halls(motor)
    a, b, c = (place + angle * (k == sensor - 1) for k, place in enumerate(halls.placements))
    return replace(motor, halls=replace(halls, placements=(a, b, c)))


def hall_turned(motor: VirtualMotor, angle: float) -> VirtualMotor:
    """Return the motor with all Hall sensors together off their place by an electrical angle (rad)."""
    halls = _halls(motor)
    return replace(motor, halls=replace(halls, offset=halls.offset + angle))


def _halls(motor: VirtualMotor) -> SimulatedHallSensors:
    if motor.halls is None:
        raise ValueError("this motor has no Hall sensors")
    return motor.halls


def _changed(values: Three, at: int, factor: float) -> Three:
    a, b, c = (value * (factor if place == at else 1.0) for place, value in enumerate(values))
    return a, b, c
