"""Delays of the guardian's own process: on a busy computer, the heartbeats of the run are delayed too."""

from collections import deque

#: Wakers are late by as much (s) on an idle computer.
_USUAL = 0.01


class Lateness:
    """Remembers by how much the guardian woke up after its time, over the last `window` seconds."""

    def __init__(self, window: float) -> None:
        self._window = window
        self._late: deque[tuple[float, float]] = deque()

    def woke(self, planned: float, now: float) -> None:
        """Note a wait that was planned to end at a time and ended now (s, monotonic), with nothing heard in between."""
        if now - planned > _USUAL:
            self._late.append((now, now - planned))

    def allowance(self, now: float) -> float:
        """Return the longest delay of the window (s), no more than the window itself."""
        while self._late and self._late[0][0] < now - self._window:
            self._late.popleft()
        return min(max((delay for _, delay in self._late), default=0.0), self._window)
