"""The shutdown: an ordered list from any state to a harmless one, each item independent, each outcome recorded."""

import math
import threading
from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from time import monotonic
from typing import Any

from bench.journal.events.safety import MadeSafe
from bench.safety.instrument_threads import InstrumentThreads, ThreadCall
from bench.safety.interrupts import Flag
from bench.safety.shutdown_items import Hurry, Measured, NotReachedError, perform
from bench.station.shutdown_sequence import Item, ShutdownAction, ShutdownSequence
from drivers.interfaces import Clock, Instrument, InstrumentError
from procedures.core.bench import Recorder, Role

#: How long (s) the list waits for one item before it goes on with the next, which another instrument then does meanwhile.
PATIENCE = 1.0
#: After this time (s) an instrument that has not answered counts as lost.
LONGEST = 20.0
#: How often (s) it is looked whether there is still time.
_LOOK = 0.02
_BY_HAND = "by hand"


@dataclass(frozen=True)
class Outcome:
    """Outcome of one item; `error` is empty if it was done, `found` is what it measured."""

    item: Item
    error: str = ""
    found: Measured | None = None

    @property
    def words(self) -> str:
        """Sentence for a person: which item was not done, and why."""
        return f"{self.item.role.value} could not be made safe ({self.item.do.value}): {self.error}"

    def as_data(self) -> dict[str, Any]:
        """Return it as an event's data."""
        return {
            "instrument": self.item.role.value,
            "item": self.item.do.value,
            "outcome": "failed" if self.error else "safe",
            "error": self.error,
            "value": self.found.value if self.found else None,
            "unit": self.found.unit if self.found else None,
        }


def shut_down(
    sequence: ShutdownSequence,
    instruments: Mapping[Role, Instrument],
    recorder: Recorder,
    clock: Clock,
    *,
    hurry: Hurry | None = None,
    patience: float = PATIENCE,
    longest: float = LONGEST,
    silent: Collection[Role] = (),
    wanted: Callable[[Item], bool] | None = None,
    threads: InstrumentThreads | None = None,
) -> list[Outcome]:
    """Do every item whose instrument is present, in order, even if earlier ones fail; return the outcomes.

    One that does not answer within `patience` (s) is left to itself while the next begin, and given up `longest` (s)
    after the last. Once `hurry` is set, measurements are not repeated and nobody waits for a person. Commands to `silent`
    roles come after those to the others. `wanted` is asked before each item begins and may wait; what it refuses is left
    out. `threads` are for a caller who shuts down again while an instrument may still be busy.
    """
    own = threads or InstrumentThreads()
    try:
        items = [item for item in _silent_last(sequence.items, silent) if item.role in instruments]
        by_hand = sequence.by_hand
        return _Shutdown(items, by_hand, instruments, recorder, clock, hurry or Flag(), patience, longest, own).run(
            wanted or _always
        )
    finally:
        if threads is None:
            own.end()


def _silent_last(items: Sequence[Item], silent: Collection[Role]) -> list[Item]:
    """Put what is done to roles that do not answer behind the last command to another; contacts part at their place."""

    def commands(item: Item) -> bool:
        return not item.measures and item.do is not ShutdownAction.OPEN

    end = max((n for n, item in enumerate(items, 1) if commands(item) and item.role not in silent), default=0)
    answering = [item for item in items[:end] if item.role not in silent]
    return [*answering, *(item for item in items[:end] if item.role in silent), *items[end:]]


def _always(_: Item) -> bool:
    return True


class _Shutdown:
    def __init__(
        self,
        items: Sequence[Item],
        by_hand: Collection[Role],
        instruments: Mapping[Role, Instrument],
        recorder: Recorder,
        clock: Clock,
        hurry: Hurry,
        patience: float,
        longest: float,
        threads: InstrumentThreads,
    ) -> None:
        self._items = items
        self._by_hand = by_hand
        self._instruments = instruments
        self._recorder = recorder
        self._clock = clock
        self._wanted = hurry
        self._abandoned = threading.Event()
        self._patience = patience
        self._longest = longest
        self._threads = threads
        self._calls: list[ThreadCall[Any]] = []

    def is_set(self) -> bool:
        """Tell whether to stop waiting: the shutdown is urgent, or it was broken off."""
        return self._wanted.is_set() or self._abandoned.is_set()

    def run(self, wanted: Callable[[Item], bool]) -> list[Outcome]:
        try:
            return self._run(wanted)
        except BaseException:
            # Whoever walks again must not speak to an instrument that is still being spoken to.
            self._abandoned.set()
            for call in self._calls:
                call.done.wait(self._longest)
            raise

    def _run(self, wanted: Callable[[Item], bool]) -> list[Outcome]:
        late: list[tuple[Item, ThreadCall[Any]]] = []
        outcomes = []
        for item in self._items:
            if not wanted(item):
                continue
            call: ThreadCall[Any] = ThreadCall(partial(perform, item, self._instruments[item.role], self._clock, self))
            self._calls.append(call)
            # One person answers one question at a time.
            self._threads.submit(_BY_HAND if item.role in self._by_hand else item.role.value, call)
            if any(item.role is waiting.role for waiting, _ in late):
                late.append((item, call))
            elif self._wait(item, call, item.within + self._longest if item.measures else self._patience):
                outcomes.append(self._outcome(item, call))
            else:
                late.append((item, call))
        until = monotonic() + self._longest
        for item, call in late:
            # What measures goes by the bench's time.
            left = self._longest if item.measures else max(0.0, until - monotonic())
            self._wait(item, call, math.inf if item.role in self._by_hand else left)
            outcomes.append(self._outcome(item, call))
        return outcomes

    def _wait(self, item: Item, call: ThreadCall[Any], seconds: float) -> bool:
        # What measures waits in the bench's time, which may be another than the wall's.
        now = self._clock.now if item.measures else monotonic
        deadline = now() + seconds
        while not call.done.wait(_LOOK):
            if now() >= deadline or (self.is_set() and item.role in self._by_hand):
                return call.done.is_set()
        return True

    def _outcome(self, item: Item, call: ThreadCall[Any]) -> Outcome:
        found, error = call.value, ""
        if not call.done.is_set():
            error = "no answer in time"
        elif isinstance(call.error, NotReachedError):
            found, error = call.error.found, str(call.error)
        elif isinstance(call.error, InstrumentError):
            error = str(call.error)
        elif call.error is not None:
            # Anything else is a fault of the program, whose kind belongs to the message.
            error = f"{type(call.error).__name__}: {call.error}"
        outcome = Outcome(item, error, found)
        self._record(outcome)
        return outcome

    def _record(self, outcome: Outcome) -> None:
        try:
            self._recorder.record(MadeSafe(**outcome.as_data()))
        except OSError:
            # A full disk must not keep the next instrument on; the outcome is still returned to the caller.
            return


def failures(outcomes: Sequence[Outcome]) -> list[str]:
    """Return what was not done, for a person."""
    return [outcome.words for outcome in outcomes if outcome.error]
