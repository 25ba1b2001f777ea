"""Ctrl-C, the signals that end a program and other parties' requests to stop, as one flag and one exception."""

import os
import select
import signal
import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext, suppress
from time import monotonic
from types import FrameType, TracebackType

from drivers.interfaces.text import Text, text
from procedures.core.events import Event

_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
#: What wakes the main thread out of a system call; its handler raises.
NUDGE = signal.SIGUSR1
#: How often (s) the main thread is nudged until the shutdown has begun.
_INTERVAL = 0.01
#: How often (s) it is looked whether a signal waits for a main thread that hangs in the system: on a disk that does not answer.
_LOOK = 0.1
#: A request that has stood for so long (s) breaks off what an energised block does at its end.
_LATE = 0.4
#: One that has stood for so long (s), and again after each such time, is raised wherever the main thread is.
_OVERDUE = 0.7

#: What the run's thread is doing: computing or speaking to somebody who must not be interrupted, waiting, or switching off.
_BUSY, _WAITING, _SWITCHING_OFF = 0, 1, 2
_NOTHING = nullcontext()


class Interrupted(BaseException):
    """A person or the system wants the run to end now; no `except Exception` may swallow it."""

    def __init__(self, by: Text | str) -> None:
        self.text = text("interrupted by {by}", by=by)
        super().__init__(str(self.text))


class Flag:
    """A plain flag: unlike an Event it has no lock that a signal handler could find locked."""

    def __init__(self) -> None:
        self._up = False

    def set(self) -> None:
        """Raise it."""
        self._up = True

    def is_set(self) -> bool:
        """Say whether it is up."""
        return self._up


