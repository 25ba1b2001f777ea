"""A virtual motor's true values by the names of measured parameters."""

import cmath
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from procedures.core.parameter_definition import ParameterDefinition, ParameterTable
from procedures.estimation.fitting.fit import FloatArray
from sim_instruments.physics.motor.flux_map import FluxMap
from sim_instruments.physics.motor.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.emf import mean_line_emf

_RPM = math.pi / 30.0


@dataclass(frozen=True)
class MeasuredAt:
    """What true values depend on: the q-axis currents (A, peak) of a torque constant, else none of a motor that saturates, and the
    frequency (Hz) of inductances beside closed circuits, 0 for slow changes.
    """

    torque_currents: Sequence[float] = ()
    inductance_frequency: float = 0.0


#: Without a torque's current, and for slow changes.
UNMEASURED = MeasuredAt()


def true_values(
    definitions: ParameterTable,
    motor: VirtualMotor,
    drive: SixStepDrive | None = None,
    at: MeasuredAt = UNMEASURED,
) -> dict[str, float]:
    """Return a virtual motor's true values by parameter, SI, of the Y-equivalent where that matters; a drive's own where it has one.

    Raises ValueError for a definition whose `true_value` names nothing.
    """
    torque_currents = at.torque_currents
    found = {each.name: _true_value(each, motor, drive) for each in definitions.values() if each.true_value}
    if motor.flux_map is not None and found.get("torque_constant") is not None and len(torque_currents) > 1:
        found["torque_constant"] = _torque_slope(motor, motor.flux_map, np.asarray(torque_currents))
    angular = 2.0 * math.pi * at.inductance_frequency
    for name, winding in (
        ("d_axis_inductance", motor.d_axis_inductance),
        ("q_axis_inductance", motor.q_axis_inductance),
    ):
        if (slow := found.get(name)) is not None:
            found[name] = slow * motor.iron.inductance_share(angular * winding)
    return {name: value for name, value in found.items() if value is not None}


def _torque_slope(motor: VirtualMotor, flux_map: FluxMap, currents: FloatArray) -> float:
    """Return the slope (N·m/A) of the torque over q-axis currents (A, peak), no current along the magnet."""
    flux, _ = flux_map.flux(np.zeros(currents.size), currents)
    return float(np.polyfit(currents, 1.5 * motor.pole_pairs * flux * currents, 1)[0])


def _true_value(definition: ParameterDefinition, motor: VirtualMotor, drive: SixStepDrive | None) -> float | None:
    owner, _, attribute = definition.true_value.rpartition(".")
    if owner == "drive" and drive is None:
        return None
    value: Any = None
    if owner in ("motor", "drive"):
        value = getattr(motor if owner == "motor" else drive, attribute, None)
    elif definition.true_value in _FORMULAS:
        return _FORMULAS[definition.true_value](motor, drive)
    if isinstance(value, int | float):
        return float(value)
    raise ValueError(
        f"parameter {definition.name}: true_value = {definition.true_value!r} is no number of the virtual motor (motor. …) or "
        f"drive (drive. …), and none of the formulas {', '.join(_FORMULAS)}"
    )


def _emf_shape(motor: VirtualMotor) -> tuple[float, float, float] | tuple[None, None, None]:
    """Return unbalance (%), deviation of the angles (°) and THD (%) that the three phases show against an artificial star.

    Nothing of a delta of unlike windings, whose currents shift it.
    """
    alike = len(set(_emf_shares(motor))) == 1
    if not alike and motor.connection == "delta":
        return None, None, None
    fundamental = _against_star(motor, 1)
    harmonics = [(amplitude, _against_star(motor, order)) for order, amplitude, _ in motor.flux_harmonics]
    angles = [cmath.phase(phasor) for phasor in fundamental]
    spacings = [(angles[k] - angles[(k + 1) % 3]) % (2.0 * math.pi) for k in range(3)]
    distortions = [
        math.hypot(*(amplitude * abs(phasors[k]) for amplitude, phasors in harmonics)) / abs(fundamental[k])
        for k in range(3)
    ]
    return (
        _unbalance([abs(phasor) for phasor in fundamental]),
        max(abs(math.degrees(spacing) - 120.0) for spacing in spacings),
        100.0 * max(distortions),
    )


def _emf_shares(motor: VirtualMotor) -> list[float]:
    return [emf * turns for emf, turns in zip(motor.emf_shares, motor.turn_shares, strict=True)]


def _against_star(motor: VirtualMotor, order: int) -> list[complex]:
    """Return the phases' voltages of one harmonic against the artificial star, its amplitude in a winding being 1."""
    phases = [share * cmath.exp(-2j * math.pi / 3.0 * order * k) for k, share in enumerate(_emf_shares(motor))]
    return [phase - sum(phases) / 3.0 for phase in phases]


def _line_resistances(motor: VirtualMotor) -> tuple[float, float, float]:
    """Return the resistances (Ω) AB, BC, CA; a delta's windings stand between the terminals in this order."""
    a, b, c = motor.phase_resistances
    if motor.connection == "wye":
        return a + b, b + c, c + a
    ring = a + b + c
    return a * (b + c) / ring, b * (c + a) / ring, c * (a + b) / ring


def _unbalance(lines: Sequence[float]) -> float:
    """Return the largest deviation from the mean, in per cent of it."""
    mean = sum(lines) / 3.0
    return 100.0 * max(abs(line / mean - 1.0) for line in lines)


Formula = Callable[[VirtualMotor, SixStepDrive | None], float | None]

#: Parameters that are no attribute of the virtual motor: None where it has none.
_FORMULAS: Mapping[str, Formula] = {
    "back_emf_constant_v_per_krpm": lambda motor, _: 1000.0 * _RPM * motor.back_emf_constant_mechanical,
    "back_emf_constant_v_per_rpm": lambda motor, _: _RPM * motor.back_emf_constant_mechanical,
    # Sinusoidal currents make torque with the mean of the phases' EMF.
    "torque_constant": lambda motor, _: motor.torque_constant * sum(_emf_shares(motor)) / 3.0,
    "resistance_unbalance": lambda motor, _: _unbalance(_line_resistances(motor)),
    "phase_order": lambda motor, _: -1.0 if motor.exchanged else 1.0,
    "back_emf_unbalance": lambda motor, _: _emf_shape(motor)[0],
    "back_emf_angle_deviation": lambda motor, _: _emf_shape(motor)[1],
    "back_emf_thd": lambda motor, _: _emf_shape(motor)[2],
    "line_emf_constant": lambda _, drive: None if drive is None else mean_line_emf(drive),
}
