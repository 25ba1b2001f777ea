"""A part of the bench's history, kept by a recording instrument."""

from bisect import bisect_right
from collections.abc import Callable, Sequence

import numpy as np

from sim_instruments.world.segment import Segment
from sim_instruments.world.settings import FloatArray

#: A quantity of a segment at n times, the last axis being time.
Quantity = Callable[[Segment, FloatArray], FloatArray]


class History:
    """Segments one after the other, up to `end` (s)."""

    def __init__(self, segments: Sequence[Segment], end: float) -> None:
        self._segments = segments
        self._starts = [segment.start for segment in segments]
        self._end = end

    def sample(self, quantity: Quantity, times: FloatArray) -> FloatArray:
        """Return a quantity (shape (…, n)) at n times (s, any order) of the stretch."""
        first, last = float(times.min()), float(times.max())
        low, high = (max(bisect_right(self._starts, time) - 1, 0) for time in (first, last))
        if low == high:
            return quantity(self._segments[low], np.minimum(times, self._end))
        index = np.searchsorted(np.array(self._starts[low + 1 : high + 1]), times, side="right")
        values = np.zeros(0)
        for number in np.flatnonzero(np.bincount(index)).tolist():
            chosen = index == number
            found = quantity(self._segments[low + number], np.minimum(times[chosen], self._end))
            if not values.size:
                values = np.zeros((*found.shape[:-1], len(times)))
            values[..., chosen] = found
        return values
