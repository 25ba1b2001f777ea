"""A request to stop a batch, by a signal or from another thread, that the batch's loop waits for among other things."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType

_SIGNALS: dict[int, str] = {signal.SIGINT: "Ctrl-C", signal.SIGTERM: "SIGTERM", signal.SIGHUP: "SIGHUP"}


class StopRequest:
    """The first request to stop, empty while there is none, and the number of requests; `descriptor` becomes readable with each
    request.
    """

    def __init__(self) -> None:
        self.by = ""
        self.count = 0
        self.descriptor, self._wake = os.pipe()
        for end in (self.descriptor, self._wake):
            os.set_blocking(end, False)

    def request(self, by: str) -> None:
        """Request the stop, from any thread."""
        self.by = self.by or by
        self.count += 1
        os.write(self._wake, b"s")

    def acknowledge(self) -> None:
        """Clear `descriptor` until the next request."""
        os.read(self.descriptor, 100)

    @contextmanager
    def by_signals(self) -> Iterator[None]:
        """Request the stop by signals for the length of the block; they come to the main thread only."""
        if threading.current_thread() is not threading.main_thread():
            yield
            return

        # The byte that wakes the loop is written by the interpreter.
        before_fd = signal.set_wakeup_fd(self._wake, warn_on_full_buffer=False)
        before = {number: signal.signal(number, self._signalled) for number in _SIGNALS}
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)
            signal.set_wakeup_fd(before_fd)

    def close(self) -> None:
        """Close the descriptor."""
        for end in (self.descriptor, self._wake):
            os.close(end)

    def _signalled(self, number: int, _frame: FrameType | None) -> None:
        # Attributes only: a handler runs between any two steps of this thread, and within another handler.
        self.by = self.by or _SIGNALS[number]
        self.count += 1
