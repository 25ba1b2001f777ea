"""A person at a panel in another process: questions are put on the run's line, and answers checked here."""

import math
import threading
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import count
from time import monotonic
from typing import Any, Protocol

from bench.journal.stored_result import store_text
from bench.operators import panel_answers
from bench.operators.entry import TypedEntry, TypedReading
from bench.operators.operator_channel import OperatorLine
from bench.operators.stored_plot import store_plot
from bench.safety.interrupts import Interrupted, Interrupts
from bench.safety.read_back import Found, ReadBack
from drivers.interfaces.text import Text, text, text_of
from drivers.manual.prompt import Option
from procedures.core.actions import DoubtReading, EnterCommand, EnterReading, HandWork, MarkRestPositions, Mend
from procedures.core.bench import Operator
from procedures.core.live_plot import LivePlot

#: Waiting is cut into slices (s): an exception in the middle of it could leave the condition's lock taken.
_SLICE = 0.05
#: So long (s) after the sources have been read back they are asked anew.
_READ_BACK = 0.3


@dataclass(frozen=True)
class _Correction:
    """A request made instead of an answer: to correct an earlier reading or, without one, to repeat the procedure."""

    by: str
    reading: TypedReading | None = None
    value: float = math.nan
    typed: str = ""


class RunSources(Protocol):
    """The run's sources and its shaft."""

    def read(self, *, again: bool = False) -> Sequence[ReadBack]:
        """Return what each source reports now; `again` also retries those that could not be opened."""


class StandIn(Operator, Protocol):
    """Does on a virtual bench what a person confirms."""

    def wait(self, seconds: float) -> None:
        """Run the bench for a time (s)."""


