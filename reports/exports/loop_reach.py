"""The possible deviation of a current loop's bandwidth, by the uncertainty of R and L.

kp = omega L and ki = omega R cancel the motor's pole where R and L are the motor's own. Where the pole R/L lies above the bandwidth, an
error of R moves the loop as much as one of L does elsewhere.
"""

import math
from collections.abc import Iterator, Mapping

from drivers.interfaces.text import text
from procedures.core.result import Notice, Parameter

#: A bandwidth that may be off by more than this share is told.
_TOLD = 0.1
_AXES = ("d", "q")


def closed_bandwidth(kp: float, ki: float, resistance: float, inductance: float) -> float:
    """Return the −3 dB frequency (rad/s) of kp·e + ∫ki·e dt on a winding of a resistance (Ω) and an inductance (H)."""
    # |G/(1 + G)|² = 1/2 is quadratic in the square of the frequency.
    half = 0.5 * ((resistance + kp) ** 2 - 2.0 * ki * inductance - 2.0 * kp**2)
    return math.sqrt(math.sqrt(half**2 + (inductance * ki) ** 2) - half) / inductance


def bandwidth_notices(parameters: Mapping[str, Parameter], bandwidth: float) -> Iterator[Notice]:
    """Yield a warning where a loop of a `bandwidth` (Hz) may be off by more than a tenth: of the axis it is worse on, with what to do."""
    told = [notice for axis in _AXES if (notice := _notice(parameters, bandwidth, axis))]
    if told:
        yield max(told, key=lambda one: one[0])[1]


def _notice(parameters: Mapping[str, Parameter], bandwidth: float, axis: str) -> tuple[float, Notice] | None:
    """Return by how much (share) an axis' bandwidth may be off and what is said of it, None where that is little."""
    resistance, inductance = parameters.get("stator_resistance"), parameters.get(f"{axis}_axis_inductance")
    if resistance is None or inductance is None or min(resistance.value, inductance.value) <= 0.0:
        return None
    by_resistance = _reach(resistance.value, inductance.value, bandwidth, resistance.coverage_interval, None)
    by_inductance = _reach(resistance.value, inductance.value, bandwidth, None, inductance.coverage_interval)
    low, high = (a * b / bandwidth for a, b in zip(by_resistance, by_inductance, strict=True))
    off = max(high / bandwidth - 1.0, 1.0 - low / bandwidth)
    if off <= _TOLD:
        return None
    more = by_resistance[1] - by_resistance[0] > by_inductance[1] - by_inductance[0]
    cause = resistance if more else inductance
    sentence = text(
        "the {axis} axis' current loop, designed for {bandwidth:.4g} Hz, may have {low:.4g} to {high:.4g} Hz: "
        "{name} is known to ±{share:.2g} % (95 %), and the winding's own pole lies at {pole:.4g} Hz; {remedy}",
        axis=axis,
        bandwidth=bandwidth,
        low=low,
        high=high,
        name=cause.label,
        share=50.0 * (cause.coverage_interval[1] - cause.coverage_interval[0]) / cause.value,
        pole=resistance.value / inductance.value / (2.0 * math.pi),
        remedy=text("measure it with four wires: stator-resistance-dc")
        if more
        else text("repeat it, or measure it by another procedure"),
    )
    return off, Notice("loop-bandwidth", sentence)


def _reach(
    resistance: float,
    inductance: float,
    bandwidth: float,
    resistances: tuple[float, float] | None,
    inductances: tuple[float, float] | None,
) -> tuple[float, float]:
    """Return the lowest and the highest bandwidth (Hz) on windings within these intervals, the gains being those of R (Ω) and L (H)."""
    omega = 2.0 * math.pi * bandwidth
    found = [
        closed_bandwidth(omega * inductance, omega * resistance, max(r, 0.0), each) / (2.0 * math.pi)
        for r in resistances or (resistance,)
        for each in inductances or (inductance,)
        if each > 0.0
    ]
    return min(found), max(found)
