"""Checks an instrument's class against its declarations when the class is created, not when it is used."""

from abc import abstractmethod
from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

from drivers.interfaces.declarations import POLE_PAIRS, Declaration, DeclarationError, declared
from drivers.interfaces.text import Text, lines, text


def check_class(kind: type) -> None:
    """Raise DeclarationError for a public method or property of an instrument's class that no class of its line declares.

    A declaration that names a property or a method which there is not is refused as well, and one in another unit than an
    interface declares: what is judged and recorded is the interface's.
    """
    members = [member for base in kind.__mro__[:-1] for member in vars(base).items() if not member[0].startswith("_")]
    known: dict[str, Declaration] = {}
    for name, member in reversed(members):
        if (found := declared(member)) is None:
            continue
        if (first := known.setdefault(name, found)).unit != found.unit:
            raise DeclarationError(
                text(
                    "{method} declares the unit {unit!r}, its interface {declared!r}; leave the declaration to the interface, and "
                    "return what it declares",
                    method=f"{kind.__qualname__}.{name}",
                    unit=found.unit,
                    declared=first.unit,
                )
            )
        known[name] = found
    for name, member in members:
        # A class method makes an instrument; it does nothing with one.
        if name not in known and hasattr(type(member), "__get__") and not isinstance(member, classmethod):
            raise DeclarationError(_undeclared(kind, name, known))
    for name, found in known.items():
        amounts = (*found.amounts.values(), *found.readings.values())
        named = {one.own for one in amounts} | {rule.times for one in amounts for rule in one.also} | {found.source}
        if absent := named - known.keys() - {"", POLE_PAIRS}:
            raise DeclarationError(
                f"{kind.__qualname__}.{name} is declared by {', '.join(absent)}, which {kind.__qualname__} has not"
            )


def _undeclared(kind: type, name: str, known: Iterable[str]) -> Text:
    """Return what to say of a member that nothing declares: which declared one may be meant, and how another is declared."""
    meant = get_close_matches(name, [one for one in known if one not in vars(kind)], n=1)
    messages = [
        text("{method} does not declare what it does", method=f"{kind.__qualname__}.{name}"),
        *(text("did you mean {name}?", name=one) for one in meant),
        text(
            "declare it in the interface (@reading, @question, @setting, @set_point, @energises or @makes_safe), or begin its "
            "name with an underscore"
        ),
    ]
    return lines(messages, between="; ")


def require_all(interface: type) -> None:
    """Prevent instances of a class that lacks a method of its interface, except methods that need an ability."""
    for member in vars(interface).values():
        method: Any = member.fget if isinstance(member, property) else member
        found = declared(member)
        if found is not None and found.ability is None:
            abstractmethod(method)
