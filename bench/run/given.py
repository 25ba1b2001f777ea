"""The results of a procedure's calls to its bench, and the state of the bench at its beginning."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass, fields, is_dataclass, replace
from typing import Any

from bench.by_hand.words import called
from bench.operators.entry import TypedEntry, TypedReading
from drivers.interfaces import Role
from drivers.interfaces.declarations import declarations
from drivers.interfaces.text import Text, lines, text, word
from procedures.core.bench import Bench
from reports.labels import role_name

#: Who is called, or what is done, and with what.
Key = tuple[Any, ...]


@dataclass
class GivenReply:
    """Reply to one call; `skipped` where the procedure need not ask for it again, `remake` asks the driver anew with what was typed."""

    key: Key
    result: Any = None
    error: Exception | None = None
    typed: tuple[TypedReading, ...] = ()
    skipped: bool = False
    remake: Callable[[], Any] | None = None


def remade(given: GivenReply, typed: Sequence[TypedReading], entry: TypedEntry) -> Any:
    """Return what a call would have given with these values typed for it. Raises what its driver has against them."""
    if given.remake is None:
        return typed[0].value
    made = []
    for values in (given.typed, typed):
        with _answering(entry, values):
            made.append(given.remake())
    before, after = made
    if not is_dataclass(after) or isinstance(after, type):
        return after
    # The rest is as it was then: the instrument may be set otherwise by now.
    other = {one.name: getattr(after, one.name) for one in fields(after) if one.name != "time"}
    return replace(given.result, **{name: value for name, value in other.items() if value != getattr(before, name)})


def said(key: Key) -> Text:
    """Return a call in words: the work of hands, or an instrument's command with its values."""
    if key[0] == "hands":
        return word(next(iter(key[1].lines({}))))
    role, method, arguments, named = key[1:5]
    declaration = declarations(Role(role).interface)[method]
    values = dict(zip(declaration.arguments, arguments, strict=False)) | dict(named)
    messages = [
        Text(
            "{name} {value:.4g} {unit}", {"name": called(name), "value": value, "unit": declaration.amounts[name].unit}
        )
        for name, value in values.items()
        if name in declaration.amounts and isinstance(value, int | float)
    ]
    return lines([text("{instrument}: {task}", instrument=role_name(role), task=called(method)), *messages], ", ")


def captured(bench: Bench) -> tuple[Any, ...]:
    """Return the state of a bench, to be restored as often as wanted."""
    return deepcopy(bench.state), _held(vars(bench.uncertainties)), _held(vars(bench.thermometer))


def restore(bench: Bench, state: tuple[Any, ...]) -> None:
    """Bring a bench into a state that was captured."""
    bench.state = deepcopy(state[0])
    vars(bench.uncertainties).update(_held(state[1]))
    vars(bench.thermometer).update(_held(state[2]))


def _held(variables: Mapping[str, Any]) -> dict[str, Any]:
    """Return variables with containers of their own; an uncertain number stays the one that it is."""
    return {name: value.copy() if isinstance(value, list | dict) else value for name, value in variables.items()}


@contextmanager
def _answering(entry: TypedEntry, typed: Sequence[TypedReading]) -> Iterator[None]:
    """Answer questions by these values."""
    taken, entry.taken, entry.preset = entry.taken, [], [one.value for one in typed]
    try:
        yield
    finally:
        entry.taken, entry.preset = taken, []
