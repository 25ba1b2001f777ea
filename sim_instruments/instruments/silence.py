"""A device's communication watchdog: what it does if it receives no message for a time."""

import threading
from collections.abc import Callable
from time import monotonic


class SilenceWatch:
    """Calls `act` once nothing has been heard for the time that was set, and not again before something has been.

    Times are of the wall's clock: it is a process that is watched, not the bench.
    """

    def __init__(self, act: Callable[[], None]) -> None:
        self._act = act
        self._condition = threading.Condition()
        self._time = 0.0
        self._last: float | None = None
        self._closed = False
        self._thread: threading.Thread | None = None

    def watch(self, time: float) -> None:
        """Watch for silences of `time` (s) from the next word on; 0 is for no watch."""
        with self._condition:
            self._time, self._last = time, None
            if time and self._thread is None:
                self._thread = threading.Thread(target=self._work, name="silence watch", daemon=True)
                self._thread.start()
            self._condition.notify()

    def heard(self) -> None:
        """Take note that a message has arrived now."""
        if self._time:
            with self._condition:
                self._last = monotonic()
                self._condition.notify()

    def close(self) -> None:
        """Watch no more; again is allowed."""
        with self._condition:
            self._closed, self._time = True, 0.0
            self._condition.notify()
        if self._thread is not None:
            self._thread.join()

    def _work(self) -> None:
        while self._silent():
            self._act()

    def _silent(self) -> bool:
        """Wait for a silence; false once the watch has been closed."""
        with self._condition:
            while not self._closed:
                if self._last is None or not self._time:
                    self._condition.wait()
                elif (left := self._last + self._time - monotonic()) > 0.0:
                    self._condition.wait(left)
                else:
                    self._last = None
                    return True
            return False
