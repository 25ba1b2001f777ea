"""Ranges and accuracy of the insulation test of the GW Instek GPT-9803 and GPT-9804 (GPT-9800 Series)."""

from drivers.interfaces import Accuracy

SOURCE = "GPT-9800 Series specification as resellers quote it, not compared with the maker's; enter a calibration"

#: Test voltages (V).
LOWEST_VOLTAGE, HIGHEST_VOLTAGE, VOLTAGE_STEP = 50.0, 1000.0, 50.0
#: Times of a test and of its ramp (s).
SHORTEST_TEST, LONGEST_TEST = 1.0, 999.9
SHORTEST_RAMP, LONGEST_RAMP = 0.1, 999.9

MEGOHM = 1e6
#: One digit, and the largest resistance shown (Ω): that and what is larger cannot be told apart.
RESOLUTION, LARGEST = 1.0 * MEGOHM, 9999.0 * MEGOHM
#: From this test voltage (V) on the first range ends higher; below it and from it on: where it ends (Ω).
_HIGH_TEST = 500.0
_FIRST_RANGE_ENDS = (50.0 * MEGOHM, 500.0 * MEGOHM)
_FIRST, _SECOND = 0.05, 0.10
#: The voltage itself is right to this share and this much (V), without load.
VOLTAGE_GAIN, VOLTAGE_OFFSET = 0.01, 5.0
#: No more than this (V) is dangerous to touch (IEC 61010-1, dry, DC 60 V; half of it).
HARMLESS = 30.0


def stated_accuracy(resistance: float, voltage: float) -> Accuracy:
    """Return the limits of error of a resistance (Ω) read at a test voltage (V)."""
    first = resistance <= _FIRST_RANGE_ENDS[voltage >= _HIGH_TEST]
    return Accuracy(gain=_FIRST if first else _SECOND, offset=RESOLUTION, resolution=RESOLUTION, source=SOURCE)
