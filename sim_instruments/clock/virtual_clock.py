"""Virtual time: it stands still while anybody works and jumps when everybody waits."""

import heapq
import itertools
import threading
from collections.abc import Callable
from typing import Protocol

#: When (s) time is to stop on its way, the order in which that was asked for, and what then runs.
Alarm = tuple[float, int, Callable[[], None]]


class BenchClock(Protocol):
    """The time of a bench, whoever moves it on."""

    def now(self) -> float:
        """Return the bench time (s)."""

    def sleep(self, seconds: float) -> None:
        """Wait for bench time (s). Raises ValueError for a negative or non-finite time."""

    def on_advance(self, callback: Callable[[float], None]) -> Callable[[], None]:
        """Run `callback` with the new time whenever time advances; the function returned undoes it."""

    def call_at(self, time: float, callback: Callable[[], None]) -> Callable[[], None]:
        """Run `callback` when the bench time (s) comes; the function returned undoes it."""


class VirtualClock:
    """A clock whose time jumps to the earliest wake-up as soon as every participant sleeps.

    It starts at 0 s with one participant. Whoever works on a thread of its own joins before it starts and leaves at
    its end. A server thread may sleep on behalf of a client that is blocked waiting for its reply: what counts is
    the number of sleepers, not which threads they are.
    """

    def __init__(self, participants: int = 1) -> None:
        if participants < 1:
            raise ValueError(f"a virtual clock needs at least one participant, not {participants}")
        self._time = 0.0
        self._participants = participants
        self._lock = threading.RLock()
        self._condition = threading.Condition(self._lock)
        self._order = itertools.count()
        self._sleepers: list[tuple[float, int]] = []
        #: How many threads are in the middle of a sleep that may have to wait for others.
        self._blocked = 0
        self._advancing = False
        self._advancer: int | None = None
        self._callbacks: list[Callable[[float], None]] = []
        self._alarms: list[Alarm] = []

    def now(self) -> float:
        """Return the virtual time (s), without waiting for any lock."""
        return self._time

    def join(self) -> None:
        """Add a participant: from now on, time also waits for it."""
        with self._lock:
            self._participants += 1

    def leave(self) -> None:
        """Remove a participant, which may let time move for the others. Raises RuntimeError where none is left."""
        with self._lock:
            if self._participants == 0:
                raise RuntimeError("leave() without a matching join(): the virtual clock has no participants left")
            self._participants -= 1
        self._advance()

    def on_advance(self, callback: Callable[[float], None]) -> Callable[[], None]:
        """Run `callback(time)` after every jump, before any sleeper returns; the function returned undoes it.

        It runs on the thread whose sleeping made time jump; it must not sleep on this clock.
        """
        with self._lock:
            self._callbacks.append(callback)

        def remove() -> None:
            with self._lock:
                if callback in self._callbacks:
                    self._callbacks.remove(callback)

        return remove

    def call_at(self, time: float, callback: Callable[[], None]) -> Callable[[], None]:
        """Stop time at `time` (s) on its way and run `callback` there; the function returned undoes it.

        It runs like those of `on_advance`, after them. A time that has passed is the next one that comes.
        """
        with self._lock:
            alarm = (time, next(self._order), callback)
            heapq.heappush(self._alarms, alarm)

        def cancel() -> None:
            with self._lock:
                if alarm in self._alarms:
                    self._alarms.remove(alarm)
                    heapq.heapify(self._alarms)

        return cancel

    def sleep(self, seconds: float) -> None:
        """Wait for `seconds` of virtual time. Raises ValueError for a negative or non-finite time."""
        if not 0.0 <= seconds < float("inf"):
            raise ValueError(f"cannot sleep {seconds} s: the time must be finite and not negative")
        if seconds == 0.0:
            return
        if self._advancer == threading.get_ident():
            raise RuntimeError("a callback of on_advance() must not sleep: the clock waits for it")
        with self._lock:
            ticket = (self._time + seconds, next(self._order))
            alone = self._is_alone_until(ticket[0])
            if alone:
                self._begin_jump(ticket[0])
            else:
                heapq.heappush(self._sleepers, ticket)
                self._blocked += 1
        if alone:
            self._finish_jump(None)
            return
        try:
            self._advance()
            with self._lock:
                while ticket in self._sleepers or self._advancing:
                    self._condition.wait()
        finally:
            with self._lock:
                self._blocked -= 1
                if ticket in self._sleepers:
                    self._sleepers.remove(ticket)
                    heapq.heapify(self._sleepers)

    def _is_alone_until(self, time: float) -> bool:
        """Return whether nobody else is waited for, sleeps, or has an alarm due by a time (s)."""
        return (
            self._participants <= 1
            and not self._sleepers
            and not self._advancing
            and not (self._alarms and self._alarms[0][0] <= time)
        )

    def _advance(self) -> None:
        """Jump to the earliest wake-up where everybody sleeps, by way of the alarms before it."""
        while self._jump():
            continue

    def _jump(self) -> bool:
        """Jump once; return whether an alarm was why, so that time has still to go on."""
        with self._lock:
            if self._advancing or not self._sleepers or len(self._sleepers) < self._participants:
                return False
            alarm = None
            if self._alarms and self._alarms[0][0] <= self._sleepers[0][0]:
                alarm = heapq.heappop(self._alarms)
            self._begin_jump(alarm[0] if alarm else self._sleepers[0][0])
        self._finish_jump(alarm)
        return alarm is not None

    def _begin_jump(self, time: float) -> None:
        """Have the time (s) be this one; the clock's lock is held."""
        self._time = max(self._time, time)
        self._advancing = True
        self._advancer = threading.get_ident()

    def _finish_jump(self, alarm: Alarm | None) -> None:
        """Tell everybody of a jump, and let go on who has slept until then, unless an alarm has stopped time before."""
        # Callbacks run without the clock's own lock: they may take other locks whose holders ask for the time.
        try:
            for callback in tuple(self._callbacks):
                callback(self._time)
            if alarm is not None:
                alarm[2]()
        finally:
            with self._lock:
                # Those due leave the queue here, not when their thread gets to run: they no longer count as asleep.
                while alarm is None and self._sleepers and self._sleepers[0][0] <= self._time:
                    heapq.heappop(self._sleepers)
                self._advancing = False
                self._advancer = None
                if self._blocked:
                    self._condition.notify_all()
