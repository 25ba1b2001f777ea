"""A virtual motor's true values by the names of measured parameters."""

import cmath
import math
from collections.abc import Sequence

from sim_instruments.physics.motor import VirtualMotor
from sim_instruments.six_step.drive import SixStepDrive
from sim_instruments.six_step.emf import mean_line_emf


def truth_of(motor: VirtualMotor, drive: SixStepDrive | None = None) -> dict[str, float]:
    """Return the true values in SI units, of the Y-equivalent where that matters; with a six-step drive also its own."""
    per_rpm = motor.back_emf_constant_mechanical * math.pi / 30.0
    of_drive: dict[str, float] = {}
    if drive is not None:
        of_drive = {"line_emf_constant": mean_line_emf(drive), "switch_resistance": drive.switch_resistance}
    return {
        "pole_pairs": float(motor.pole_pairs),
        "stator_resistance": motor.stator_resistance_y,
        "d_axis_inductance": motor.d_axis_inductance_y,
        "q_axis_inductance": motor.q_axis_inductance_y,
        "flux_linkage": motor.flux_linkage_y,
        "back_emf_constant_mechanical": motor.back_emf_constant_mechanical,
        "back_emf_constant_v_per_krpm": 1000.0 * per_rpm,
        "back_emf_constant_v_per_rpm": per_rpm,
        "torque_constant": motor.torque_constant,
        "inertia": motor.inertia,
        "coulomb_friction": motor.coulomb_friction,
        "viscous_friction": motor.viscous_friction,
        "resistance_unbalance": _unbalance(_line_resistances(motor)),
        "phase_order": -1.0 if motor.exchanged else 1.0,
        "insulation_resistance": motor.insulation_resistance,
        **_emf_shape(motor),
        **of_drive,
    }


def _emf_shape(motor: VirtualMotor) -> dict[str, float]:
    """Return what the three phases show against an artificial star; nothing of a delta of unlike windings, whose currents shift it."""
    alike = len(set(motor.emf_shares)) == 1
    if not alike and motor.connection == "delta":
        return {}
    fundamental = _against_star(motor, 1)
    harmonics = [(amplitude, _against_star(motor, order)) for order, amplitude, _ in motor.flux_harmonics]
    angles = [cmath.phase(phasor) for phasor in fundamental]
    spacings = [(angles[k] - angles[(k + 1) % 3]) % (2.0 * math.pi) for k in range(3)]
    distortions = [
        math.hypot(*(amplitude * abs(phasors[k]) for amplitude, phasors in harmonics)) / abs(fundamental[k])
        for k in range(3)
    ]
    return {
        "back_emf_unbalance": _unbalance([abs(phasor) for phasor in fundamental]),
        "back_emf_angle_deviation": max(abs(math.degrees(spacing) - 120.0) for spacing in spacings),
        "back_emf_thd": 100.0 * max(distortions),
    }


def _against_star(motor: VirtualMotor, order: int) -> list[complex]:
    """Return the phases' voltages of one harmonic against the artificial star, its amplitude in a winding being 1."""
    phases = [share * cmath.exp(-2j * math.pi / 3.0 * order * k) for k, share in enumerate(motor.emf_shares)]
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
