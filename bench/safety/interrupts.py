"""Ctrl-C, the signals that end a program and other parties' wish to stop, as one exception that takes the way down."""

import os
import signal
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from time import monotonic
from types import FrameType

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupted(BaseException):
    """A person or the system wants the run to end now; no `except Exception` may swallow it."""

    def __init__(self, by: str) -> None:
        self.by = by
        super().__init__(f"interrupted by {by}")


class Interrupts:
    """One run's way to be stopped: by signals, and by whoever it was handed to (a panel, an interlock, a guardian)."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._wish = ""
        self._begun = False
        self._signals = 0
        #: Set by the second Ctrl-C or signal: still the way down, but no waiting on it.
        self.hurry = threading.Event()
        self._seen: float | None = None
        self._raised: float | None = None

    def request(self, by: str) -> None:
        """Have the run interrupted in its main thread, from any thread; the first wish counts.

        Outside the block of `raising` it is remembered for `raise_if_requested`.
        """
        with self._lock:
            if self._wish:
                return
            self._wish = by
            self._seen = self._seen or monotonic()
            begun = self._begun
        if begun:
            os.kill(os.getpid(), signal.SIGTERM)

    def raise_if_requested(self) -> None:
        """Raise Interrupted where somebody wished for it and no signal could say so."""
        if self._wish:
            raise Interrupted(self._wish)

    @contextmanager
    def raising(self) -> Iterator[None]:
        """Within the block, the first Ctrl-C, SIGTERM, SIGHUP or `request` raises Interrupted in the main thread.

        Those that follow interrupt nothing: what the first one set going is the way down, and it is walked to its end.
        """
        interrupted = False

        def interrupt(number: int, _frame: FrameType | None) -> None:
            nonlocal interrupted
            self._count()
            if interrupted:
                return
            interrupted = True
            self._raised = monotonic()
            self._seen = self._seen or self._raised
            raise Interrupted(self._wish or ("Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name))

        with _handled(interrupt):
            with self._lock:
                # In another thread than the main one no handler is in place, and a signal would end the program.
                self._begun = threading.current_thread() is threading.main_thread()
            try:
                yield
            finally:
                with self._lock:
                    self._begun = False

    @contextmanager
    def held_back(self) -> Iterator[None]:
        """Within the block those signals interrupt nothing: the way down is walked to its end."""

        def count(_number: int, _frame: FrameType | None) -> None:
            self._count()

        with _handled(count):
            yield

    def delays(self) -> dict[str, float]:
        """Return how long (s) after the cause was seen the run was interrupted, and how long after it this was asked."""
        if self._seen is None:
            return {}
        now = monotonic()
        return {"interrupted_after": (self._raised or now) - self._seen, "started_after": now - self._seen}

    def _count(self) -> None:
        self._signals += 1
        # The signal that a request sends to this process is nobody's impatience.
        if self._signals - bool(self._wish) > 1:
            self.hurry.set()


@contextmanager
def _handled(handler: "signal._HANDLER") -> Iterator[None]:
    if threading.current_thread() is not threading.main_thread():
        # Only the main thread receives signals, and only it may say what they do.
        yield
        return
    before = {number: signal.signal(number, handler) for number in _SIGNALS}
    try:
        yield
    finally:
        for number, handler_before in before.items():
            signal.signal(number, handler_before)
