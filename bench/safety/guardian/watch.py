"""Supervision of a run: receives heartbeats, and carries out the shutdown when they stop."""

import math
import os
import select
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from functools import partial
from time import monotonic
from typing import Any, Protocol

from bench.journal.events.safety import GuardianMeasured, GuardianShutdownDone, GuardianTakesOver
from bench.journal.guardian_record import complain
from bench.safety.guardian.lateness import Lateness, RunQueue
from bench.safety.guardian.protocol import decode
from bench.safety.shutdown import Outcome, failures
from bench.station.shutdown_sequence import OFF_BY, Item, ShutdownAction
from procedures.core.bench import Recorder, Role
from procedures.core.events import Event

#: A run whose energised blocks end after an error, or that was told of an open interlock, may take so long (s) itself.
_GRACE = 0.4
#: A run that is helped with some roles has so long (s) for the others.
_OTHERS = 0.2
#: A run that was told to stop must have begun its shutdown within this time (s).
_BEGIN = 0.5
#: A run that has woken up must be in its shutdown within this time (s).
_WAKE = 5.0
#: What was switched off is switched off again every so often (s), as long as the run might still wake up.
_HOLD = 0.25
#: How long (s) an instrument that does not answer is waited for; a run that is helped hears nothing meanwhile.
_LONGEST, _LONGEST_HELPING = 3.0, 0.8
#: A run that waits to hear whether it is off waits so long (s) for what is measured.
_PROOF = 8.0
#: Who wakes up later than this (s) was held up together with the run, which then gets the same time once more.
_LATE = 0.05
#: How often (s) the guardian looks how late it gets to run itself.
_LOOK = 0.05

Say = Callable[[dict[str, Any]], None]


class GuardianInstruments(Protocol):
    """Instruments that the guardian can switch off."""

    @property
    def items(self) -> tuple[Item, ...]:
        """Items of the shutdown."""

    def is_busy(self, role: Role) -> bool:
        """Tell whether an instrument has not answered yet what was begun before."""

    def shut_down(
        self,
        items: Sequence[Item],
        recorder: Recorder,
        *,
        longest: float,
        hurry: bool = False,
        wanted: Callable[[Item], bool] | None = None,
    ) -> list[Outcome]:
        """Do these items."""


@dataclass(frozen=True)
class _Cause:
    """Why the guardian must act; `helping` are the roles that a run is helped with first, None where it carries out the shutdown."""

    words: str
    helping: frozenset[Role] | None = None


