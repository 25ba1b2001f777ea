"""The watch over a run: heartbeats in, and the way down when they stay away."""

import os
import select
from collections.abc import Callable
from time import monotonic
from typing import Any, Protocol

from bench.journal.guardian_record import complain
from bench.safety.guardian.protocol import decode
from bench.safety.shutdown import Outcome, failures
from bench.station.shutdown_sequence import Do, Item
from procedures.core.bench import Recorder, Role

#: A run that is ending a block after an error, or was told of an open interlock, may take so long (s) itself.
_GRACE = 0.4
#: A run that was told to stop must have begun its shutdown within this time (s).
_BEGIN = 0.5
#: A run that has woken up must be on its way down within this time (s).
_WAKE = 5.0
#: What was switched off is switched off again every so often (s), as long as the run might still wake up.
_HOLD = 0.25
#: Who wakes up later than this (s) was held up together with the run, which then gets the same time once more.
_LATE = 0.05

Say = Callable[[dict[str, Any]], None]


class Hands(Protocol):
    """What the way down is walked with."""

    @property
    def items(self) -> tuple[Item, ...]:
        """What is on the way down."""

    def walk(
        self, items: tuple[Item, ...], recorder: Recorder, *, hurry: bool = False, helping: bool = False
    ) -> list[Outcome]:
        """Do these items."""


class Watch:
    """Watches one run through the pipe `incoming` and answers by `say`; `run` returns when nobody needs it any more.

    `heartbeat` and `stalled` (s) are the charge's.
    """

    def __init__(
        self, hands: Hands, record: Recorder, incoming: int, say: Say, heartbeat: float, stalled: float
    ) -> None:
        self._hands = hands
        self._record = record
        self._incoming = incoming
        self._say = say
        self._heartbeat = heartbeat
        self._stalled = stalled
        self._buffer = b""
        self._unread: list[dict[str, Any]] = []
        self._gone = self._done = False
        self._ending: float | None = None
        self._stopped: tuple[str, float] | None = None
        self._cause = ""
        self._helping = self._alarmed = self._down = False
        self._busy: set[Role] = set()
        self._wake, self._waker = os.pipe()
        os.set_blocking(incoming, False)

    def alarm(self, cause: str) -> None:
        """Have the run told that it must end, from any thread; where it does not begin to, the way down is taken here."""
        if not self._cause:
            self._cause = cause
            os.write(self._waker, b"\0")

    def run(self) -> None:
        """Watch until the run is done, or dead and its instruments safe."""
        while cause := self._guard():
            helped, self._helping = self._helping, False
            self._act(cause, helped=helped)
            if not helped:
                self._hold()
            if self._gone or self._done:
                return

    def _guard(self) -> str:
        """Wait; return why the way down must be taken, or nothing where the run is done."""
        last = monotonic()
        while True:
            due = last + self._heartbeat
            planned = min(due, self._ending or due, self._stopped[1] if self._stopped else due)
            messages = self._hear(planned)
            woke = monotonic()
            if any("beat" in message for message in messages):
                last = woke
            elif woke - planned > _LATE:
                last = max(last, woke - self._heartbeat + _LATE)
            for number, message in enumerate(messages):
                if cause := self._take(message):
                    self._unread = messages[number + 1 :]
                    return cause
            if self._done:
                return ""
            if self._gone:
                return "the run's process has died"
            if woke >= last + self._heartbeat:
                return f"no heartbeat for {self._heartbeat:g} s"
            if self._stopped and monotonic() >= self._stopped[1]:
                by, self._stopped, self._ending = self._stopped[0], None, None
                return f"the run has not begun its shutdown {_BEGIN:g} s after it was requested by {by}"
            if self._ending is not None and monotonic() >= self._ending and self._down:
                self._ending, self._helping = None, True
                return f"the run's shutdown has not switched everything off within {_GRACE:g} s"
            if self._ending is not None and monotonic() >= self._ending:
                self._ending, self._helping = None, not self._cause
                return self._cause or f"what was energised is not off {_GRACE:g} s after an error"

    def _take(self, message: dict[str, Any]) -> str:
        if "beat" in message:
            self._say({"echo": message["beat"]})
            age = float(message.get("age", 0.0))
            if age > self._stalled:
                return f"the run has not got on for {age:.3g} s"
        elif "ending" in message:
            self._ending = self._ending or monotonic() + _GRACE
        elif "ended" in message:
            # An alarm is only answered by the whole way down.
            self._ending = self._ending if self._alarmed else None
        elif "stop" in message:
            self._stopped = (str(message["stop"]), monotonic() + _BEGIN)
        elif "unanswered" in message:
            self._helping = True
            return str(message["unanswered"])
        elif "down" in message:
            self._down, self._stopped = True, None
            # What brakes needs the drive that the guardian would disable.
            brakes = any(item.do is Do.BRAKE for item in self._hands.items)
            self._ending = monotonic() + _GRACE if message.get("on") and not brakes else None
        elif "off" in message:
            self._ending = None
        elif "done" in message:
            self._done = True
            if message.get("unsafe"):
                return "the run could not switch everything off"
            if message.get("journal") is False:
                # Nobody else can write down what the outcome is.
                return "the run's journal cannot be written"
        return ""

    def _act(self, cause: str, *, helped: bool) -> None:
        begun = monotonic()
        self._record.event("took", cause=cause)
        if not helped:
            self._say({"took": cause})
        complain(f"takes the way down: {cause}")
        outcomes = self._hands.walk(self._commands(), self._record, helping=helped)
        failed = failures(outcomes)
        self._busy = {outcome.item.role for outcome in outcomes if outcome.pending}
        self._record.event("walked", seconds=monotonic() - begun, failed=failed)
        self._say({"walked": failed})
        for words in failed:
            complain(words)

    def _hold(self) -> None:
        """Measure that it is safe, and keep it so as long as the run might wake up."""
        pending = {item: monotonic() + item.within for item in self._hands.items if item.measures}
        while True:
            for item, deadline in list(pending.items()):
                (outcome,) = self._hands.walk((item,), _Silent(), hurry=True)
                if not outcome.error or monotonic() >= deadline:
                    del pending[item]
                    self._tell(outcome)
            if self._done or (self._gone and not pending):
                return
            if not self._gone:
                self._hands.walk(self._commands(), _Silent())
            messages = self._hear(monotonic() + _HOLD)
            for number, message in enumerate(messages):
                if "beat" in message:
                    # It has woken up and does not know yet.
                    self._say({"took": "the guardian took the way down meanwhile"})
                self._done = self._done or "done" in message
                if "awake" in message:
                    # From now on it is the run's again, which must soon be on its own way down.
                    self._ending = monotonic() + _WAKE
                    self._unread = messages[number + 1 :]
                    self._say({"yours": True})
                    return

    def _commands(self) -> tuple[Item, ...]:
        # One that has never answered is still being tried.
        return tuple(item for item in self._hands.items if not item.measures and item.role not in self._busy)

    def _tell(self, outcome: Outcome) -> None:
        found = {} if outcome.found is None else {"value": outcome.found.value, "unit": outcome.found.unit}
        self._record.event(
            "measured",
            instrument=outcome.item.role.value,
            item=outcome.item.do.value,
            outcome="failed" if outcome.error else "safe",
            error=outcome.error,
            **found,
        )
        if outcome.error:
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
        if self._cause and not self._alarmed:
            self._alarmed = True
            self._ending = monotonic() + _GRACE
            self._say({"alarm": self._cause})
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

    def event(self, kind: str, **data: Any) -> None:
        """Forget it."""
