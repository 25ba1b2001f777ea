"""Events for tests, from what of their data a test is about."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, fields, is_dataclass
from types import NoneType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

from bench.journal.codec import KINDS, RecordedEvent, UnknownEvent, event_of
from procedures.core.events import Event

_EMPTY: dict[type, Any] = {str: "", int: 0, float: 0.0, bool: False}


def event(kind: str, **data: Any) -> Event | UnknownEvent:
    """Return an event of these data; what it needs besides is empty. One of no known kind is as another version's."""
    if kind not in KINDS:
        return UnknownEvent(kind, data)
    made = event_of(kind, _filled(KINDS[kind], data))
    assert not isinstance(made, UnknownEvent), made.misfit
    return made


def recorded(kind: str, **data: Any) -> RecordedEvent:
    """Return it as read from a journal."""
    return RecordedEvent(1, "", 0.0, event(kind, **data))


def _filled(made: type, data: Mapping[str, Any]) -> dict[str, Any]:
    hints = get_type_hints(made)
    filled = {name: _nested(hints.get(name), value) for name, value in data.items()}
    for each in fields(made):
        if each.name not in data and each.default is MISSING and each.default_factory is MISSING:
            filled[each.name] = _empty(hints[each.name])
    return filled


def _nested(hint: Any, value: Any) -> Any:
    if get_origin(hint) is Mapping and isinstance(value, Mapping):
        return {key: _nested(get_args(hint)[1], entry) for key, entry in value.items()}
    options = get_args(hint) if get_origin(hint) is not None else (hint,)
    nested = next((option for option in options if isinstance(option, type) and is_dataclass(option)), None)
    return _filled(nested, value) if nested is not None and isinstance(value, Mapping) else value


def _empty(hint: Any) -> Any:
    origin = get_origin(hint)
    if origin is Annotated:
        return _empty(get_args(hint)[0])
    if origin is Sequence:
        return []
    if origin is Mapping:
        return {}
    if hint is Any or NoneType in get_args(hint):
        return None
    if origin is Union or get_args(hint):
        return _empty(get_args(hint)[0])
    if isinstance(hint, type) and is_dataclass(hint):
        return _filled(hint, {})
    return _EMPTY.get(hint, "")
