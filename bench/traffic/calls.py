"""Calls of drivers as a recording has them: written as in Python, read without running anything."""

import ast
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Any, get_args, get_origin, get_type_hints

from pydantic import TypeAdapter

from bench.journal.encoding import plain
from drivers.interfaces import Role
from drivers.interfaces.declarations import declarations
from drivers.interfaces.text import text

OPEN, WITH, END, FAIL = "open()", "with ", "end", "fail"


@dataclass(frozen=True)
class RecordedCall:
    """A property that is asked, or with `arguments` a method that is called, `block` for one that energises as long as its block lasts."""

    name: str
    arguments: Mapping[str, Any] | None = None
    block: bool = False

    def made(self, instrument: Any) -> Any:
        """Return what it gives; raises what the driver raises."""
        found = getattr(instrument, self.name)
        return found if self.arguments is None else found(**self.arguments)


def words_of(name: str, arguments: Mapping[str, Any]) -> str:
    """Return a method's call as a recording has it."""
    return f"{name}({', '.join(f'{key}={flat(one)!r}' for key, one in arguments.items())})"


def flat(value: object) -> Any:
    """Return a value in JSON's types; a set is sorted."""
    return sorted(map(plain, value), key=str) if isinstance(value, set | frozenset) else plain(value)


def call_of(words: str, role: Role) -> RecordedCall:
    """Return the call in a line that is neither the opening nor a block's end. Raises ValueError where it is none of the role's."""
    block = words.startswith(WITH)
    try:
        tree = ast.parse(words.removeprefix(WITH), mode="eval").body
        known = declarations(role.interface)
        if isinstance(tree, ast.Name) and known[tree.id].is_property:
            return RecordedCall(tree.id)
        if isinstance(tree, ast.Call) and isinstance(tree.func, ast.Name) and not known[tree.func.id].is_property:
            name = tree.func.id
            hints = get_type_hints(getattr(role.interface, name))
            named = list(zip(list(known[name].arguments)[: len(tree.args)], tree.args, strict=True))
            named += [(str(one.arg), one.value) for one in tree.keywords]
            given = {key: ast.literal_eval(value) for key, value in named}
            return RecordedCall(name, {key: _typed(hints[key], one) for key, one in given.items()}, block)
    except (SyntaxError, KeyError, ValueError, RecursionError, MemoryError):
        pass
    raise ValueError(text("'{words}' is no call of {role}", words=words[:80], role=role.value))


def _typed(hint: Any, value: object) -> Any:
    # pydantic has no word for what may be any collection.
    wanted: Any = frozenset[get_args(hint)] if get_origin(hint) is Collection else hint  # type: ignore[misc]
    return TypeAdapter(wanted).validate_python(value)