class DistantOperator:
    """Asks whoever listens on the run's line, and waits.

    `hands` perform what a person confirms where the bench is a virtual one, and read what is to be read. An abort is a request to
    stop made of `interrupts`. Where nobody has watched for `patience` (s), the run ends too: nothing stays energised before
    an empty chair.
    """

    def __init__(self, interrupts: Interrupts, hands: StandIn | None = None, *, patience: float = 60.0) -> None:
        self._interrupts = interrupts
        self._hands = hands
        self._patience = patience
        self._condition = threading.Condition()
        self._numbers = count(1)
        self._question: dict[str, Any] | None = None
        self._given: list[Any] = []
        self._watched = monotonic()
        self._closed = threading.Event()
        #: The sources that are read back while a person is asked, once the run has them.
        self.sources: RunSources | None = None
        self._read_back = -math.inf
        self._again = False
        self.entry = TypedEntry()
        self.line = OperatorLine(self._hear)
        self._watch = threading.Thread(target=self._watch_chair, name="empty chair", daemon=True)
        self._watch.start()

    def perform(self, action: HandWork) -> object:
        """Request an action or a reading; return its result."""
        if isinstance(action, EnterReading):
            seen = self._hands.perform(action) if self._hands else None
            return self.number(
                action.quantity, action.unit, action.minimum, action.maximum, action=action, proposed=seen
            )
        if isinstance(action, DoubtReading) and self._hands is None:
            return self._correctable({"kind": "doubt", "lines": [store_text(action.finding)]}, panel_answers.yes_or_no)
        if isinstance(action, EnterCommand):
            asked = {
                "kind": "command",
                "details": action,
                "said": store_text(action.said),
                "lines": [store_text(action.sentence())],
            }
            return self._ask(asked, panel_answers.words, action.idle)
        said: dict[str, Any] = {"kind": "action", "action": type(action).__name__, "details": action}
        said["lines"] = [store_text(line) for line in action.lines({})]
        said["at_shaft"] = getattr(action, "at_shaft", False)
        if isinstance(action, MarkRestPositions) and self._hands is None:
            return [math.radians(angle) for angle in self._ask({**said, "kind": "angles"}, panel_answers.angles)]
        self._correctable(said, panel_answers.nothing)
        if isinstance(action, Mend) and self._hands is None:
            # Who does not want to go on aborts.
            return True
        return self._hands.perform(action) if self._hands else None

    def number(
        self,
        quantity: Text,
        unit: str,
        minimum: float,
        maximum: float,
        *,
        action: HandWork | None = None,
        proposed: object = None,
        options: Sequence[Option] = (),
    ) -> float:
        """Ask for a number in `unit` within `minimum` … `maximum`, or for one of the `options` by its number."""
        known = self.entry.known(quantity, unit, minimum, maximum, options)
        if known is not None:
            return known
        asked: dict[str, Any] = {
            "kind": "number",
            "quantity": store_text(quantity),
            "unit": unit,
            "minimum": minimum,
            "maximum": maximum,
            "proposed": proposed,
            "options": panel_answers.told_options(options),
        }
        if action is not None:
            asked |= {"action": type(action).__name__, "details": action}

        # What a page gives is kept as it was typed; only the thread that asks writes into the journal.
        tried: list[tuple[str, Text | None]] = []

        def checked(given: object) -> float:
            try:
                number = panel_answers.number(given, unit, (minimum, maximum), options)
            except ValueError as fault:
                tried.append((str(given), text_of(fault)))
                raise
            tried.append((str(given), None))
            return number

        value = float(self._correctable(asked, checked))
        for typed, refused in tried[:-1]:
            self.entry.typed(quantity, unit, minimum, maximum, typed, None, refused, options)
        self.entry.typed(quantity, unit, minimum, maximum, tried[-1][0], value, options=options)
        return value

    def choice(self, quantity: Text, options: Sequence[Option]) -> float:
        """Ask for one of the options; return its number."""
        numbers = [option.number for option in options]
        return self.number(quantity, "", min(numbers), max(numbers), options=options)

    def confirm(self, instrument: str, task: Text) -> None:
        """Ask for a task on an instrument that is set by hand."""
        self._ask({"kind": "confirm", "instrument": instrument, "task": store_text(task)}, panel_answers.nothing)

    @property
    def looks(self) -> bool:
        """True if a panel listens."""
        return self.line.heard

    def show(self, plot: LivePlot | None) -> None:
        """Show a plot at the panels, or none any more."""
        self.line.say({"plot": store_plot(plot) if plot else None})

    def close(self) -> None:
        """Take the line down."""
        self._closed.set()
        self._watch.join()
        self.line.close()

    def _correctable(self, asked: Mapping[str, Any], check: Callable[[object], Any]) -> Any:
        """Return what is answered; before that, earlier readings may be corrected."""
        told: dict[str, Any] = {}
        while True:
            readings = [panel_answers.told(reading) for reading in self.entry.readings]
            answer = self._ask({**asked, "readings": readings, **told}, check)
            if not isinstance(answer, _Correction):
                return answer
            if answer.reading is None:
                self.entry.repeat(answer.by)
                continue
            fault = self.entry.correct(answer.reading, answer.value, answer.typed, answer.by)
            told = {"uncorrected": {"number": answer.reading.number, "why": store_text(fault)}}

    def _ask(self, asked: Mapping[str, Any], check: Callable[[object], Any], patience: float | None = None) -> Any:
        """Return what is answered, None where nobody answered within `patience` (s), if there is such a limit."""
        deadline = math.inf if patience is None else monotonic() + patience
        number = next(self._numbers)
        with self._condition:
            self._question = {**asked, "id": number, "check": check}
            self._given = []
        self.line.say({"question": {**asked, "id": number}})
        try:
            while True:
                # Nobody is kept waiting for an instrument: what is answered meanwhile is taken.
                self._tell_sources()
                with self._condition:
                    if self._given:
                        return self._given[0]
                    if self._closed.is_set():
                        raise Interrupted(text("the panel's line, which was taken down"))
                    self._interrupts.check()
                    if monotonic() > deadline:
                        return None
                    self._condition.wait(_SLICE)
        finally:
            with self._condition:
                self._question = None
            self.line.say({"question": None})

    def _tell_sources(self) -> None:
        """Read the sources back, where it is time; only the run's own thread may ask its instruments."""
        due = self._again or monotonic() - self._read_back >= _READ_BACK
        if self.sources is None or not due or not self.line.heard or not self._interrupts.in_own_thread():
            return
        again, self._again = self._again, False
        found = self.sources.read(again=again)
        self._read_back = monotonic()
        if self._hands is not None and any(one.found is Found.ON for one in found):
            # A shaft that runs down comes to rest while the person waits.
            self._hands.wait(_READ_BACK)
        said = [
            {
                "role": one.role,
                "found": one.found.value,
                "feeds": one.feeds,
                "values": [[value.value, value.unit] for value in one.values],
                "error": store_text(one.error) if one.error else None,
            }
            for one in found
        ]
        self.line.tell({"sources": said})

    def _hear(self, message: Mapping[str, Any]) -> Text | None:
        self._watched = monotonic()
        if "abort" in message:
            self._interrupts.request(text("{person} at the panel", person=message["abort"] or text("a person")))
            return None
        if message.get("again"):
            self._again = True
            return None
        if not message.keys() & {"answer", "correct", "repeat"}:
            allowed = text("there are answer, correct, repeat, abort, again and watching")
            return None if message.get("watching") else allowed
        with self._condition:
            question = self._question
            if question is None or message.get("id") != question["id"]:
                return text("this is not asked any more")
            if self._given:
                return text("this is answered already")
            try:
                correction = "answer" not in message and "readings" in question
                self._given = [self._corrected(message) if correction else question["check"](message.get("answer"))]
            except ValueError as fault:
                return text_of(fault)
            self._condition.notify_all()
        return None

    def _corrected(self, message: Mapping[str, Any]) -> "_Correction":
        """Return what is wanted instead of an answer. Raises ValueError for what no reading can be."""
        by, wanted = str(message.get("by", "")), message.get("correct")
        if wanted is None:
            return _Correction(by)
        try:
            number, typed = int(wanted["number"]), str(wanted["typed"])
        except (TypeError, KeyError, ValueError):
            raise ValueError(text("a correction is a reading's number and what is typed")) from None
        return _Correction(by, *self.entry.checked(number, typed), typed)

    def _watch_chair(self) -> None:
        while not self._closed.wait(min(1.0, self._patience / 4.0)):
            alone = monotonic() - self._watched
            if alone > self._patience:
                self._interrupts.request(text("no panel has been open for {time:.0f} s", time=alone))
                return
