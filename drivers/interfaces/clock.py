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
