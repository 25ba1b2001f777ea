"""The part of a back-EMF's record in which the speed changes little, for one that was taken while the motor ran down or up."""

import numpy as np

from bench.captures.written_digits import FloatArray

#: A crossing of zero counts once the voltage has been this far (effective values) below and above it.
_CLEAR = 0.3
#: Speeds whose fastest is so many times their slowest are taken in parts, and change by no more than this within one.
_UNSTEADY, _STEADY = 1.3, 1.15
#: No shaft changes its speed by so many times from one period to the next.
_NEXT = 1.6
#: A part of fewer periods tells no harmonics; a share of the periods on either side may be what noise makes of one.
_LEAST_PERIODS, _ODD = 4, 0.05


def steady_part(time: FloatArray, channels: FloatArray) -> tuple[float, float, float] | None:
    """Return begin and end (s) of the longest part, in periods, in which the speed changes little, and how many times the record's slowest
    speed its fastest is; None where all of the record (C, n) is such a part, or none is.
    """
    centred = channels - np.mean(channels, axis=1, keepdims=True)
    passed = _rising(time, centred[np.argmax(np.std(centred, axis=1))])
    if passed.size <= _LEAST_PERIODS:
        return None
    speeds = 1.0 / np.diff(passed)
    ratios = speeds[1:] / speeds[:-1]
    if np.min(ratios) < 1.0 / _NEXT or np.max(ratios) > _NEXT:
        # Noise crosses more often, and a dropout hides a crossing: such a record is taken whole.
        return None
    slowest, fastest = np.quantile(speeds, (_ODD, 1.0 - _ODD))
    if fastest < _UNSTEADY * slowest:
        return None
    best, first = (0, 0), 0
    for last in range(speeds.size):
        while np.max(speeds[first : last + 1]) > _STEADY * np.min(speeds[first : last + 1]):
            first += 1
        if last + 1 - first > best[1] - best[0]:
            best = first, last + 1
    if best[1] - best[0] < _LEAST_PERIODS:
        return None
    return float(passed[best[0]]), float(passed[best[1]]), float(fastest / slowest)


def _rising(time: FloatArray, values: FloatArray) -> FloatArray:
    """Return when a voltage (n,) rises through zero, noise at the crossing aside."""
    clear = _CLEAR * float(np.std(values))
    side = np.where(values > clear, 1, np.where(values < -clear, -1, 0))
    told = np.flatnonzero(side)
    turned = np.flatnonzero((side[told[:-1]] < 0) & (side[told[1:]] > 0))
    crossings = []
    for before, after in zip(told[turned], told[turned + 1], strict=True):
        # A line through all between the two sides: single readings there are noise.
        slope, level = np.polyfit(time[before : after + 1] - time[before], values[before : after + 1], 1)
        crossings.append(time[before] + min(max(-level / slope, 0.0), time[after] - time[before]))
    return np.array(crossings)
