"""Gains of a current loop by pole cancellation: kp = omega L, ki = omega R, omega the loop's bandwidth in rad/s.

The loop then closes as a first-order lag of that bandwidth. A firmware that integrates ki times the error over time wants these.
"""

import math

from procedures.core.parameters import PARAMETERS
from reports.exports.quantities import ExportQuantity, Fixed

#: What VESC Tool (1000 us) and ODrive (1000 rad/s) begin with (Hz).
DEFAULT_BANDWIDTH = 1000.0 / (2.0 * math.pi)

_R, _D, _Q = (PARAMETERS[name] for name in ("stator_resistance", "d_axis_inductance", "q_axis_inductance"))


def proportional_d(bandwidth: float) -> ExportQuantity:
    """Return kp (V/A) of the d axis for a bandwidth (Hz)."""
    return ExportQuantity(
        "V/A",
        f"2 pi {bandwidth:.4g} Hz times Ld",
        (_D,),
        lambda g: 2.0 * math.pi * bandwidth * g["d_axis_inductance"],
    )


def proportional_q(bandwidth: float) -> ExportQuantity:
    """Return kp (V/A) of the q axis for a bandwidth (Hz)."""
    return ExportQuantity(
        "V/A",
        f"2 pi {bandwidth:.4g} Hz times Lq",
        (_Q,),
        lambda g: 2.0 * math.pi * bandwidth * g["q_axis_inductance"],
    )


def proportional_mean(bandwidth: float) -> ExportQuantity:
    """Return kp (V/A) of a controller with one gain for both axes, for a bandwidth (Hz)."""
    return ExportQuantity(
        "V/A",
        f"2 pi {bandwidth:.4g} Hz times (Ld + Lq)/2",
        (_D, _Q),
        lambda g: math.pi * bandwidth * (g["d_axis_inductance"] + g["q_axis_inductance"]),
    )


def integral(bandwidth: float) -> ExportQuantity:
    """Return ki (V/(A s)) for a bandwidth (Hz)."""
    return ExportQuantity(
        "V/(A*s)",
        f"2 pi {bandwidth:.4g} Hz times R at 25 degC",
        (_R,),
        lambda g: 2.0 * math.pi * bandwidth * g["stator_resistance"],
    )


def in_hertz(bandwidth: float) -> Fixed:
    """Return the bandwidth itself, Hz."""
    return Fixed(
        "Hz", "bandwidth of the current loop; the firmware forms kp = 2 pi f L and ki = 2 pi f R itself", bandwidth
    )


def in_radians(bandwidth: float) -> Fixed:
    """Return the bandwidth (Hz) in rad/s."""
    return Fixed(
        "rad/s",
        f"bandwidth of the current loop, 2 pi {bandwidth:.4g} Hz; the firmware forms kp = omega L and ki = omega R itself",
        2.0 * math.pi * bandwidth,
    )
