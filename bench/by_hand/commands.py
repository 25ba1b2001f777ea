"""The commands for the instrument in a role, derived from its interface's declarations."""

from collections.abc import Mapping, Sequence
from dataclasses import MISSING, dataclass, fields, is_dataclass, replace
from enum import Enum
from functools import cache
from inspect import Parameter
from itertools import takewhile
from types import UnionType
from typing import Any, Protocol, get_args, get_origin, get_type_hints

from drivers.interfaces import Instrument, Role
from drivers.interfaces.declarations import Amount, Declaration, Effect, declarations

#: What a person commands; questions and the end of the connection are none of it.
_COMMANDED = (Effect.READING, Effect.SETTING, Effect.SET_POINT, Effect.ENERGISES, Effect.MAKES_SAFE)


class JudgesCalls(Protocol):
    """An instrument that says beforehand whether its limits let a call pass."""

    def judge(self, method: str, *arguments: Any, **named: Any) -> None:
        """Raise SetpointError where the call would be refused; nothing is sent."""


class ArgumentKind(Enum):
    """The kind of an argument."""

    NUMBER = "number"
    WHOLE = "whole number"
    WHOLES = "whole numbers"
    CHOICE = "one of a few words"


@dataclass(frozen=True)
class CommandArgument:
    """One value that a command takes, in `unit`; `default` is `Parameter.empty` where it must be given.

    `within` is the argument of the method that it is a field of, `amount` what bounds it.
    """

    name: str
    kind: ArgumentKind
    unit: str = ""
    default: Any = Parameter.empty
    choices: Sequence[Enum] = ()
    may_be_none: bool = False
    within: str = ""
    amount: Amount | None = None

    @property
    def needed(self) -> bool:
        """True if it has no default."""
        return self.default is Parameter.empty


@dataclass(frozen=True)
class Command:
    """A method of the instrument in a role as it can be commanded."""

    role: Role
    method: str
    declaration: Declaration
    arguments: tuple[CommandArgument, ...]
    holders: Mapping[str, type]

    def carried_out(self, instrument: Instrument, values: Mapping[str, Any]) -> Any:
        """Call the method with values by the arguments' names, and return what it gives."""
        placed, named = self._placed(values)
        return getattr(instrument, self.method)(*placed, **named)

    def judged(self, instrument: JudgesCalls, values: Mapping[str, Any]) -> None:
        """Raise SetpointError for values that `carried_out` would refuse; nothing is sent."""
        placed, named = self._placed(values)
        instrument.judge(self.method, *placed, **named)

    def _placed(self, values: Mapping[str, Any]) -> tuple[list[Any], dict[str, Any]]:
        plain = {one.name: values[one.name] for one in self.arguments if not one.within and one.name in values}
        for name, holder in self.holders.items():
            inner = [one.name for one in self.arguments if one.within == name]
            plain[name] = holder(**{field: values[field] for field in inner if field in values})
        # By position as far as that goes, as procedures call: what reads the journal knows what was set by it.
        placed = [plain.pop(name) for name in list(takewhile(plain.__contains__, self.declaration.arguments))]
        return placed, plain

    def ranges(self, instrument: Instrument) -> dict[str, float]:
        """Return the largest value of each argument that the instrument and its limits leave, as far as it is known before."""
        owned = {one.name: one.amount.own for one in self.arguments if one.amount is not None and one.amount.own}
        return {f"{self.role.value}.{self.method}.{name}": getattr(instrument, own) for name, own in owned.items()}


@cache
def commands_of(role: Role) -> Mapping[str, Command]:
    """Return what can be commanded of the instrument in a role, by the method's name, in its interface's order."""
    interface = role.interface
    return {
        name: _command(role, interface, name, declaration)
        for name, declaration in declarations(interface).items()
        if declaration.effect in _COMMANDED and not declaration.is_property
    }


def _command(role: Role, interface: type, name: str, declaration: Declaration) -> Command:
    hints = get_type_hints(getattr(interface, name))
    arguments, holders = list[CommandArgument](), dict[str, type]()
    for argument, default in declaration.arguments.items():
        hint = hints[argument]
        if isinstance(hint, type) and is_dataclass(hint):
            holders[argument] = hint
            arguments += [replace(one, within=argument) for one in _fields(hint, declaration)]
        else:
            amount = declaration.amounts.get(argument)
            unit = amount.unit if amount else declaration.units.get(argument, "")
            arguments.append(_argument(argument, hint, unit, default, amount))
    return Command(role, name, declaration, tuple(arguments), holders)


def _fields(kind: Any, declaration: Declaration) -> list[CommandArgument]:
    hints = get_type_hints(kind)
    return [
        _argument(
            one.name,
            hints[one.name],
            declaration.units.get(one.name, ""),
            Parameter.empty if one.default is MISSING else one.default,
            None,
        )
        for one in fields(kind)
    ]


def _argument(name: str, hint: Any, unit: str, default: Any, amount: Amount | None) -> CommandArgument:
    may_be_none = isinstance(hint, UnionType) and type(None) in get_args(hint)
    kind = next(one for one in get_args(hint) if one is not type(None)) if may_be_none else hint
    result = CommandArgument(name, ArgumentKind.NUMBER, unit, default, may_be_none=may_be_none, amount=amount)
    if isinstance(kind, type) and issubclass(kind, Enum):
        return replace(result, kind=ArgumentKind.CHOICE, choices=tuple(kind))
    if kind is int:
        return replace(result, kind=ArgumentKind.WHOLE)
    if get_origin(kind) is not None and get_args(kind) == (int,):
        return replace(result, kind=ArgumentKind.WHOLES)
    if kind is not float:
        raise TypeError(f"the argument {name} is of {kind}, which nobody can type")
    return result
