"""Gains of a current loop by pole cancellation: kp = omega L, ki = omega R, omega the loop's bandwidth in rad/s.

The loop then closes as a first-order lag of that bandwidth. A firmware that integrates ki times the error over time wants these.
"""

import math

from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.parameters import PARAMETERS
from reports.exports.quantities import ExportQuantity, Fixed

#: What VESC Tool (1000 us) and ODrive (1000 rad/s) begin with (Hz).
DEFAULT_BANDWIDTH = 1000.0 / (2.0 * math.pi)

#: What a sampled loop computes is put out a sample later and held for another: one and a half periods between current and voltage.
_DELAY = 1.5
#: A bandwidth above this share of the sampling rate makes a loop with that delay overshoot (crossover × delay above 1/e).
LARGEST_SHARE = 1.0 / 15.0

_R, _D, _Q = (PARAMETERS[name] for name in ("stator_resistance", "d_axis_inductance", "q_axis_inductance"))


def crossover(bandwidth: float, loop_rate: float) -> float:
    """Return the frequency (Hz) whose gains give a loop sampled at `loop_rate` (Hz) a bandwidth (Hz, −3 dB).

    With φ the delay's phase at the bandwidth, |G/(1 + G)|² = 1/2 for G = (a/j)·e^(−jφ) is a² + 2a·sin φ = 1. Raises ValueError where
    the bandwidth is not above 0 and up to `LARGEST_SHARE` of the rate.
    """
    if not 0.0 < bandwidth <= LARGEST_SHARE * loop_rate:
        raise ValueError(f"a bandwidth of {bandwidth:g} Hz is not within 0 … {LARGEST_SHARE * loop_rate:g} Hz")
    lag = math.sin(2.0 * math.pi * bandwidth * _DELAY / loop_rate)
    return bandwidth * (math.sqrt(1.0 + lag**2) - lag)


def proportional_d(bandwidth: float) -> ExportQuantity:
    """Return kp (V/A) of the d axis for a bandwidth (Hz)."""
    return _gain("V/A", bandwidth, "Ld", _D)


def proportional_q(bandwidth: float) -> ExportQuantity:
    """Return kp (V/A) of the q axis for a bandwidth (Hz)."""
    return _gain("V/A", bandwidth, "Lq", _Q)


def proportional_mean(bandwidth: float) -> ExportQuantity:
    """Return kp (V/A) of a controller with one gain for both axes, for a bandwidth (Hz)."""
    return _gain("V/A", bandwidth, "(Ld + Lq)/2", _D, _Q)


def integral(bandwidth: float) -> ExportQuantity:
    """Return ki (V/(A s)) for a bandwidth (Hz)."""
    return _gain("V/(A*s)", bandwidth, "R at 25 degC", _R)


def _gain(unit: str, bandwidth: float, of: str, *parameters: ParameterDefinition) -> ExportQuantity:
    """Return the bandwidth (rad/s) times the mean of the parameters."""
    omega = 2.0 * math.pi * bandwidth / len(parameters)
    return ExportQuantity(
        unit,
        f"2 pi {bandwidth:.4g} Hz times {of}",
        parameters,
        lambda given: omega * sum(given[each.name] for each in parameters),
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
