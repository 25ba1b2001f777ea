"""Edge trigger: finds where a signal crosses a level, exactly, however late it is asked."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
Slope = Literal["POS", "NEG", "EITH"]

_REFINEMENTS = 4
_SUBDIVISIONS = 32
_CHUNK = 1 << 16


@dataclass(frozen=True)
class Edge:
    """An edge trigger's condition: `level` and `hysteresis` in the signal's unit."""

    level: float
    slope: Slope
    hysteresis: float


class EdgeFinder:
    """Looks through a signal in the order of time; between calls it remembers on which side the signal was."""

    def __init__(self, signal: Callable[[FloatArray], FloatArray], edge: Edge, start: float, step: float) -> None:
        self._signal = signal
        self._edge = edge
        self._time = start
        self._step = step
        self._side = 0

    @property
    def searched(self) -> float:
        """Time (s) up to which the signal has been looked through."""
        return self._time

    def first(self, until: float, since: float) -> float | None:
        """Return the first crossing at or after `since` that is not later than `until`."""
        while self._time < until:
            times = self._grid(until)
            for index in self._crossings(times):
                # A crossing lies between the sample before it and its own.
                if times[index] >= since and (time := self._refine(times, index)) >= since:
                    return time
        return None

    def last(self, until: float) -> float | None:
        """Return the last crossing not later than `until`."""
        result = None
        while self._time < until:
            times = self._grid(until)
            crossings = self._crossings(times)
            result = self._refine(times, crossings[-1]) if crossings else result
        return result

    def _grid(self, until: float) -> FloatArray:
        stop = min(until, self._time + _CHUNK * self._step)
        count = max(2, int(np.ceil((stop - self._time) / self._step)) + 1)
        return np.linspace(self._time, stop, count)

    def _crossings(self, times: FloatArray) -> list[int]:
        """Return the numbers of the times at which the signal has just crossed."""
        edge = self._edge
        values = self._signal(times)
        self._time = float(times[-1])
        sides = np.zeros(len(values) + 1, dtype=np.int8)
        sides[0] = self._side
        # A side counts from beyond the hysteresis away from the level, the other one from the level on.
        if edge.slope == "NEG":
            sides[1:][values > edge.level + edge.hysteresis] = 1
            sides[1:][values <= edge.level] = -1
        elif edge.slope == "POS":
            sides[1:][values < edge.level - edge.hysteresis] = -1
            sides[1:][values >= edge.level] = 1
        else:
            sides[1:][values < edge.level - edge.hysteresis / 2.0] = -1
            sides[1:][values > edge.level + edge.hysteresis / 2.0] = 1
        known = np.maximum.accumulate(np.where(sides != 0, np.arange(len(sides)), 0))
        sides = sides[known]
        self._side = int(sides[-1])
        change = sides[1:].astype(np.int16) - sides[:-1]
        wanted = {"POS": change == 2, "NEG": change == -2, "EITH": np.abs(change) == 2}[edge.slope]
        return np.flatnonzero(wanted).tolist()

    def _refine(self, times: FloatArray, index: int) -> float:
        low, high = float(times[max(index - 1, 0)]), float(times[index])
        for _ in range(_REFINEMENTS):
            if high <= low:
                break
            inner = np.linspace(low, high, _SUBDIVISIONS + 1)
            above = self._signal(inner) >= self._edge.level
            changed = np.flatnonzero(above[1:] != above[:-1])
            if len(changed) == 0:
                break
            low, high = float(inner[changed[0]]), float(inner[changed[0] + 1])
        return 0.5 * (low + high)
