"""The script of a rehearsal, in order: procedure, step, then every action, set point and energised block, each against its limit."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from bench.journal.events.instruments import DeEnergised, Energised, InstrumentFailed, ReadingTaken, SettingDone
from bench.journal.events.run import ProcedureFailed, ProcedureFinished, ProcedureStarted
from bench.safety.limits.bounds import Limit, SetPoint
from drivers.interfaces import NotOfferedError, Role
from drivers.interfaces.declarations import quantities
from drivers.interfaces.text import Translate
from procedures.core.events import (
    ActionStarted,
    Event,
    MayBeAsked,
    StepFailed,
    StepFinished,
    StepStarted,
    UnknownAction,
)

#: Errors that say that a limit would be passed.
_REFUSALS = ("SetpointError: ", "LimitError: ")
_LIMITED = frozenset(role.value for role in Role if quantities(role.interface))

#: Gives the largest value that an instrument by its name takes of a parameter by itself.
Own = Callable[[str, str], Limit]
#: Gives the only values that it takes of a parameter; none where it takes any.
Offered = Callable[[str, str], Sequence[float]]


@dataclass(frozen=True)
class ScriptLine:
    """One thing that happens: `kind` is action, perhaps, set point, on, off or setting; `times` counts it where it is repeated at once.

    `perhaps` names lines that hands may have to connect once more, as readings have it.
    """

    kind: str
    instrument: str = ""
    call: str = ""
    words: tuple[str, ...] = ()
    set_point: SetPoint | None = None
    times: int = 1

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON; a limit that does not exist is null."""
        result: dict[str, Any] = {"kind": self.kind}
        if self.instrument:
            result |= {"instrument": self.instrument, "call": self.call}
        if self.words:
            result["text"] = list(self.words)
        if self.set_point is not None:
            result |= _told(self.set_point)
        return result | ({"times": self.times} if self.times > 1 else {})


@dataclass
class StepScript:
    """One step: its place in the document, its sentence, when it began (bench time, s), and what happens in it."""

    identifier: str
    sentence: str
    began: float
    lines: list[ScriptLine] = field(default_factory=list)

    def add(self, line: ScriptLine) -> None:
        """Append a line, or count the last one where it is the same."""
        if self.lines and replace(self.lines[-1], times=1) == line:
            self.lines[-1] = replace(line, times=self.lines[-1].times + 1)
        else:
            self.lines.append(line)


@dataclass
class ProcedureScript:
    """One procedure: its steps, how long it takes (bench time, s), of that by hand, and why it did not end well."""

    name: str
    section: str
    began: float
    hands_before: float
    duration: float = 0.0
    hand_time: float = 0.0
    cause: str = ""
    steps: list[StepScript] = field(default_factory=list)


