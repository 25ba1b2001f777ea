"""A run's events sorted by what was going on: for each procedure its steps, for each step what happened in it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bench.journal.journal_file import Event


@dataclass
class StepPassage:
    """One passage through a step: the sentence it was announced with, bench times (s), its end, and its other events."""

    identifier: str
    sentence: str
    started: float
    ended: float | None = None
    status: str = "started"
    error: str = ""
    events: list[Event] = field(default_factory=list)


@dataclass
class ProcedurePassage:
    """One procedure as last begun: its settings and its steps in the order they were taken."""

    name: str
    settings: Mapping[str, Any]
    steps: list[StepPassage] = field(default_factory=list)


def passages(events: Iterable[Event]) -> dict[str, ProcedurePassage]:
    """Return the procedures of a journal by name; one begun anew after a resumption replaces its first passage."""
    found: dict[str, ProcedurePassage] = {}
    procedure: ProcedurePassage | None = None
    open_steps: list[StepPassage] = []
    for event in events:
        data = event.data
        if event.kind == "procedure_started":
            procedure = ProcedurePassage(data["procedure"], data.get("settings", {}))
            found[procedure.name] = procedure
            open_steps = []
        elif event.kind == "step_started" and procedure is not None:
            step = StepPassage(data["step"], data["text"], data["time"])
            procedure.steps.append(step)
            open_steps.append(step)
        elif event.kind in ("step_finished", "step_failed"):
            _end(open_steps, event)
        elif open_steps:
            open_steps[-1].events.append(event)
    return found


def _end(open_steps: list[StepPassage], event: Event) -> None:
    for step in reversed(open_steps):
        if step.identifier == event.data["step"]:
            step.ended = event.data["time"]
            step.status = "finished" if event.kind == "step_finished" else "failed"
            step.error = event.data.get("error", "")
            open_steps.remove(step)
            return