class Watch:
    """Watches one run through the pipe `incoming` and answers by `say`; `run` returns when nobody needs it any more.

    `heartbeat` and `stalled` (s) are the charge's; `queue` tells how long the run's threads had no processor.
    """

    def __init__(
        self,
        instruments: GuardianInstruments,
        record: Recorder,
        incoming: int,
        say: Say,
        heartbeat: float,
        stalled: float,
        queue: RunQueue,
    ) -> None:
        self._instruments = instruments
        self._record = record
        self._incoming = incoming
        self._say = say
        self._heartbeat = heartbeat
        self._stalled = stalled
        self._late, self._queue = Lateness(heartbeat), queue
        self._buffer = b""
        self._unread: list[dict[str, Any]] = []
        self._gone = self._done = self._unsafe = self._down = False
        #: What the last shutdown could not do, and what was measured not to be safe after it.
        self._failed: list[str] = []
        self._brakes = any(item.do is ShutdownAction.BRAKE for item in instruments.items)
        #: Why and by when (s, monotonic) the run must have begun its shutdown.
        self._begin: tuple[str, float] | None = None
        #: By when (s, monotonic) all that ends after one error must be off, and whose blocks are ending now.
        self._unwound: float | None = None
        self._ending: frozenset[Role] = frozenset()
        #: The roles that are energised, and those that do not answer the run.
        self._on: frozenset[Role] = frozenset()
        self._silent: frozenset[Role] = frozenset()
        #: What was heard while something was being switched off.
        self._causes: list[_Cause] = []
        self._alarm = ""
        self._alarmed = False
        self._wake, self._waker = os.pipe()
        os.set_blocking(incoming, False)

    def alarm(self, cause: str) -> None:
        """Tell the run to end, from any thread; if it does not begin to, the shutdown is carried out here."""
        if not self._alarm:
            self._alarm = cause
            os.write(self._waker, b"\0")

    def run(self) -> None:
        """Supervise until the run has ended, or until its process is dead and its instruments are safe."""
        while cause := self._guard():
            if cause.helping is not None:
                self._help(cause.words, cause.helping)
                continue
            self._take_over(cause.words)
            self._hold()
            if self._gone or self._done:
                return

    def _guard(self) -> _Cause | None:
        """Wait; return why the guardian must act, None where the run is done."""
        last = monotonic()
        while True:
            if self._causes:
                return self._causes.pop(0)
            if self._done:
                return None
            if self._gone and not self._unread:
                return _Cause("the run's process has died")
            now = monotonic()
            due = last + self._patience_with_run(now - last, now)
            planned = min(due, now + _LOOK, self._begin[1] if self._begin else due, self._deadline() or due)
            messages = self._hear(planned)
            woke = monotonic()
            if not messages:
                self._late.woke(planned, woke)
            patience = self._patience_with_run(woke - last, woke)
            if any("beat" in message for message in messages):
                last = woke
                self._queue.note()
            elif woke - planned > _LATE:
                last = max(last, woke - patience + _LATE)
            self._take_all(messages)
            if self._causes or self._gone or self._done:
                continue
            now = monotonic()
            # The difference that its patience was asked for: after a late awakening the two are equal but for their last bits.
            if woke - last >= patience:
                return _Cause(f"no heartbeat for {self._heartbeat:g} s")
            if self._begin and now >= self._begin[1]:
                return _Cause(self._begin[0])
            if (deadline := self._deadline()) and now >= deadline:
                return self._overdue()

    def _patience_with_run(self, silent: float, now: float) -> float:
        """Return how long (s) the run may be silent, silent for a time (s) by now: more where either got no processor."""
        late = self._late.allowance(now)
        if silent >= self._heartbeat + late:
            late = max(late, min(self._queue.waited(), self._heartbeat))
        return self._heartbeat + late

    def _deadline(self) -> float | None:
        """By when (s, monotonic) the run must have switched off what it is switching off; None where it is not doing so."""
        return self._unwound if self._ending or self._down else None

    def _overdue(self) -> _Cause:
        self._unwound = None
        if self._down:
            return _Cause(f"the run's shutdown has not switched everything off within {_GRACE:g} s", self._on)
        return _Cause(f"what was energised is not off {_GRACE:g} s after an error", self._ending | self._silent)

    def _take_all(self, messages: Sequence[dict[str, Any]]) -> None:
        for message in messages:
            if cause := self._take(message):
                self._causes.append(cause)

    def _take(self, message: dict[str, Any]) -> _Cause | None:
        """Take what the run says; return why the guardian must act at once."""
        now = monotonic()
        if "beat" in message:
            self._say({"echo": message["beat"]})
            age = float(message.get("age", 0.0))
            if age > self._stalled:
                return _Cause(f"the run has not got on for {age:.3g} s")
        elif "on" in message:
            self._on = frozenset(Role(role) for role in message["on"])
            self._ending &= self._on
            if not self._on:
                self._unwound = None
        elif "ending" in message:
            # One time for all blocks that end after an error. What ends long after that is another error's.
            if self._unwound is None or now > self._unwound + _GRACE:
                self._unwound = now + _GRACE
            self._ending |= {Role(message["ending"])}
        elif "ended" in message:
            # Whether the outer blocks end too, or the procedure has handled the error, is not known yet.
            self._ending -= {Role(message["ended"])}
        elif "handled" in message:
            self._unwound = self._unwound if self._ending else None
        elif "stop" in message:
            self._must_begin(
                f"the run has not begun its shutdown {_BEGIN:g} s after it was requested by {message['stop']}", _BEGIN
            )
        elif "unanswered" in message:
            if not (self._down and self._brakes):
                self._silent |= {Role(message["role"])}
                return _Cause(str(message["unanswered"]), self._silent)
        elif "down" in message:
            self._down, self._begin = True, None
            self._unwound = self._unwound or now + _GRACE if self._on and not self._brakes else None
        elif "done" in message:
            self._done = True
            if message.get("unsafe"):
                self._unsafe = True
                return _Cause("the run could not switch everything off")
            if message.get("journal") is False:
                # Nobody else can write down what the outcome is.
                return _Cause("the run's journal cannot be written")
        return None

    def _must_begin(self, otherwise: str, within: float) -> None:
        """Give the run a time (s) for the beginning of its shutdown; the earliest one counts."""
        due = monotonic() + within
        if not self._down and (self._begin is None or due < self._begin[1]):
            self._begin = otherwise, due

    def _help(self, cause: str, first: Collection[Role]) -> None:
        """Switch off these roles, and the others where the run does not do so itself before long."""
        items = sorted(self._commands(), key=lambda item: item.role not in first)
        wanted = partial(self._is_wanted, first, monotonic() + _OTHERS)
        complain(f"helps the run to switch off: {cause}")
        self._act(
            cause, lambda: self._instruments.shut_down(items, self._record, longest=_LONGEST_HELPING, wanted=wanted)
        )

    def _take_over(self, cause: str) -> None:
        self._begin = self._unwound = None
        items = [item for item in self._instruments.items if not item.measures]
        self._say({"took": cause})
        complain(f"carries out the shutdown: {cause}")
        self._act(cause, lambda: self._instruments.shut_down(items, self._record, longest=_LONGEST))

    def _act(self, cause: str, shut_down: Callable[[], list[Outcome]]) -> None:
        begun = monotonic()
        self._record.record(GuardianTakesOver(cause=cause))
        self._failed = failures(shut_down())
        self._record.record(GuardianShutdownDone(seconds=monotonic() - begun, failed=self._failed))
        self._say({"walked": [*self._failed]})
        for words in self._failed:
            complain(words)

    def _is_wanted(self, first: Collection[Role], until: float, item: Item) -> bool:
        """Tell whether a run is to be helped with an item; that of another role is the run's own until a time (s, monotonic)."""
        if item.role in first:
            return True
        while monotonic() < until and self._is_on(first, item) and not (self._causes or self._gone or self._done):
            self._take_all(self._hear(until))
        # What brakes needs the drive that the guardian would disable.
        return self._is_on(first, item) and not (self._down and self._brakes and not self._alarmed)

    def _is_on(self, first: Collection[Role], item: Item) -> bool:
        others = self._on.difference(first)
        return item.role in others if item.role in OFF_BY else bool(others)

    def _hold(self) -> None:
        """Measure that it is safe, and keep it so as long as the run might wake up.

        A run that could not switch everything off is told only then whether it is off now: an instrument's word is no proof.
        """
        longest = _PROOF if self._unsafe else math.inf
        pending = {item: monotonic() + min(item.within, longest) for item in self._instruments.items if item.measures}
        while True:
            for item, deadline in list(pending.items()):
                within = self._patience(deadline)
                (outcome,) = self._instruments.shut_down((item,), _Silent(), longest=within, hurry=True)
                if not outcome.error or monotonic() >= deadline:
                    del pending[item]
                    self._tell(outcome)
            if (self._done and not self._unsafe) or ((self._gone or self._done) and not pending):
                if self._unsafe:
                    self._say({"walked": [*self._failed]})
                return
            if not self._gone:
                within = self._patience(max(pending.values(), default=0.0))
                self._instruments.shut_down(self._commands(), _Silent(), longest=within)
            messages = self._hear(monotonic() + _HOLD)
            for number, message in enumerate(messages):
                if "beat" in message:
                    # It has woken up and does not know yet.
                    self._say({"took": "the guardian carried out the shutdown meanwhile"})
                elif "on" in message or "down" in message:
                    self._take(message)
                self._done = self._done or "done" in message
                if "awake" in message:
                    # From now on it is the run's again, which must soon be in its own shutdown.
                    self._must_begin(f"the run has not begun its shutdown {_WAKE:g} s after it woke up", _WAKE)
                    self._unread = messages[number + 1 :]
                    self._say({"yours": True})
                    return

    def _patience(self, deadline: float) -> float:
        """Return how long (s) an instrument is waited for; a run that waits itself is kept no longer than to the deadline (monotonic)."""
        left = max(deadline - monotonic(), _HOLD)
        return min(left, _LONGEST) if self._unsafe else _LONGEST

    def _commands(self) -> list[Item]:
        """Return what switches off, but for an instrument that is still being tried."""
        return [item for item in self._instruments.items if not (item.measures or self._instruments.is_busy(item.role))]

    def _tell(self, outcome: Outcome) -> None:
        self._record.record(GuardianMeasured(**outcome.as_data()))
        if outcome.error:
            self._failed.append(outcome.words)
            complain(outcome.words)

    def _hear(self, until: float) -> list[dict[str, Any]]:
        """Return what the run says, waiting for it no longer than to a time (s, monotonic)."""
        if self._unread:
            messages, self._unread = self._unread, []
            return messages
        listened = [self._wake] if self._gone else [self._incoming, self._wake]
        ready, _, _ = select.select(listened, [], [], max(0.0, until - monotonic()))
        if self._wake in ready:
            os.read(self._wake, 1)
        if not self._gone:
            self._fill()
        if self._alarm and not self._alarmed:
            self._alarmed = True
            self._say({"alarm": self._alarm})
            self._must_begin(self._alarm, _GRACE)
            if self._down and self._on:
                self._unwound = self._unwound or monotonic() + _GRACE
        *lines, self._buffer = self._buffer.split(b"\n")
        return [decode(line) for line in lines]

    def _fill(self) -> None:
        while True:
            try:
                content = os.read(self._incoming, 1 << 16)
            except BlockingIOError:
                return
            if not content:
                self._gone = True
                return
            self._buffer += content


class _Silent:
    """Forgets what is repeated again and again."""

    def record(self, event: Event) -> None:
        """Forget it."""
