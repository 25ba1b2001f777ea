"""Bench time that goes with the wall's, for clients in other processes."""

import heapq
import itertools
import math
import threading
import time
from collections.abc import Callable

#: Bench seconds that may pass in a second.
SLOWEST, FASTEST = 0.1, 1000.0


class PacedClock:
    """A clock that starts at 0 s and runs `speedup` times as fast as real time; waiting does not advance it.

    Whoever serves the bench calls `pulse` again and again: time has nobody else to tell that it goes on. Where the bench is behind
    its time it stands still, so that a machine which cannot keep up has a slower bench, and never more and more to make up for.
    Raises ValueError for a `speedup` outside 0.1 … 1000.
    """

    def __init__(self, speedup: float = 1.0, wall: Callable[[], float] = time.monotonic) -> None:
        if not SLOWEST <= speedup <= FASTEST:
            raise ValueError(f"a speed-up of {speedup:g} is outside {SLOWEST:g} … {FASTEST:g}")
        self.speedup = speedup
        self._wall = wall
        self._start = wall()
        self._latest = math.inf
        self._callbacks: list[Callable[[float], None]] = []
        self._alarms: list[tuple[float, int, Callable[[], None]]] = []
        self._order = itertools.count()
        self._lock = threading.Lock()
        self._closed = threading.Event()

    def now(self) -> float:
        """Return the bench time (s)."""
        return min((self._wall() - self._start) * self.speedup, self._latest)

    def sleep(self, seconds: float) -> None:
        """Wait for bench time (s); a closed clock no longer waits. Raises ValueError for a negative or non-finite time."""
        if not 0.0 <= seconds < math.inf:
            raise ValueError(f"cannot sleep {seconds} s: the time must be finite and not negative")
        end = self.now() + seconds
        while (left := end - self.now()) > 0.0:
            if self._closed.wait(left / self.speedup):
                return

    def on_advance(self, callback: Callable[[float], None]) -> Callable[[], None]:
        """Run `callback(time)` at every pulse, on the thread that gives it; the function returned undoes it."""
        self._callbacks.append(callback)

        def remove() -> None:
            if callback in self._callbacks:
                self._callbacks.remove(callback)

        return remove

    def call_at(self, time: float, callback: Callable[[], None]) -> Callable[[], None]:
        """Run `callback` at the first pulse from `time` (s) on; the function returned undoes it."""
        alarm = (time, next(self._order), callback)
        with self._lock:
            heapq.heappush(self._alarms, alarm)

        def cancel() -> None:
            with self._lock:
                if alarm in self._alarms:
                    self._alarms.remove(alarm)
                    heapq.heapify(self._alarms)

        return cancel

    def pulse(self, *, behind: bool = False) -> None:
        """Tell those who follow the time what it is, and run what is due.

        Time stands still until the next pulse where the bench is `behind`.
        """
        now = self._go_on(behind=behind)
        while (alarm := self._due(now)) is not None:
            alarm()
        for callback in list(self._callbacks):
            callback(now)

    def _go_on(self, *, behind: bool) -> float:
        """Return the time (s), from which it goes on unless the bench is behind it."""
        paced = (self._wall() - self._start) * self.speedup
        now = min(paced, self._latest)
        # Before `_latest`: whoever asks between the two must not see time go on by both.
        self._start += (paced - now) / self.speedup
        self._latest = now if behind else math.inf
        return now

    def _due(self, now: float) -> Callable[[], None] | None:
        with self._lock:
            return heapq.heappop(self._alarms)[2] if self._alarms and self._alarms[0][0] <= now else None

    def close(self) -> None:
        """Wake up all waiting participants at the end."""
        self._closed.set()
