"""What a flux map of a motor of constant inductances says, against what is so."""

from collections.abc import Iterator

import numpy as np

from procedures.core.result import ProcedureResult
from sim_instruments.physics.motor.motor import VirtualMotor

#: An interval of a point is so many standard uncertainties on either side.
_WIDE = 1.96
_ANGLES = 20_001


def flux_at(motor: VirtualMotor, temperature: float) -> float:
    """Return the flux linkage (V·s) of magnets at a temperature (°C)."""
    return motor.flux_linkage_y * (
        1.0 + motor.flux_temperature_coefficient * (temperature - motor.resistance_temperature)
    )


def map_truth(motor: VirtualMotor, result: ProcedureResult, flux: float) -> dict[str, float]:
    """Return the true values of a map, the magnets linking a flux (V·s): that, the largest torque at its largest current, its angle (°)."""
    mtpa = result.findings.get("mtpa")
    if not mtpa:
        return {}
    beta = np.linspace(-0.5 * np.pi, 0.5 * np.pi, _ANGLES)
    i_d, i_q = -mtpa[-1]["current"] * np.sin(beta), mtpa[-1]["current"] * np.cos(beta)
    saliency = motor.d_axis_inductance_y - motor.q_axis_inductance_y
    torque = 1.5 * motor.pole_pairs * (flux + saliency * i_d) * i_q
    best = int(np.argmax(torque))
    return {
        "map_flux_linkage": flux,
        "mtpa_angle": float(np.degrees(beta[best])),
        "mtpa_torque": float(torque[best]),
    }


def point_errors(motor: VirtualMotor, result: ProcedureResult, flux: float) -> Iterator[tuple[str, float, float]]:
    """Yield each of the flux linkages of a map: name, error in half-widths of its interval, half-width relative to the largest."""
    for columns in result.findings.get("tables", {}).values():
        table = {name: np.array(values) for name, values in columns.items()}
        true = {
            "psi_d": flux + motor.d_axis_inductance_y * table["id_A"],
            "psi_q": motor.q_axis_inductance_y * table["iq_A"],
        }
        scale = max(float(np.max(np.abs(each))) for each in true.values())
        for name, truth in true.items():
            halves = _WIDE * table[f"u_{name}_Vs"]
            # ψ_q at no i_q is 0 by the frame's definition, and has no interval.
            for error, half in zip(np.abs(table[f"{name}_Vs"] - truth), halves, strict=True):
                if half > 0.0:
                    yield name, float(error / half), float(half / scale)
