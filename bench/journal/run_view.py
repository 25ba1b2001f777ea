"""The state, results and warnings of a run from its journal, which may be incomplete."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from bench.i18n.errors import NOTHING, InputError, untranslated
from bench.journal.codec import RecordedEvent, UnknownEvent
from bench.journal.encoding import plain
from bench.journal.events.run import (
    ClockSetBack,
    ConsistencyChecked,
    KnownBefore,
    PartialResultMade,
    ProcedureFailed,
    ProcedureFinished,
    ProcedureStarted,
    RunFinished,
    RunResumed,
    RunStarted,
)
from drivers.interfaces.text import Text, Translate, english, text
from procedures.core.events import Event, StepFailed, StepFinished, StepStarted
from procedures.core.misfit_text import told_again
from procedures.core.parameter_set import ParameterSet, merge
from procedures.core.result import Notice, ProcedureResult, Withheld


@dataclass
class ProcedureView:
    """One procedure of a run: its steps as they went, its result once it finished, its cause where it failed.

    `partial` says that it was left early, and that the result is of what it had taken until then.
    """

    steps: list[dict[str, Any]] = field(default_factory=list)
    result: ProcedureResult | None = None
    partial: bool = False
    cause: str = ""
    told: Text = NOTHING
    sentences: Mapping[str, str] = field(default_factory=dict)


#: What a view shows; every other event passes by.
SHOWN = (
    RunStarted, RunResumed, KnownBefore, ClockSetBack, ConsistencyChecked, ProcedureStarted, ProcedureFinished, ProcedureFailed,
    PartialResultMade, StepStarted, StepFinished, StepFailed, RunFinished,
)  # fmt: skip


class RunView:
    """The state that a run's events add up to; feed it events in order."""

    def __init__(self) -> None:
        self.start: RunStarted | None = None
        self.planned: tuple[str, ...] = ()
        self.procedures: dict[str, ProcedureView] = {}
        self.status = "interrupted"
        self.cause = ""
        self.told = NOTHING
        self.bench_time = 0.0
        self.wall_time = 0.0
        self.hand_time = 0.0
        self.sessions = 0
        self._before: list[tuple[str, Notice]] = []
        self._together: list[Notice] = []
        self._here: ProcedureView | None = None

    def apply(self, event: Event) -> None:
        """Take one event into account; events that the view does not show are ignored."""
        if not isinstance(event, SHOWN):
            return
        match event:
            case RunStarted():
                self.start, self.sessions = event, 1
                self.planned = tuple(event.procedures)
            case RunResumed():
                self.status, self.cause, self.told = "interrupted", "", NOTHING
                self.sessions += 1
            case KnownBefore():
                found = (event.procedure, event.warning)
                # A resumed run says again what still holds.
                if found not in self._before:
                    self._before.append(found)
            case ClockSetBack():
                self._before.append(("", _clock_notice(event)))
            case ConsistencyChecked():
                self._together = list(event.warnings)
            case ProcedureStarted():
                self._here = self.procedures[event.procedure] = ProcedureView(sentences=event.steps)
            case ProcedureFinished(result=result):
                self.procedures[result.procedure].result = result
            case PartialResultMade(result=result):
                left = self.procedures[result.procedure]
                left.result, left.partial = result, True
            case ProcedureFailed():
                failed = self.procedures[event.procedure]
                failed.cause, failed.told = event.cause, _told(event)
            case StepStarted() | StepFinished() | StepFailed():
                self._step(event)
            case RunFinished():
                self.status, self.cause, self.told = event.status, event.cause, _told(event)
                self.bench_time += event.bench_time
                self.wall_time += event.wall_time
                self.hand_time += event.hand_time

    @property
    def finished(self) -> dict[str, ProcedureResult]:
        """Results of the procedures that came to their end."""
        return {name: result for name, result in self.results.items() if not self.procedures[name].partial}

    @property
    def results(self) -> dict[str, ProcedureResult]:
        """Results of all procedures, including those that ended early."""
        return {name: view.result for name, view in self.procedures.items() if view.result is not None}

    def parameters(self) -> ParameterSet:
        """Return the best figure of each parameter and the others beside it."""
        return merge(self.results.values())

    def warnings(self) -> list[tuple[str, Notice]]:
        """Return all warnings, each with the procedure it came from; empty for what concerns several.

        What was known before the run began comes first, then what the procedures found, then what their results say together.
        """
        own = [(name, notice) for name, result in self.results.items() for notice in result.warnings]
        return self._before + own + [("", notice) for notice in (*self.parameters().notices, *self._together)]

    @property
    def truth(self) -> dict[str, float]:
        """The virtual motor's true values by parameter name; empty for a real motor."""
        return dict(self.start.truth) if self.start is not None else {}

    def as_dict(self, translate: Translate = english) -> dict[str, Any]:
        """Return it as it stands in `result.json`."""
        merged = self.parameters()
        truth = self.truth
        parameters = {}
        for name, parameter in merged.parameters.items():
            entry = parameter.as_dict()
            entry["alternatives"] = [other.as_dict() for other in merged.alternatives[name]]
            if name in truth:
                entry["truth"] = truth[name]
            parameters[name] = entry
        result: dict[str, Any] = {
            key: plain(getattr(self.start, key, None))
            for key in ("run", "motor", "station", "person", "language", "software", "seed")
        }
        result |= {
            "status": self.status,
            "parameters": parameters,
            "withheld": {name: _withheld(reasons, translate) for name, reasons in merged.withheld.items()},
            "misfit": self._misfit(translate),
            "warnings": [
                {**notice.as_dict(translate), "procedure": procedure or None} for procedure, notice in self.warnings()
            ],
            "procedures": {name: _procedure(view, translate) for name, view in self.procedures.items()},
            "bench_time": self.bench_time,
            "wall_time": self.wall_time,
        }
        if self.start is not None and self.start.faults:
            result["faults"] = list(self.start.faults)
        if self.start is not None and self.start.disturbances:
            result["disturbances"] = self.start.disturbances
        if self.start is not None and self.start.probe_verification:
            result["probe_verification"] = self.start.probe_verification
        if self.cause:
            result["cause"] = self.told.render(translate)
        return result

    def _misfit(self, translate: Translate) -> list[dict[str, Any]]:
        """Return what the procedures' records show beyond their models, each row with its procedure."""
        return [
            {**told_again(row, translate), "procedure": name}
            for name, result in self.results.items()
            for row in result.findings.get("misfit", ())
        ]

    def _step(self, event: StepStarted | StepFinished | StepFailed) -> None:
        if self._here is None:
            return
        steps = self._here.steps
        if isinstance(event, StepStarted):
            words = self._here.sentences.get(event.step, event.text)
            steps.append({"id": event.step, "text": words, "status": "started", "started": event.time})
            return
        for entry in reversed(steps):
            if entry["id"] == event.step and entry["status"] == "started":
                entry["status"] = "finished" if isinstance(event, StepFinished) else "failed"
                entry["ended"] = event.time
                if isinstance(event, StepFailed):
                    entry["error"] = event.error
                return


