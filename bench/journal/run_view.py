"""What a journal comes to: the run's state, results and warnings, whole or cut off anywhere."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bench.i18n.errors import InputError, said_by
from bench.journal.journal_file import Event
from bench.journal.stored_result import restore, restore_notice
from drivers.interfaces.text import Translate, english, text
from procedures.core.parameter_set import ParameterSet, merge
from procedures.core.result import Notice, ProcedureResult

#: What comes of an event whose data are of another form.
_MISFITS = (KeyError, TypeError, ValueError, AttributeError, IndexError, OverflowError, RecursionError)


@dataclass
class ProcedureView:
    """One procedure of a run: its steps as they went, its result once it finished, its cause where it failed."""

    steps: list[dict[str, Any]] = field(default_factory=list)
    result: ProcedureResult | None = None
    cause: str = ""
    sentences: Mapping[str, str] = field(default_factory=dict)


class RunView:
    """The state that a run's events add up to; feed it events in order."""

    def __init__(self) -> None:
        self.start: Mapping[str, Any] = {}
        self.planned: tuple[str, ...] = ()
        self.settings: Mapping[str, Any] = {}
        self.procedures: dict[str, ProcedureView] = {}
        self.status = "interrupted"
        self.cause = ""
        self.bench_time = 0.0
        self.wall_time = 0.0
        self.sessions = 0
        self._before: list[tuple[str, Notice]] = []
        self._together: list[Notice] = []
        self._here: ProcedureView | None = None

    def apply(self, kind: str, data: Mapping[str, Any]) -> None:
        """Take one event into account; kinds that the view does not show pass by."""
        take = getattr(self, f"_{kind}", None)
        if take is not None:
            take(data)

    @property
    def finished(self) -> dict[str, ProcedureResult]:
        """Results of the procedures that came to their end."""
        return {name: view.result for name, view in self.procedures.items() if view.result is not None}

    def parameters(self) -> ParameterSet:
        """Return the best figure of each parameter and the others beside it."""
        return merge(self.finished.values())

    def warnings(self) -> list[tuple[str, Notice]]:
        """Return all warnings, each with the procedure it came from; empty for what concerns several.

        What was known before the run began comes first, then what the procedures found, then what their results say together.
        """
        own = [(name, notice) for name, result in self.finished.items() for notice in result.warnings]
        return self._before + own + [("", notice) for notice in (*self.parameters().notices, *self._together)]

    @property
    def truth(self) -> dict[str, float]:
        """The virtual motor's true values by parameter name; empty for a real motor."""
        return dict(self.start.get("truth", {}))

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
        made: dict[str, Any] = {
            key: self.start.get(key) for key in ("run", "motor", "station", "person", "language", "software", "seed")
        }
        made |= {
            "status": self.status,
            "parameters": parameters,
            "warnings": [
                {**notice.as_dict(translate), "procedure": procedure or None} for procedure, notice in self.warnings()
            ],
            "procedures": {name: _procedure(view, translate) for name, view in self.procedures.items()},
            "bench_time": self.bench_time,
            "wall_time": self.wall_time,
        }
        if self.start.get("faults"):
            made["faults"] = self.start["faults"]
        if self.cause:
            made["cause"] = self.cause
        return made

    def _run_started(self, data: Mapping[str, Any]) -> None:
        self.start = data
        self.sessions = 1
        self.planned = tuple(data["procedures"])
        self.settings = data["settings"]

    def _run_resumed(self, data: Mapping[str, Any]) -> None:
        self.status, self.cause = "interrupted", ""
        self.sessions += 1

    def _known_before(self, data: Mapping[str, Any]) -> None:
        found = (data["procedure"], restore_notice(data["warning"]))
        # A resumed run says again what still holds.
        if found not in self._before:
            self._before.append(found)

    def _clock_set_back(self, data: Mapping[str, Any]) -> None:
        said = text(
            "this computer's clock was set back by {seconds:.0f} s during the run: the journal's order is that of its numbers, "
            "its wall times are not",
            seconds=float(data["seconds"]),
        )
        self._before.append(("", Notice("clock-set-back", said)))

    def _consistency_checked(self, data: Mapping[str, Any]) -> None:
        self._together = [restore_notice(entry) for entry in data["warnings"]]

    def _procedure_started(self, data: Mapping[str, Any]) -> None:
        self._here = ProcedureView(sentences=data["steps"])
        self.procedures[data["procedure"]] = self._here

    def _step_started(self, data: Mapping[str, Any]) -> None:
        if self._here is not None:
            words = self._here.sentences.get(data["step"], data["text"])
            self._here.steps.append({"id": data["step"], "text": words, "status": "started", "started": data["time"]})

    def _step_finished(self, data: Mapping[str, Any]) -> None:
        self._end_step(data, "finished")

    def _step_failed(self, data: Mapping[str, Any]) -> None:
        self._end_step(data, "failed")

    def _end_step(self, data: Mapping[str, Any], status: str) -> None:
        steps = self._here.steps if self._here is not None else []
        for entry in reversed(steps):
            if entry["id"] == data["step"] and entry["status"] == "started":
                entry["status"] = status
                entry["ended"] = data["time"]
                if "error" in data:
                    entry["error"] = data["error"]
                return

    def _procedure_finished(self, data: Mapping[str, Any]) -> None:
        view = self.procedures[data["result"]["procedure"]]
        view.result = restore(data["result"])

    def _procedure_failed(self, data: Mapping[str, Any]) -> None:
        self.procedures[data["procedure"]].cause = data["cause"]

    def _run_finished(self, data: Mapping[str, Any]) -> None:
        self.status, self.cause = data["status"], data.get("cause", "")
        self.bench_time += data["bench_time"]
        self.wall_time += data["wall_time"]


def view_of(events: Iterable[Event]) -> RunView:
    """Return what a journal's events come to. Raises InputError for an event that is not as a run writes it."""
    view = RunView()
    for event in events:
        try:
            view.apply(event.kind, event.data)
        except _MISFITS as error:
            raise InputError(
                text(
                    "event {number} ({kind}) is not as this version of motorbench writes it "
                    "({name}: {error}); read the run with the version that made it",
                    number=event.number,
                    kind=event.kind,
                    name=type(error).__name__,
                    error=said_by(error),
                )
            ) from None
    return view


def _procedure(view: ProcedureView, translate: Translate) -> dict[str, Any]:
    result = view.result
    made: dict[str, Any] = {
        "status": "completed" if result else ("failed" if view.cause else "interrupted"),
        "parameters": {p.name: p.as_dict() for p in result.parameters} if result else {},
        "findings": dict(result.findings) if result else {},
        "warnings": [notice.as_dict(translate) for notice in result.warnings] if result else [],
        "steps": view.steps,
    }
    if view.cause:
        made["cause"] = view.cause
    return made