class Interrupts:
    """Stop requests to one run: by signals, or by a panel, an interlock or a guardian.

    A request is a flag that stays up. Every command to an instrument and every wait of the run's thread looks at it, by `check`
    or `waiting`, until `shutdown_begins`. Signal handlers only set attributes; a thread behind the wake-up descriptor tells
    the `listen`ers, counts the signals and nudges the main thread out of what it waits in. A signal that a main thread stuck in
    the system does not take is told them all the same.
    """

    def __init__(self) -> None:
        self._wish: Text | str = ""
        self._signal = 0
        self._seen: float | None = None
        self._raised: float | None = None
        self._begun = False
        self._thread = 0
        self._doing = _BUSY
        self._switching_off = 0
        self._late = self._overdue = False
        self._interruption = Interrupted("")
        self._listeners: list[Callable[[Text | str], None]] = []
        self._waker = -1
        # Taken by no handler.
        self._closing = threading.Lock()
        #: Up from the second Ctrl-C or signal on: still the whole shutdown, but no waiting on it.
        self.hurry = Flag()

    # requests ---------------------------------------------------------------------------------------------------

    def listen(self, listener: Callable[[Text | str], None]) -> None:
        """Call `listener(by)`, on a thread of its own, at the first request within `raising`."""
        self._listeners.append(listener)

    def request(self, by: Text | str) -> None:
        """Request the run's stop, from any thread; the first request counts. Before `raising` it is remembered."""
        if not self.requested_by:
            self._seen = self._seen or monotonic()
            self._wish = by
        with self._closing, suppress(OSError):
            if self._waker >= 0:
                os.write(self._waker, b"\0")

    @property
    def requested_by(self) -> Text | str:
        """First requester of the run's stop; empty where there is none."""
        if self._wish or not self._signal:
            return self._wish
        return "Ctrl-C" if self._signal == signal.SIGINT else signal.Signals(self._signal).name

    def delays(self) -> dict[str, float]:
        """Return how long (s) after the request was seen the run was interrupted, and how long after it this was asked."""
        if self._seen is None:
            return {}
        now = monotonic()
        return {"interrupted_after": (self._raised or now) - self._seen, "started_after": now - self._seen}

    # the run's thread -------------------------------------------------------------------------------------------

    def check(self) -> None:
        """Raise Interrupted in the run's thread where a stop is requested and the shutdown has not begun."""
        if (
            (self._wish or self._signal)
            and not (self._begun or self._switching_off)
            and self._thread == threading.get_ident()
        ):
            self._raised = self._raised or monotonic()
            # The thread behind the wake-up descriptor may not have got on yet.
            self._seen = self._seen or self._raised
            raise Interrupted(self.requested_by)

    def hear(self, event: Event) -> None:
        """Take an event of the run's journal, and look; what tells how something ends is let pass."""
        if not event.closing:
            self.check()

    def waiting(self, *, interruptible: bool = True) -> AbstractContextManager[None]:
        """Within the block the run waits for something outside; a request is raised before it.

        It is raised in the middle of an `interruptible` one too, which then must bear an exception at any of its steps.
        """
        self.check()
        if self._thread != threading.get_ident():
            return _NOTHING
        if not interruptible:
            return _Doing(self, _BUSY)
        return _Doing(self, _SWITCHING_OFF if self._switching_off else _WAITING)

    @contextmanager
    def switching_off(self) -> Iterator[None]:
        """Within the block the run's thread ends an energised state, which a request does not refuse."""
        if self._thread != threading.get_ident():
            yield
            return
        self._switching_off += 1
        self._doing = _BUSY
        try:
            yield
        finally:
            self._switching_off -= 1

    @property
    def is_switching_off(self) -> bool:
        """Return whether the run's thread ends an energised state."""
        return self._switching_off > 0

    def in_own_thread(self) -> bool:
        """Tell whether the caller is the thread that entered `raising`."""
        return self._thread == threading.get_ident()

    def shutdown_begins(self) -> None:
        """From now on nothing is raised any more: the shutdown is done to its end."""
        self._begun = True

    @contextmanager
    def raising(self) -> Iterator[None]:
        """Within the block Ctrl-C, SIGTERM, SIGHUP and `request` raise Interrupted in the thread that entered it.

        Signals reach the main thread only; in another one, requests are raised by `check` and `waiting`.
        """
        self._thread = threading.get_ident()
        main = threading.current_thread() is threading.main_thread()
        waking, self._waker = os.pipe()
        for end in (waking, self._waker):
            os.set_blocking(end, False)
        thread = threading.Thread(
            target=self._wake, args=(waking, self._thread if main else 0), name="stop requests", daemon=True
        )
        with self._handled() if main else _NOTHING:
            before = signal.set_wakeup_fd(self._waker, warn_on_full_buffer=False) if main else -1
            thread.start()
            if self.requested_by:
                os.write(self._waker, b"\0")
            try:
                yield
            finally:
                if main:
                    signal.set_wakeup_fd(before)
                with self._closing:
                    waker, self._waker = self._waker, -1
                    os.close(waker)
                # Until its end it may nudge, for which there must be a handler.
                thread.join()
                os.close(waking)

    @contextmanager
    def _handled(self) -> Iterator[None]:
        before = {number: signal.signal(number, self._signalled) for number in _SIGNALS}
        before[NUDGE] = signal.signal(NUDGE, self._nudged)
        try:
            yield
        finally:
            for number, handler in before.items():
                signal.signal(number, handler)

    # handlers: attributes only, for they run between any two steps of the main thread, and within each other --------

    def _signalled(self, number: int, _frame: FrameType | None) -> None:
        self._signal = self._signal or number

    def _nudged(self, _number: int, _frame: FrameType | None) -> None:
        if self._begun or not (self._wish or self._signal):
            return
        if self._overdue or self._doing == _WAITING or (self._late and self._doing == _SWITCHING_OFF):
            self._overdue = False
            # Once only in each wait: the exception may land where the wait ends.
            self._doing = _BUSY
            raise self._interruption

    # the thread behind the wake-up descriptor -----------------------------------------------------------------------

    def _wake(self, waking: int, main: int) -> None:
        signals, told, due, overdue = 0, False, 0.0, 0.0
        waiting: set[int] = set()
        # Only what is blocked here is told to be pending; who takes it is the main thread.
        signal.pthread_sigmask(signal.SIG_BLOCK, _SIGNALS)
        while True:
            nudging = told and main and not self._begun
            longest = _LOOK if main and not told else None
            ready, _, _ = select.select([waking], [], [], max(0.0, due - monotonic()) if nudging else longest)
            if main and not told:
                before, waiting = waiting, signal.sigpending() & set(_SIGNALS)
                if untaken := before & waiting:
                    self._signal = self._signal or min(untaken)
            if ready:
                arrived = os.read(waking, 4096)
                if not arrived:
                    return
                signals += sum(number in _SIGNALS for number in arrived)
                if signals and not self._signal:
                    self._signal = next(number for number in arrived if number in _SIGNALS)
                if signals > 1:
                    self.hurry.set()
            if self.requested_by and not told:
                told = True
                self._seen = self._seen or monotonic()
                for listener in self._listeners:
                    listener(self.requested_by)
                overdue = monotonic() + _OVERDUE
            now = monotonic()
            if told and main and not self._begun and now >= due:
                self._late = now - (self._seen or now) >= _LATE
                if now >= overdue:
                    # What is swallowed is raised again.
                    self._overdue, overdue = True, now + _OVERDUE
                if self._doing != _BUSY or self._overdue:
                    self._raised = self._raised or now
                self._interruption = Interrupted(self.requested_by)
                signal.pthread_kill(main, NUDGE)
                due = now + _INTERVAL


class _Doing:
    """Work of the run's thread within a block."""

    def __init__(self, interrupts: Interrupts, doing: int) -> None:
        self._interrupts = interrupts
        self._doing = doing

    def __enter__(self) -> None:
        self._before = self._interrupts._doing
        self._interrupts._doing = self._doing

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._interrupts._doing = self._before
