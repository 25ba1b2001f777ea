"""Measurements of a trace by an oscilloscope: levels, edges, times (IEEE 181's terms; programmer's guide, :MEASure)."""

import numpy as np
from numpy.typing import NDArray

#: Told of what a trace does not show.
NOT_MEASURABLE = 9.9e37
_BINS = 128
#: A level that fewer samples than this share are at is none; the extreme is taken for it.
_LEVEL_SHARE = 0.05
_HYSTERESIS = 0.1
_LOW, _MIDDLE, _HIGH = 0.1, 0.5, 0.9

FloatArray = NDArray[np.float64]


def base_and_top(signal: FloatArray) -> tuple[float, float]:
    """Return the two levels at which a trace mostly is; its extremes where it has none."""
    low, high = float(signal.min()), float(signal.max())
    if high <= low:
        return low, high
    counts, edges = np.histogram(signal, _BINS)
    centres, half = 0.5 * (edges[:-1] + edges[1:]), _BINS // 2
    found = []
    for part, extreme in ((slice(None, half), low), (slice(half, None), high)):
        most = int(np.argmax(counts[part]))
        found.append(float(centres[part][most]) if counts[part][most] >= _LEVEL_SHARE * len(signal) else extreme)
    return found[0], found[1]


def crossings(signal: FloatArray, share: float = _MIDDLE, *, rising: bool = True) -> FloatArray:
    """Return where (in samples) a trace goes through a share of its height, a tenth of it being hysteresis."""
    base, top = base_and_top(signal)
    if top <= base:
        return np.zeros(0)
    height = (signal - base) / (top - base)
    if not rising:
        height, share = 1.0 - height, 1.0 - share
    sides = np.where(height > share + _HYSTERESIS, 1, np.where(height < share - _HYSTERESIS, -1, 0))
    known = sides[np.maximum.accumulate(np.where(sides != 0, np.arange(len(sides)), 0))]
    arrived = np.flatnonzero((known[1:] > 0) & (known[:-1] < 0)) + 1
    result = []
    for end in arrived:
        below = np.flatnonzero(height[: end + 1] < share)
        if len(below):
            start = int(below[-1])
            step = height[start + 1] - height[start]
            result.append(start + (share - height[start]) / step)
    return np.array(result)


def edge_time(signal: FloatArray, *, rising: bool) -> float:
    """Return how long (samples) the first whole edge takes from 10 % to 90 %, or back."""
    first, last = (_LOW, _HIGH) if rising else (_HIGH, _LOW)
    begins, ends = (_plain(signal, share, rising=rising) for share in (first, last))
    for middle in crossings(signal, rising=rising):
        before, after = begins[begins <= middle], ends[ends >= middle]
        if len(before) and len(after):
            return float(after[0] - before[-1])
    return NOT_MEASURABLE


def _plain(signal: FloatArray, share: float, *, rising: bool) -> FloatArray:
    """Return where a trace goes through a share of its height, without hysteresis."""
    base, top = base_and_top(signal)
    height = (signal - base) / (top - base) if top > base else np.zeros_like(signal)
    before, after = height[:-1], height[1:]
    at = np.flatnonzero((before < share) & (after >= share) if rising else (before > share) & (after <= share))
    return at + (share - before[at]) / (after[at] - before[at])


def period(signal: FloatArray) -> float:
    """Return the mean period (samples)."""
    rising = crossings(signal)
    return float((rising[-1] - rising[0]) / (len(rising) - 1)) if len(rising) > 1 else NOT_MEASURABLE


def width(signal: FloatArray, *, positive: bool) -> float:
    """Return how long (samples) the first whole pulse stays above its middle, or below."""
    begins, ends = crossings(signal, rising=positive), crossings(signal, rising=not positive)
    for begin in begins:
        after = ends[ends > begin]
        if len(after):
            return float(after[0] - begin)
    return NOT_MEASURABLE


def duty_cycle(signal: FloatArray) -> float:
    """Return the share (%) of a period that a trace stays above its middle."""
    high, whole = width(signal, positive=True), period(signal)
    return NOT_MEASURABLE if NOT_MEASURABLE in (high, whole) else 100.0 * high / whole


def overshoot(signal: FloatArray) -> float:
    """Return by how much (% of its height) a trace goes beyond its top."""
    base, top = base_and_top(signal)
    return 100.0 * (float(signal.max()) - top) / (top - base) if top > base else NOT_MEASURABLE


def preshoot(signal: FloatArray) -> float:
    """Return by how much (% of its height) a trace goes below its base."""
    base, top = base_and_top(signal)
    return 100.0 * (base - float(signal.min())) / (top - base) if top > base else NOT_MEASURABLE


def delay(first: FloatArray, second: FloatArray) -> float:
    """Return the time (samples) from the first rising edge of one trace to the closest one of another."""
    from_, to = crossings(first), crossings(second)
    if not len(from_) or not len(to):
        return NOT_MEASURABLE
    return float(to[np.argmin(np.abs(to - from_[0]))] - from_[0])


def phase(first: FloatArray, second: FloatArray) -> float:
    """Return the delay between two traces in degrees of the first one's period."""
    late, whole = delay(first, second), period(first)
    return NOT_MEASURABLE if NOT_MEASURABLE in (late, whole) else 360.0 * late / whole
