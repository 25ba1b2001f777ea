"""The time of a virtual bench that another process serves."""

import time

from bench.safety.interrupts import Interrupts


class ServedClock:
    """Runs `speedup` times as fast as the wall's clock, from bench time `now` (s) on, as the bench's own does.

    Whoever sleeps, hands among them, is woken where a stop is requested of `interrupts`.
    """

    def __init__(self, now: float, speedup: float, interrupts: Interrupts | None = None) -> None:
        self._interrupts = interrupts or Interrupts()
        self._begin = now
        self._speedup = speedup
        self._start = time.monotonic()

    def now(self) -> float:
        """Return the bench time (s)."""
        return self._begin + (time.monotonic() - self._start) * self._speedup

    def sleep(self, seconds: float) -> None:
        """Wait for bench time (s)."""
        if seconds > 0.0:
            with self._interrupts.waiting():
                time.sleep(seconds / self._speedup)  # noqa: TID251  a clock of its own, for a bench's own time
