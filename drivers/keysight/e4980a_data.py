"""Limits and basic accuracy of the Keysight E4980A and E4980AL (data sheet 5989-4435)."""

import math
from bisect import bisect_left
from collections.abc import Sequence

from drivers.interfaces import Aperture

#: Where the figures below stand.
SOURCE = "Keysight E4980A/E4980AL data sheet 5989-4435, basic accuracy"

#: Lowest test frequency (Hz) of every model.
MINIMUM_FREQUENCY = 20.0
#: Highest test frequency (Hz) of the E4980A, and of the E4980AL by frequency option (data sheet, "Options").
E4980A_MAXIMUM_FREQUENCY = 2e6
E4980AL_MAXIMUM_FREQUENCY = {"032": 300e3, "052": 500e3, "102": 1e6}
#: Test level (V rms) without the power and bias option (data sheet, "Test signal level").
MAXIMUM_LEVEL = 2.0
#: Output impedance (Ω) of the test signal (data sheet, "Test signal").
SOURCE_IMPEDANCE = 100.0

#: The formulas below hold up to this frequency (Hz): beyond it, Yo has other columns.
MAXIMUM_STATED_FREQUENCY = 100e3

#: Upper ends (V rms) of the columns of test levels; a level on an end takes the better column.
LEVEL_ENDS = (0.05, 0.3, 1.0, 10.0)
#: Basic accuracy Ab (%) by column, below and from the frequency (Hz) where the row changes. The first column's
#: figure is multiplied by its reference level over the level.
BASIC = {
    True: (125.0, 0.05, (0.60, 0.60, 0.30, 0.30), (0.20, 0.20, 0.10, 0.15)),  # aperture SHORT
    False: (100.0, 0.03, (0.25, 0.25, 0.10, 0.15), (0.10, 0.10, 0.05, 0.10)),  # MEDIUM and LONG
}

#: Impedance (Ω) at which the short offset changes.
SHORT_OFFSET_CHANGE = 1.08


def basic_accuracy(frequency: float, level: float, aperture: Aperture) -> float:
    """Return Ab, relative, at a frequency (Hz) and level (V rms); the best of adjoining columns on their border."""
    change, reference, low, high = BASIC[aperture is Aperture.SHORT]
    rows: Sequence[Sequence[float]] = [low] if frequency < change else [high]
    first = bisect_left(LEVEL_ENDS, level * (1 - 1e-9))
    columns = {min(first, 3), min(bisect_left(LEVEL_ENDS, level * (1 + 1e-9)), 3)}

    def percent(row: Sequence[float], column: int) -> float:
        return row[column] * (reference / level if column == 0 else 1.0)

    return min(percent(row, column) for row in rows for column in columns) / 100


def short_offset(impedance: float, frequency: float, level: float, aperture: Aperture) -> float:
    """Return Zs (Ω) for a magnitude of impedance (Ω), at a frequency (Hz) and level (V rms)."""
    short = aperture is Aperture.SHORT
    if impedance > SHORT_OFFSET_CHANGE:
        offset, reference = (2.5e-3 if short else 0.6e-3), 0.400
    else:
        offset, reference = (1.0e-3 if short else 0.2e-3), 1.0
    return offset * (1 + reference / level) * (1 + math.sqrt(1000 / frequency))


def open_offset(frequency: float, level: float, aperture: Aperture) -> float:
    """Return Yo (S) at a frequency (20 Hz … 100 kHz) and level (V rms, at most 2)."""
    offset = 2e-9 if aperture is Aperture.SHORT else 0.5e-9
    return offset * (1 + 0.100 / level) * (1 + math.sqrt(100 / frequency))
