"""One conversion of the 34461A: range, overload, the unit's own errors, noise (Keysight 5991-1983EN, Truevolt guide)."""

import math

import numpy as np

from sim_instruments.instruments.errors import VoltmeterErrors
from sim_instruments.instruments.keysight.dmm_34461a.functions import Function

OVERLOAD = 9.9e37
LINE_CYCLE = 0.02  # s, at 50 Hz
#: Power-line cycles of integration, and the resolution that they give relative to the range.
RESOLUTIONS = {0.02: 1.0e-4, 0.2: 1.0e-5, 1.0: 3.0e-6, 10.0: 1.0e-6, 100.0: 3.0e-7}
#: What is not integrated over power-line cycles is always told to 6½ digits.
FIXED_RESOLUTION = 1.0e-6
# Readings repeat within about twice the resolution.
_NOISE_SHARE = 0.3
_OVER_RANGE = 1.2
_UP, _DOWN = 1.2, 0.1


def range_for(value: float, ranges: tuple[float, ...]) -> float:
    """Return the smallest range that holds a value, at most the highest one."""
    return next((entry for entry in ranges if entry >= abs(value) * (1.0 - 1e-12)), ranges[-1])


def cycles_for(wanted: float) -> float:
    """Return the fewest power-line cycles on offer that are not below the ones wanted."""
    return next((cycles for cycles in RESOLUTIONS if cycles >= wanted * (1.0 - 1e-9)), max(RESOLUTIONS))


def cycles_for_resolution(relative: float) -> float | None:
    """Return the fewest power-line cycles that resolve a share of the range, None where none do."""
    return next((cycles for cycles, finest in RESOLUTIONS.items() if finest <= relative * (1.0 + 1e-9)), None)


def ranged(present: float, value: float, ranges: tuple[float, ...]) -> float:
    """Return the range in which autoranging, coming from the present one, converts a value."""
    if _DOWN * present <= abs(value) <= _UP * present:
        return present
    return next((entry for entry in ranges if abs(value) <= _UP * entry), ranges[-1])


def convert(
    value: float,
    function: Function,
    full_scale: float,
    resolution: float,
    unit: VoltmeterErrors,
    generator: np.random.Generator,
) -> float:
    """Return the reading of a value in a range at a resolution (share of the range), ±9.9E37 beyond it."""
    gain, offset = function.errors(function.ranges.index(full_scale), unit)
    noise = float(generator.normal(0.0, _NOISE_SHARE * resolution * full_scale))
    if not math.isfinite(value):
        return math.copysign(OVERLOAD, value)
    if function.kind == "count":
        # The range is that of the voltage, which the figure does not follow.
        return value * (1.0 + gain + noise / full_scale)
    if function.kind == "rms":
        # Its own noise adds to what is squared, and what is squared has no sign.
        reading = math.hypot(value * (1.0 + gain), offset * full_scale, noise)
    else:
        reading = value * (1.0 + gain) + offset * full_scale + noise
    limit = full_scale * (function.highest_share if full_scale == function.ranges[-1] else _OVER_RANGE)
    return reading if abs(reading) <= limit else math.copysign(OVERLOAD, reading)
