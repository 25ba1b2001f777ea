"""Limits the duration of a scan, independent of libraries and instruments."""

import threading
from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import TypeVar

from drivers.interfaces import Clock

T = TypeVar("T")


class TimeBound:
    """A bound of so many seconds from now; no question is sent after it."""

    def __init__(self, clock: Clock, seconds: float) -> None:
        self._clock = clock
        self._end = clock.now() + seconds

    @property
    def left(self) -> float:
        """Seconds that are left, 0 where there are none."""
        return max(0.0, self._end - self._clock.now())

    def run(self, action: Callable[[], T], seconds: float) -> T:
        """Return what `action` returns within `seconds` and the bound.

        Raises TimeoutError where it does not, and what it raises. A library that hangs is left behind on a thread that dies with the
        process; Ctrl-C ends the waiting at once.
        """
        outcome: SimpleQueue[tuple[T, None] | tuple[None, Exception]] = SimpleQueue()

        def act() -> None:
            try:
                outcome.put((action(), None))
            except Exception as error:  # noqa: BLE001  it is raised again where it is waited for
                outcome.put((None, error))

        allowed = min(seconds, self.left)
        if allowed <= 0.0:
            raise TimeoutError
        threading.Thread(target=act, daemon=True, name="scan").start()
        try:
            value, error = outcome.get(timeout=allowed)
        except Empty:
            raise TimeoutError from None
        if error is not None:
            raise error
        return value  # type: ignore[return-value]
