"""A virtual motor's true values by the names of measured parameters."""

import math

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
        "phase_order": 1.0,
        "back_emf_unbalance": 0.0,
        "back_emf_angle_deviation": 0.0,
        "back_emf_thd": 100.0 * math.hypot(*(a for order, a, _ in motor.flux_harmonics if order % 3)),
        **of_drive,
    }


def _line_resistances(motor: VirtualMotor) -> tuple[float, float, float]:
    """Return the resistances (Ω) AB, BC, CA; a delta's windings stand between the terminals in this order."""
    a, b, c = motor.phase_resistances
    if motor.connection == "wye":
        return a + b, b + c, c + a
    ring = a + b + c
    return a * (b + c) / ring, b * (c + a) / ring, c * (a + b) / ring


def _unbalance(lines: tuple[float, float, float]) -> float:
    """Return the largest deviation from the mean, in per cent of it."""
    mean = sum(lines) / 3.0
    return 100.0 * max(abs(line / mean - 1.0) for line in lines)
