"""A run's events sorted by what was going on: for each procedure its steps, for each step what happened in it."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from typing import Any

from bench.journal.codec import RecordedEvent, UnknownEvent
from bench.journal.events.run import ProcedureStarted
from procedures.core.events import Event, StepFailed, StepFinished, StepStarted


@dataclass
class StepPassage:
    """One execution of a step: the sentence it was announced with, bench times (s), its end, and its other events."""

    identifier: str
    sentence: str
    started: float
    ended: float | None = None
    status: str = "started"
    error: str = ""
    events: list[Event | UnknownEvent] = field(default_factory=list)


@dataclass
class ProcedurePassage:
    """One procedure as last begun: its settings and its steps in the order they were taken."""

    name: str
    settings: Mapping[str, Any]
    steps: list[StepPassage] = field(default_factory=list)


def passages(events: Iterable[RecordedEvent]) -> dict[str, ProcedurePassage]:
    """Return the procedures of a journal by name; one that was repeated after a resumption replaces its first execution."""
    result: dict[str, ProcedurePassage] = {}
    procedure: ProcedurePassage | None = None
    open_steps: list[StepPassage] = []
    for recorded in events:
        match recorded.event:
            case ProcedureStarted() as event:
                procedure = ProcedurePassage(event.procedure, event.settings)
                result[procedure.name] = procedure
                open_steps = []
            case StepStarted() as event if procedure is not None:
                step = StepPassage(event.step, event.text, event.time)
                procedure.steps.append(step)
                open_steps.append(step)
            case StepFinished() | StepFailed() as event:
                _end(open_steps, event)
            case event if open_steps:
                open_steps[-1].events.append(event)
    return result


def _end(open_steps: list[StepPassage], event: StepFinished | StepFailed) -> None:
    for step in reversed(open_steps):
        if step.identifier == event.step:
            step.ended = event.time
            step.status = "failed" if isinstance(event, StepFailed) else "finished"
            step.error = event.error if isinstance(event, StepFailed) else ""
            open_steps.remove(step)
            return