class Script:
    """Listens to the journal of a rehearsal and its set points; `names` are the instruments', by role."""

    def __init__(
        self,
        now: Callable[[], float],
        hand_time: Callable[[], float],
        own: Own,
        offered: Offered,
        names: Mapping[str, str],
        translate: Translate,
    ) -> None:
        self._now = now
        self._hand_time = hand_time
        self._own = own
        self._offered = offered
        self._names = names
        self._translate = translate
        self._sentences: Mapping[str, str] = {}
        self._settings: Mapping[str, Any] = {}
        self._open: list[StepScript] = []
        #: Whether readings decide what happens now: it has been said, and what the twin's led to is not listed.
        self._perhaps = False
        self.procedures: list[ProcedureScript] = []
        #: The largest set point by instrument and parameter.
        self.highest: dict[tuple[str, str], SetPoint] = {}
        #: The largest readings on the twin by instrument and unit.
        self.reached: dict[tuple[str, str], float] = {}
        #: What would pass a limit: the procedure, and the refusal in full.
        self.violations: list[tuple[str, str]] = []

    def hear(self, event: Event) -> None:
        """Take an event of the journal."""
        match event:
            case ProcedureStarted():
                self._sentences, self._settings = event.steps, event.settings
                self._perhaps = False
                self.procedures.append(ProcedureScript(event.procedure, event.section, self._now(), self._hand_time()))
            case ProcedureFinished():
                self._end()
            case ProcedureFailed():
                self._end()
                self.procedures[-1].cause = event.cause
            case StepStarted():
                words = self._sentences.get(event.step, event.text)
                self._open.append(StepScript(event.step, words, event.time))
                if not self._perhaps:
                    self.procedures[-1].steps.append(self._open[-1])
            case StepFinished() | StepFailed():
                self._open.pop()
            case MayBeAsked():
                if event.lines:
                    self._add(ScriptLine("perhaps", words=tuple(event.lines)))
                self._perhaps = bool(event.lines)
            case ActionStarted():
                self._add(ScriptLine("action", words=self._lines(event)))
            case SettingDone():
                self._setting(event)
            case ReadingTaken():
                self._reading(event)
            case Energised():
                self._add(ScriptLine("on", self._names[event.instrument], event.call))
            case DeEnergised():
                # A block that could not be entered tells why when it ends.
                self._refused(event.instrument, event.error or "")
                self._add(ScriptLine("off", self._names[event.instrument], event.call))
            case InstrumentFailed():
                self._refused(event.instrument, event.error)

    def set_point(self, point: SetPoint) -> None:
        """Take a set point; the instrument's own range bounds it as well."""
        own = self._own(point.instrument, point.parameter)
        if own.value < point.bound:
            point = replace(point, bound=own.value, owner=own.owner)
        offered = self._offered(point.instrument, point.parameter)
        # Other values are tried to verify a connection, which goes on without them.
        asked_for = self._settings.get(point.parameter) == point.value
        if offered and asked_for and not any(math.isclose(point.value, one, rel_tol=1e-6) for one in offered):
            error = NotOfferedError(point.instrument, point.parameter, point.value, point.unit, offered)
            self._violated(error.text.render(self._translate))
        self._add(ScriptLine("set point", point.instrument, point.call, set_point=point))
        key = (point.instrument, point.parameter)
        before = self.highest.get(key)
        if math.isfinite(point.value) and (before is None or abs(point.value) > abs(before.value)):
            self.highest[key] = point

    def _end(self) -> None:
        here = self.procedures[-1]
        here.duration, here.hand_time = self._now() - here.began, self._hand_time() - here.hands_before

    def _lines(self, event: ActionStarted) -> tuple[str, ...]:
        if isinstance(event.details, UnknownAction):
            return tuple(event.text)
        return tuple(line.render(self._translate) for line in event.details.lines({}))

    def _setting(self, event: SettingDone) -> None:
        # What was held against limits stands there as a set point already.
        if event.instrument not in _LIMITED:
            said = tuple(_short(value) for value in (*event.arguments, *event.named.values()))
            self._add(ScriptLine("setting", self._names[event.instrument], event.call, said))

    def _reading(self, event: ReadingTaken) -> None:
        value = event.value
        if not isinstance(value, Mapping):
            return
        found = {value["unit"]: value["value"]} if "unit" in value else {}
        found |= {unit: value[name] for name, unit in (("speed", "rad/s"), ("torque", "N·m")) if name in value}
        for unit, reached in found.items():
            key = (self._names[event.instrument], unit)
            self.reached[key] = max(self.reached.get(key, 0.0), abs(reached))

    def _refused(self, instrument: str, error: str) -> None:
        if instrument in _LIMITED and error.startswith(_REFUSALS):
            self._violated(error.partition(": ")[2])

    def _violated(self, refusal: str) -> None:
        violation = self._where(), refusal
        # A setting that is restored passes the same limit again.
        if violation not in self.violations:
            self.violations.append(violation)

    def _where(self) -> str:
        return self.procedures[-1].name if self.procedures else ""

    def _add(self, line: ScriptLine) -> None:
        # A block that was entered in one step may be left between two: that belongs to the one before.
        steps = self._open or (self.procedures[-1].steps if self.procedures else [])
        if steps and not self._perhaps:
            steps[-1].add(line)


def _told(point: SetPoint) -> dict[str, Any]:
    return {
        "parameter": point.parameter,
        "value": point.value if math.isfinite(point.value) else str(point.value),
        "unit": point.unit,
        "limit": point.bound if math.isfinite(point.bound) else None,
        "whose": str(point.owner) if math.isfinite(point.bound) else None,
        "allowed": point.allowed,
    }


def highest_as_dict(highest: Mapping[tuple[str, str], SetPoint]) -> dict[str, dict[str, Any]]:
    """Return the largest set points by instrument and parameter, each with its limit."""
    result: dict[str, dict[str, Any]] = {}
    for (instrument, parameter), point in highest.items():
        told = _told(point)
        result.setdefault(instrument, {})[parameter] = {key: told[key] for key in ("value", "unit", "limit", "whose")}
    return result


def _short(value: Any) -> str:
    if isinstance(value, float):
        return f"{value:g}"
    if isinstance(value, Mapping):
        return ", ".join(f"{key} {_short(item)}" for key, item in value.items() if item is not None)
    if isinstance(value, list | tuple):
        return " ".join(_short(item) for item in value)
    return str(value)
