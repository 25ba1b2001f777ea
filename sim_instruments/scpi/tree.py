"""The tree of an instrument's headers: which handler a message unit goes to."""

import itertools
import re
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field
from functools import lru_cache
from typing import TypeVar

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import Argument, Unit
from sim_instruments.scpi.long_reply import LongReply
from sim_instruments.scpi.parameters import exactly, forms

Reply = str | bytes | LongReply | None


class WholeReply(bytes):
    """A reply with its end in it, or without one."""


class HalfReply(WholeReply):
    """A reply whose rest never comes."""


Handling = Generator[float, None, Reply]
"""A handler that takes time: it yields the virtual time (s) at which it wants to go on, a past one to let others have their turn."""

#: The mnemonics of a header: short form, long form, and whether a numeric suffix follows.
_Path = tuple[tuple[str, str, bool], ...]

_PATTERN = re.compile(r"(\[)?:?([A-Za-z][A-Za-z0-9_]*)(?:<([a-z]+)>)?(\])?")
_MNEMONIC = re.compile(r"([A-Za-z_]*[A-Za-z_])(\d*)")


@dataclass(frozen=True, slots=True)
class Call:
    """The arguments of a handler: the numeric suffixes by name, 1 if none was sent, and the data elements."""

    suffixes: tuple[int, ...]
    arguments: tuple[Argument, ...]

    @property
    def channel(self) -> int:
        """Return the first numeric suffix."""
        return self.suffixes[0]


Handler = Callable[[Call], Reply | Handling]
Handled = TypeVar("Handled")


def bare(handler: Callable[[], Handled]) -> Callable[[Call], Handled]:
    """Return a handler of a header that takes no data elements; with any it raises ScpiError -108."""

    def handle(call: Call) -> Handled:
        exactly(call.arguments, 0)
        return handler()

    return handle


@dataclass(slots=True)
class _Node:
    children: "dict[str, _Node]" = field(default_factory=dict)
    suffixed: bool = False
    command: Handler | None = None
    query: Handler | None = None


class CommandTree:
    """All headers of an instrument. Headers are written as in its manual: `[SOURce:]VOLTage[:LEVel]`, `CHANnel<n>:SCALe`."""

    def __init__(self) -> None:
        self._root = _Node()
        self._common: dict[tuple[str, bool], Handler] = {}
        #: Gives the handler of a message that is not taken apart; None for one that is, and then its units are looked up here.
        self.whole: Callable[[str], Handler | None] = lambda _: None

    def add(self, pattern: str, *, command: Handler | None = None, query: Handler | None = None) -> None:
        """Register handlers for a header. Raises ValueError for one registered twice or not understood."""
        if pattern.startswith("*"):
            for handler, is_query in ((command, False), (query, True)):
                if handler is not None:
                    self._common[pattern[1:].upper(), is_query] = handler
            return
        for path in _expand(pattern):
            for node in self._leaves(path):
                if (command and node.command) or (query and node.query):
                    raise ValueError(f"header {pattern} is registered twice")
                node.command = command or node.command
                node.query = query or node.query

    def _leaves(self, path: _Path) -> Iterator[_Node]:
        node = self._root
        for short, long, suffixed in path:
            child = node.children.get(short) or node.children.get(long) or _Node(suffixed=suffixed)
            node.children[short] = node.children[long] = child
            child.suffixed = child.suffixed or suffixed
            node = child
        yield node

    def find(self, unit: Unit, path: tuple[str, ...]) -> tuple[Handler, tuple[int, ...], tuple[str, ...]]:
        """Return handler, numeric suffixes and the path that the next unit starts from.

        Raises ScpiError -113 for an unknown header, -114 for a suffix where none belongs.
        """
        if unit.common:
            handler = self._common.get((unit.header[1:].upper(), unit.query))
            if handler is None:
                raise ScpiError(-113)
            return handler, (), path
        nodes = unit.nodes if unit.rooted else path + unit.nodes
        suffixes: list[int] = []
        node = self._root
        for text in nodes:
            child = node.children.get(text)
            if child is None:
                match = _MNEMONIC.fullmatch(text)
                child = node.children.get(match.group(1)) if match else None
                if match is None or child is None:
                    raise ScpiError(-113)
                if not child.suffixed or len(match.group(2)) > 4:
                    raise ScpiError(-114)
                suffixes.append(int(match.group(2)))
            elif child.suffixed:
                suffixes.append(1)
            node = child
        handler = node.query if unit.query else node.command
        if handler is None:
            raise ScpiError(-113)
        return handler, tuple(suffixes), nodes[:-1]

    def headers(self) -> list[str]:
        """Return every registered long header, commands and queries (with '?')."""
        headers: list[str] = [f"*{name}{'?' if query else ''}" for name, query in self._common]

        def walk(node: _Node, prefix: str) -> None:
            if node.command is not None:
                headers.append(prefix)
            if node.query is not None:
                headers.append(prefix + "?")
            seen: dict[int, str] = {}
            for name, child in node.children.items():
                if len(name) >= len(seen.get(id(child), "")):
                    seen[id(child)] = name
            for name in seen.values():
                walk(node.children[name], f"{prefix}:{name}")

        walk(self._root, "")
        return headers


@lru_cache(maxsize=2048)
def _expand(pattern: str) -> tuple[_Path, ...]:
    """Return every path that a header with optional nodes stands for. Each bench builds the same trees anew."""
    nodes: list[tuple[str, bool, bool]] = []
    position = 0
    text = pattern.replace(":]", "]").replace("[:", "[").replace("]:", "]")
    while position < len(text):
        match = _PATTERN.match(text, position)
        if match is None or bool(match.group(1)) != bool(match.group(4)):
            raise ValueError(f"header pattern {pattern!r} is not understood at {text[position:]!r}")
        nodes.append((match.group(2), match.group(3) is not None, match.group(1) is not None))
        position = match.end()
    return tuple(
        tuple((*forms(name), suffixed) for (name, suffixed, _), keep in zip(nodes, kept, strict=True) if keep)
        for kept in itertools.product(*[(True, False) if optional else (True,) for *_, optional in nodes])
    )
