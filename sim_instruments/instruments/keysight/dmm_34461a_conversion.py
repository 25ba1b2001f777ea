"""One conversion of the 34461A: range, overload, the unit's own errors, noise (Keysight 5991-1983EN, Truevolt guide)."""

import math

import numpy as np

from sim_instruments.instruments.errors import VoltmeterErrors

RANGES = (0.1, 1.0, 10.0, 100.0, 1000.0)
OVERLOAD = 9.9e37
LINE_CYCLE = 0.02  # s, at 50 Hz
#: Power-line cycles of integration, and the resolution that they give relative to the range.
RESOLUTIONS = {0.02: 1.0e-4, 0.2: 1.0e-5, 1.0: 3.0e-6, 10.0: 1.0e-6, 100.0: 3.0e-7}
# Readings repeat within about twice the resolution.
_NOISE_SHARE = 0.3
_OVER_RANGE = 1.2
_UP, _DOWN = 1.2, 0.1


def range_for(voltage: float) -> float:
    """Return the smallest range (V) that holds a voltage (V), at most the highest one."""
    return next((entry for entry in RANGES if entry >= abs(voltage) * (1.0 - 1e-12)), RANGES[-1])


def cycles_for(wanted: float) -> float:
    """Return the fewest power-line cycles on offer that are not below the ones wanted."""
    return next((cycles for cycles in RESOLUTIONS if cycles >= wanted * (1.0 - 1e-9)), max(RESOLUTIONS))


def cycles_for_resolution(relative: float) -> float | None:
    """Return the fewest power-line cycles that resolve a share of the range, None where none do."""
    return next((cycles for cycles, finest in RESOLUTIONS.items() if finest <= relative * (1.0 + 1e-9)), None)


def ranged(present: float, voltage: float) -> float:
    """Return the range (V) in which autoranging, coming from the present one, converts a voltage (V)."""
    if _DOWN * present <= abs(voltage) <= _UP * present:
        return present
    return next((entry for entry in RANGES if abs(voltage) <= _UP * entry), RANGES[-1])


def convert(
    voltage: float, full_scale: float, cycles: float, unit: VoltmeterErrors, generator: np.random.Generator
) -> float:
    """Return the reading (V) of a mean voltage (V) in a range (V), ±9.9E37 beyond it."""
    index = RANGES.index(full_scale)
    deviation = _NOISE_SHARE * RESOLUTIONS[cycles] * full_scale
    reading = voltage * (1.0 + unit.gain[index]) + unit.offset[index] * full_scale
    reading += float(generator.normal(0.0, deviation))
    # 1000 V is the input's limit too, so the highest range has nothing above it.
    limit = full_scale if full_scale == RANGES[-1] else _OVER_RANGE * full_scale
    return reading if abs(reading) <= limit else math.copysign(OVERLOAD, reading)
