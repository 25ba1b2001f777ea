"""The one place where events become lines of a journal, and lines become events."""

import json
from collections.abc import Callable, Collection, Mapping
from dataclasses import MISSING, dataclass, fields
from functools import cache
from typing import Any

from bench.journal.encoding import dumps, to_bytes
from bench.journal.events import instruments, run, safety
from bench.journal.stored_action import restore_action
from procedures.core import events as procedures
from procedures.core.events import ActionStarted, Event, UnknownAction

#: Classes by kind.
KINDS: Mapping[str, type[Event]] = {
    each.kind: each
    for module in (procedures, run, instruments, safety)
    for each in vars(module).values()
    if isinstance(each, type) and issubclass(each, Event) and each.kind
}


@dataclass(frozen=True)
class UnknownEvent:
    """An event that this version cannot read; `misfit` says why where it knows the kind."""

    kind: str
    data: Mapping[str, Any]
    misfit: str = ""


@dataclass(frozen=True)
class RecordedEvent:
    """One event of a journal: `number` from 1, `wall` time (ISO 8601, UTC), bench `time` (s), and what happened."""

    number: int
    wall: str
    time: float
    event: Event | UnknownEvent

    @property
    def kind(self) -> str:
        """Kind of the event, as the journal names it."""
        return self.event.kind

    @property
    def data(self) -> dict[str, Any]:
        """Its data as they stand in the journal."""
        result: dict[str, Any] = json.loads(dumps(data_of(self.event)))
        return result


def encode(recorded: RecordedEvent, previous: str) -> bytes:
    """Return the line of an event, without its end; `previous` is the SHA-256 of the line before."""
    return line_of(recorded.number, recorded.wall, recorded.time, recorded.event, previous)


def line_of(number: int, wall: str, time: float, event: Event | UnknownEvent, previous: str) -> bytes:
    """Return the line of an event that happens, as `encode` does."""
    entry = {"n": number, "wall": wall, "time": time, "kind": event.kind, "data": data_of(event), "previous": previous}
    return to_bytes(dumps(entry))


def decode(line: bytes, only: Collection[str] | None = None) -> tuple[RecordedEvent, str] | None:
    """Return the event of a line and the SHA-256 it carries of the line before; None for what is no event.

    One of a kind beside `only`, where that is given, is returned as its data.
    """
    try:
        raw = json.loads(line)
        number, wall, time, kind = raw["n"], raw["wall"], raw["time"], raw["kind"]
        data, previous = raw["data"], raw["previous"]
    except (ValueError, KeyError, TypeError, RecursionError):
        return None
    expected = ((number, int), (wall, str), (time, float | int), (kind, str), (data, dict), (previous, str))
    if not all(isinstance(value, type_) for value, type_ in expected):
        return None
    event = event_of(kind, data) if only is None or kind in only else UnknownEvent(kind, data)
    return RecordedEvent(number, wall, time, event), previous


def event_of(kind: str, data: dict[str, Any]) -> Event | UnknownEvent:
    """Return the event that these data of a journal tell of."""
    event_type = KINDS.get(kind)
    if event_type is None:
        return UnknownEvent(kind, data)
    try:
        return _validator(kind)(_with_action(data) if event_type is ActionStarted else data)
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError) as error:
        return UnknownEvent(kind, data, f"{type(error).__name__}: {error}")


def data_of(event: Event | UnknownEvent) -> Mapping[str, Any]:
    """Return an event's data by name; those that are optional and have their default are left out."""
    if isinstance(event, UnknownEvent):
        return event.data
    left_out = _LEFT_OUT[type(event)]
    if not left_out:
        return vars(event)
    data = dict(vars(event))
    for name, default in left_out:
        if data[name] == default:
            del data[name]
    return data


def _with_action(data: dict[str, Any]) -> dict[str, Any]:
    try:
        return {**data, "details": restore_action(data)}
    except ValueError:
        return {**data, "details": UnknownAction(data["details"])}


def _optional(event_type: type[Event]) -> tuple[tuple[str, object], ...]:
    """Return the fields that may be left out, with their defaults."""
    found = (each for each in fields(event_type) if each.metadata.get("optional"))  # type: ignore[arg-type]  # a dataclass
    return tuple((each.name, {} if each.default is MISSING else each.default) for each in found)


#: Of each class the fields that are left out where they have their defaults.
_LEFT_OUT = {each: _optional(each) for each in KINDS.values()}


@cache
def _validator(kind: str) -> Callable[[dict[str, Any]], Event]:
    # Late: whoever only writes is ready sooner without.
    from pydantic import TypeAdapter

    return TypeAdapter(KINDS[kind]).validate_python
