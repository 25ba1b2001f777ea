"""Ctrl-C, the signals that end a program and other parties' wish to stop, as one exception that takes the way down."""

import signal
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from time import monotonic
from types import FrameType
from typing import Any

from bench.safety.nudge import NUDGE, Nudge
from procedures.text import Text, text

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


class Interrupted(BaseException):
    """A person or the system wants the run to end now; no `except Exception` may swallow it."""

    def __init__(self, by: Text | str) -> None:
        self.text = text("interrupted by {by}", by=by)
        super().__init__(str(self.text))


class Interrupts:
    """One run's way to be stopped: by signals, and by whoever it was handed to (a panel, an interlock, a guardian)."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._nudge = Nudge()
        self._wish: Text | str = ""
        self._signals = self._thread = 0
        self._named = ""
        #: Set by the second Ctrl-C or signal: still the way down, but no waiting on it.
        self.hurry = threading.Event()
        self._seen: float | None = None
        self._raised: float | None = None

    def request(self, by: Text | str) -> None:
        """Have the run interrupted in its main thread, from any thread; the first wish counts.

        Outside the block of `raising` it is remembered for `raise_if_requested`.
        """
        with self._lock:
            if self._wish:
                return
            self._seen = self._seen or monotonic()
            self._wish = by
        self._nudge.give()

    def raise_if_requested(self) -> None:
        """Raise Interrupted where somebody wished for it and no signal could say so."""
        if self._wish:
            raise Interrupted(self._wish)

    @contextmanager
    def raising(self) -> Iterator[None]:
        """Within the block, the first Ctrl-C, SIGTERM, SIGHUP or `request` raises Interrupted in the main thread.

        Those that follow interrupt nothing: what the first one set going is the way down, and it is walked to its end.
        """
        self._thread = threading.get_ident()
        if threading.current_thread() is not threading.main_thread():
            # Only the main thread receives signals, and only it may say what they do; others hear by their events.
            yield
            return

        def interrupt(number: int, _frame: FrameType | None) -> None:
            self._count(number)
            if self._nudge.heard.is_set() or (number == NUDGE and not (self._wish or self._signals)):
                return
            self._nudge.heard.set()
            self._raised = monotonic()
            self._seen = self._seen or self._raised
            raise Interrupted(self._wish or self._named)

        with _handled(interrupt), self._nudge.active():
            yield

    def hear(self, kind: str, data: Mapping[str, Any]) -> None:
        """Take an event of the run's journal: a run in another thread than the main one is interrupted by its next."""
        mine = threading.get_ident() == self._thread and threading.current_thread() is not threading.main_thread()
        if mine and self._wish and not self._nudge.heard.is_set():
            self._nudge.heard.set()
            self._raised = monotonic()
            raise Interrupted(self._wish)

    @contextmanager
    def held_back(self) -> Iterator[None]:
        """Within the block those signals interrupt nothing: the way down is walked to its end."""
        self._nudge.heard.set()
        if threading.current_thread() is not threading.main_thread():
            yield
            return

        def count(number: int, _frame: FrameType | None) -> None:
            self._count(number)

        with _handled(count):
            yield

    def delays(self) -> dict[str, float]:
        """Return how long (s) after the cause was seen the run was interrupted, and how long after it this was asked."""
        if self._seen is None:
            return {}
        now = monotonic()
        return {"interrupted_after": (self._raised or now) - self._seen, "started_after": now - self._seen}

    def _count(self, number: int) -> None:
        if number == NUDGE:
            return
        self._signals += 1
        self._named = "Ctrl-C" if number == signal.SIGINT else signal.Signals(number).name
        if self._signals > 1:
            self.hurry.set()


@contextmanager
def _handled(handler: "signal._HANDLER") -> Iterator[None]:
    before = {number: signal.signal(number, handler) for number in (*_SIGNALS, NUDGE)}
    try:
        yield
    finally:
        for number, handler_before in before.items():
            signal.signal(number, handler_before)
