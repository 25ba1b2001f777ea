"""The connections with which a run measured, by procedure, each drawn once."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial
from itertools import permutations

from bench.drawings.connections import draw_connections
from bench.drawings.layout import Layout
from bench.drawings.leads import leads_of
from bench.journal.codec import RecordedEvent
from bench.journal.events.instruments import ReadingTaken, WaveformsTaken
from bench.journal.events.run import ProcedureStarted
from drivers.interfaces.text import Translate
from procedures.core.actions import Terminal
from procedures.core.events import ActionStarted, StepStarted, UnknownAction
from procedures.core.nameplate import Nameplate
from reports.document.record import ConnectionRecord


@dataclass
class _Made:
    """A connection and the steps that measured with it; `others` are those that differ in the terminals only."""

    layout: Layout
    steps: list[str] = field(default_factory=list)
    others: list[Layout] = field(default_factory=list)


def measured_connections(events: Iterable[RecordedEvent], nameplate: Nameplate) -> dict[str, list[ConnectionRecord]]:
    """Return each procedure's connections in the order in which something was first read with them."""
    layout, procedure, step, kind = Layout(), "", "", None
    found: dict[str, dict[object, _Made]] = {}
    for recorded in events:
        match recorded.event:
            case ProcedureStarted() as event:
                procedure, step = event.procedure, ""
                found[procedure] = {}
            case StepStarted() as event:
                step = event.step
            case ActionStarted(details=details) if not isinstance(details, UnknownAction):
                layout = layout.after(details)
                kind = _kind(layout) if leads_of(layout) else None
            case ReadingTaken() | WaveformsTaken() if procedure and kind is not None:
                made = found[procedure].setdefault(kind, _Made(layout))
                made.steps.append(step)
                if layout != made.layout and layout not in made.others:
                    made.others.append(layout)
    return {name: _records(list(made.values()), nameplate) for name, made in found.items()}


def _records(made: list[_Made], nameplate: Nameplate) -> list[ConnectionRecord]:
    return [ConnectionRecord(one.steps, partial(_drawn, one.layout, nameplate), len(one.others)) for one in made]


def _drawn(layout: Layout, nameplate: Nameplate, translate: Translate) -> str:
    return draw_connections(layout, nameplate, translate)


def _kind(layout: Layout) -> object:
    """Return what connections share that differ in which terminals they are made to: the first of all exchanges."""
    terminals = [terminal.value for terminal in Terminal]
    leads = leads_of(layout)

    def exchanged(names: dict[str, str]) -> list[tuple[str, ...]]:
        return sorted(
            (lead.role.value, lead.socket, lead.kind.value, names.get(lead.node, lead.node)) for lead in leads
        )

    first = min(exchanged(dict(zip(terminals, names, strict=True))) for names in permutations(terminals))
    return tuple(first), layout.dynamometer_coupled
