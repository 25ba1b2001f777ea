"""What a file's numbers say of how they were made: the converter's step, the last digit, and a rounding that no noise averages out.

Rigol's DS1000Z writes three digits ("4.72e+01"; sources: exports that users show in their programs, of one layout, by several hands):
steps of 0.08 V are told apart at 12 V, but each of them is off by up to 0.05 V.
"""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
#: As many digits as any instrument reads, and as many numbers as show a column's.
_DIGITS, _DIGITS_SEEN = 9, 1000
#: Numbers of so many digits are rounded by less than any fit of a record sees.
_ENOUGH = 7
#: A number is a multiple of its last place, and a gap one of the step, up to so much of it.
_SAME = 1e-6
#: A level that so many readings have is one of the converter's; noise leaves none between two of these empty.
_TAKEN = 50


def steps_and_rounding(values: FloatArray) -> tuple[float, float]:
    """Return the step that all values are multiples of apart, as a converter leaves it, 0 where there is none; and the half-width, as a
    share of the large values, of the error of their mean by what they were rounded to in the file, 0 where they hold the steps as they are.

    A converter's level has one rounding error, however often it is read: only different levels average it out.
    """
    levels, counts = np.unique(values, return_counts=True)
    if levels.size < 2 or levels.size > min(4096, max(values.size // 3, 2)):
        # Where each is read once or twice, their rounding is part of their scatter.
        return 0.0, 0.0
    gaps = np.diff(levels)
    multiples = gaps / np.min(gaps)
    off = float(np.max(np.abs(multiples - np.round(multiples))))
    step = float(np.min(gaps)) if off < 0.1 else 0.0
    large = (np.abs(levels) >= 0.5 * np.max(np.abs(levels))) & (levels != 0.0)
    levels, weights = levels[large], counts[large] / np.sum(counts[large])
    places = _last_places(levels)
    if not places.size or (off < _SAME * np.max(multiples) and _are_steps(levels, counts[large], step, places)):
        return step, 0.0
    return step, float(0.5 * np.sqrt(weights**2 @ places**2 / (weights @ levels**2)))


def last_digit(values: FloatArray) -> float:
    """Return the place of the last decimal digit of a column's numbers, in their unit: no less than the ninth of the largest one, for
    instruments read no more; what has more was computed.
    """
    few = values[:: max(1, values.size // _DIGITS_SEEN)]
    largest = float(np.max(np.abs(few), initial=0.0))
    if not largest > 0.0:
        return 0.0
    place = 10.0 ** np.floor(np.log10(largest))
    for _ in range(_DIGITS - 1):
        if np.all(np.abs(few / place - np.round(few / place)) < _SAME):
            break
        place /= 10.0
    return float(place)


def _last_places(levels: FloatArray) -> FloatArray:
    """Return what each of these numbers (none is 0) was rounded to, all being written with so many digits; none where they have enough."""
    tops = 10.0 ** np.floor(np.log10(np.abs(levels)) + _SAME)
    fixed = last_digit(levels)
    for digits in range(_ENOUGH - 1):
        mantissas = np.abs(levels) / tops * 10.0**digits
        if np.all(np.abs(mantissas - np.round(mantissas)) < _SAME * mantissas):
            return np.maximum(tops / 10.0**digits, fixed)
    return np.empty(0)


def _are_steps(levels: FloatArray, counts: NDArray[np.int64], step: float, places: FloatArray) -> bool:
    """Return whether evenly spaced levels are a converter's steps, and not steps of a place and a half that were rounded to one or two."""
    if step > 1.5 * np.max(places):
        return True
    apart = np.diff(levels) / step
    full = (counts[:-1] >= _TAKEN) & (counts[1:] >= _TAKEN)
    # A level that is empty between full ones is none that noise leaves.
    return not np.any(full & (np.abs(apart - 2.0) < 0.1))