def _told(event: ProcedureFailed | RunFinished) -> Text:
    """Return why for a reader of any language; older versions wrote it in the run's alone."""
    return untranslated(event.cause) if event.told is None else event.told.text


def _clock_notice(event: ClockSetBack) -> Notice:
    message = text(
        "this computer's clock was set back by {seconds:.0f} s during the run: the numbers of the journal's "
        "events show their order, the clock times do not",
        seconds=event.seconds,
    )
    return Notice("clock-set-back", message)


def view_of(events: Iterable[RecordedEvent]) -> RunView:
    """Return the view that follows from a journal's events. Raises InputError for an event that is not as a run writes it."""
    view = RunView()
    for recorded in events:
        event = recorded.event
        if isinstance(event, UnknownEvent):
            if event.misfit:
                raise _not_readable(recorded, event.misfit)
            continue
        try:
            view.apply(event)
        except KeyError as error:
            raise _not_readable(recorded, f"KeyError: {error}") from None
    return view


def _not_readable(recorded: RecordedEvent, why: str) -> InputError:
    return InputError(
        text(
            "event {number} ({kind}) is not as this version of motorbench writes it ({why}); "
            "read the run with the version that made it",
            number=recorded.number,
            kind=recorded.kind,
            why=why,
        )
    )


def _withheld(reasons: Sequence[Withheld], translate: Translate) -> dict[str, Any]:
    first, *others = reasons
    return {**first.as_dict(translate), "others": [other.as_dict(translate) for other in others]}


def _procedure(view: ProcedureView, translate: Translate) -> dict[str, Any]:
    result = view.result
    made: dict[str, Any] = {
        "status": "completed" if result and not view.partial else ("failed" if view.cause else "interrupted"),
        "parameters": {p.name: p.as_dict() for p in result.parameters} if result else {},
        "withheld": {w.name: w.as_dict(translate) for w in result.withheld} if result else {},
        "findings": dict(result.findings) if result else {},
        "warnings": [notice.as_dict(translate) for notice in result.warnings] if result else [],
        "steps": view.steps,
    }
    if view.cause:
        made["cause"] = view.told.render(translate)
    return made
