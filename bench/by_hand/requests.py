"""A line that was typed, as what is to be done."""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from bench.by_hand.commands import Command, commands_of
from bench.by_hand.hand_work import HAND_WORK, hand_work
from bench.by_hand.values import value_of
from bench.files.toml_file import nearest
from bench.operators.typed import is_unit, narrow
from drivers.interfaces import Role
from drivers.interfaces.text import text
from procedures.core.actions import FINISH, YES, Action

OFF, HELP = "off", "help"
_YES = (YES, "y", "是")


@dataclass(frozen=True)
class Finish:
    """Everything off, and the end."""


@dataclass(frozen=True)
class Confirm:
    """Carry out what was asked about."""


@dataclass(frozen=True)
class SwitchOff:
    """A request to switch off the outputs of the instrument in a role; those of every instrument if no role is named."""

    role: Role | None


@dataclass(frozen=True)
class Help:
    """Say what can be commanded, of one role where one is named."""

    role: Role | None


@dataclass(frozen=True)
class HandTask:
    """A request for manual work, in the words typed."""

    action: Action
    typed: str


@dataclass(frozen=True)
class TypedCommand:
    """Carry out a command with values by the names of its arguments, as they were typed and in SI units."""

    command: Command
    values: Mapping[str, Any]
    typed: str


Request = Finish | Confirm | SwitchOff | Help | HandTask | TypedCommand


def request_of(line: str, roles: Collection[Role]) -> Request:
    """Return what a line asks for. Raises ValueError with a Text that says what is wrong and what there is."""
    words = narrow(line).split()
    if not words:
        raise ValueError(text("type a command; help lists them"))
    first, rest = words[0].lower(), words[1:]
    if first == FINISH and not rest:
        return Finish()
    if first in _YES and not rest:
        return Confirm()
    if first in (OFF, HELP) and len(rest) <= 1:
        role = _role(rest[0], roles) if rest else None
        return SwitchOff(role) if first == OFF else Help(role)
    if first in HAND_WORK:
        return HandTask(hand_work(first, rest, roles), line)
    role = _role(first, roles)
    if not rest:
        raise ValueError(text("{role}: give a command; help {role} lists the commands", role=role.value))
    commands = commands_of(role)
    method = rest[0].lower().replace("-", "_")
    if method not in commands:
        raise ValueError(
            text("{role} has no {method}; {hint}", role=role.value, method=method, hint=nearest(method, list(commands)))
        )
    return TypedCommand(commands[method], _values(commands[method], list(_joined(rest[1:]))), line)


def _role(word: str, roles: Collection[Role]) -> Role:
    typed = word.lower().replace("-", "_")
    for role in roles:
        if role.value == typed:
            return role
    known = [FINISH, OFF, HELP, *HAND_WORK, *(role.value for role in roles)]
    raise ValueError(text("there is no {word} here; {hint}", word=word, hint=nearest(typed, known)))


def _joined(words: Sequence[str]) -> Iterator[str]:
    """Yield words, a number and the unit behind it as one."""
    held = ""
    for word in words:
        if held and is_unit(word):
            yield f"{held} {word}"
            held = ""
            continue
        if held:
            yield held
        held = word
    if held:
        yield held


def _values(command: Command, words: Sequence[str]) -> dict[str, Any]:
    """Return values by the arguments' names: those without one in the arguments' order, then those with one."""
    arguments = {one.name: one for one in command.arguments}
    values: dict[str, Any] = {}
    for word in words:
        name, equals, typed = word.partition("=")
        if not equals:
            left = [one for one in arguments if one not in values]
            if not left:
                raise ValueError(
                    text("{method} takes no more than {count} values", method=command.method, count=len(arguments))
                )
            name, typed = left[0], word
        name = name.strip().lower().replace("-", "_")
        if name not in arguments:
            hint = nearest(name, list(arguments)) if arguments else text("it takes no values")
            raise ValueError(text("{method} has no {name}; {hint}", method=command.method, name=name, hint=hint))
        if name in values:
            raise ValueError(text("{name} is given twice", name=name))
        values[name] = value_of(arguments[name], typed.strip())
    if missing := [one.name for one in command.arguments if one.needed and one.name not in values]:
        raise ValueError(text("{method} needs {names}", method=command.method, names=missing))
    return values
