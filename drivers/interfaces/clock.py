"""Time as a dependency: only a clock may wait."""

from collections.abc import Iterator
from typing import Protocol


class Clock(Protocol):
    """The bench's time, real or virtual."""

    def now(self) -> float:
        """Return the time, in seconds, of a clock that never steps back."""

    def sleep(self, seconds: float) -> None:
        """Wait for a time (s)."""


def polls(clock: Clock, timeout: float, interval: float) -> Iterator[bool]:
    """Yield once for each reading that is polled every `interval` (s), and say whether it is the last: `timeout` (s) has passed.

    Whoever polls ends the loop at the last. Time is read before the reading is, for a process may sleep between the two: a reading
    of before the end would be judged as the last.
    """
    end = clock.now() + timeout
    while True:
        yield clock.now() >= end
        clock.sleep(interval)


class OwnRamp:
    """Polls of a quantity that goes to its target along the instrument's own ramp, whose length nobody states.

    However long it takes, within each `timeout` it must come nearer by a share of the whole way.
    """

    _SHARE = 0.05

    def __init__(self, clock: Clock, timeout: float, interval: float) -> None:
        """Poll every `interval` (s); `timeout` (s) is the patience without progress."""
        self._clock, self._timeout, self._interval = clock, timeout, interval
        self._begin = clock.now()
        self._end = self._begin + timeout
        self._whole: float | None = None
        self._distance = 0.0
        self._due = False

    @property
    def elapsed(self) -> float:
        """Time since the ramp began (s)."""
        return self._clock.now() - self._begin

    def polls(self) -> Iterator[None]:
        """Yield once for each reading, without end."""
        while True:
            self._due = self._clock.now() >= self._end
            yield
            self._clock.sleep(self._interval)

    def stalled(self, distance: float) -> bool:
        """Return whether the reading just taken, this far from the target, has not come nearer for too long."""
        if self._whole is None:
            self._whole = self._distance = distance
        if not self._due:
            return False
        if self._distance - distance < self._SHARE * self._whole:
            return True
        self._distance, self._end = distance, self._clock.now() + self._timeout
        return False
