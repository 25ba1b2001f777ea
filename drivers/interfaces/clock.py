"""Time as a dependency: only a clock may wait."""

from typing import Protocol


class Clock(Protocol):
    """The bench's time, real or virtual."""

    def now(self) -> float:
        """Return the time, in seconds, of a clock that never steps back."""

    def sleep(self, seconds: float) -> None:
        """Wait for a time (s)."""
