"""One catalogue: declarations by name, each with where it comes from, loaded when it is first asked for."""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from enum import EnumMeta
from os.path import basename
from typing import Any, Generic, TypeVar

from bench.files.toml_file import nearest
from bench.i18n.errors import InputError
from drivers.interfaces.strangers_code import ExitAttemptError, strangers_code
from drivers.interfaces.text import Text, lines, text, text_of

T = TypeVar("T")
#: The distribution whose names go before everybody else's.
OURS = "motorbench"


@dataclass(frozen=True)
class Origin:
    """The origin of a declaration: a distribution and its version, or a plug-in file and its SHA-256."""

    name: str
    version: str = ""
    sha256: str = ""

    def __str__(self) -> str:
        return f"{self.name} {self.version}".rstrip()

    def as_dict(self) -> dict[str, str]:
        """Return it in JSON's types."""
        return {key: value for key, value in vars(self).items() if value}


@dataclass(frozen=True)
class UnloadedDeclaration:
    """A declaration that is not loaded yet; `module` is where it stands, empty for ours."""

    name: str
    origin: Origin
    load: Callable[[], object]
    module: str = ""


@dataclass(frozen=True)
class PluginFile:
    """A plug-in file that was read: what it declares by group, and why it cannot be used where it cannot."""

    origin: Origin
    entries: Mapping[str, Sequence[UnloadedDeclaration]] = field(default_factory=dict, compare=False)
    error: Text | None = field(default=None, compare=False)


@dataclass(frozen=True)
class BrokenPlugin:
    """A declaration that cannot be used, or a whole plug-in where `name` is empty, and why."""

    name: str
    origin: Origin
    error: Text

    @property
    def sentence(self) -> Text:
        """The fault in one sentence."""
        if self.name:
            return text(
                "{name} from {origin} cannot be used: {error}", name=self.name, origin=self.origin, error=self.error
            )
        return text("plug-in {origin} cannot be used: {error}", origin=self.origin, error=self.error)

    def as_dict(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {"name": self.name, "from": self.origin.as_dict(), "error": str(self.error)}


class Catalogue(Mapping[str, T], Generic[T]):
    """Declarations of one kind by name. The first of a name that can be loaded has it; what cannot be is among `broken` only.

    `accept` takes a name and what was loaded under it, and returns the declaration; it raises ValueError for another thing.
    `unusable` are plug-ins of which nothing is known but that they cannot be used. `clash` says where one declaration contradicts
    another: of two that are not ours, the later cannot be used then.
    """

    def __init__(
        self,
        entries: Iterable[UnloadedDeclaration],
        accept: Callable[[str, object], T],
        unusable: Sequence[BrokenPlugin] = (),
        clash: Callable[[T, T], Text | None] | None = None,
    ) -> None:
        self._accept, self._clash = accept, clash
        self._entries: dict[str, list[UnloadedDeclaration]] = {}
        self._loaded: dict[str, T | None] = {}
        self._holders: dict[str, UnloadedDeclaration] = {}
        self._unusable = tuple(unusable)
        self._broken: dict[tuple[str, Origin], BrokenPlugin] = {}
        for entry in entries:
            self._entries.setdefault(entry.name, []).append(entry)

    def __getitem__(self, name: str) -> T:
        if name not in self._loaded:
            self._loaded[name] = self._first_of(name)
        loaded = self._loaded[name]
        if loaded is None:
            raise KeyError(name)
        return loaded

    def _first_of(self, name: str) -> T | None:
        """Return the first declaration of a name that can be used, and note why the others cannot."""
        found: T | None = None
        for entry in self._entries[name]:
            if found is not None:
                error = text("the name is taken by {origin}", origin=self._holders[name].origin)
                self._broken.setdefault((name, entry.origin), BrokenPlugin(name, entry.origin, error))
                continue
            try:
                # What a plug-in prints must not end up in JSON, nor in what a guardian says.
                with redirect_stdout(sys.stderr), strangers_code():
                    loaded = self._accept(name, entry.load())
                self._check_against_earlier(entry, loaded)
            except Exception as error:  # noqa: BLE001  a stranger's code may raise anything
                self._broken[name, entry.origin] = BrokenPlugin(name, entry.origin, placed_reason(error, entry.module))
                continue
            found, self._holders[name] = loaded, entry
        return found

    def _check_against_earlier(self, entry: UnloadedDeclaration, loaded: T) -> None:
        """Raise ValueError where a declaration contradicts one that stands before it; nothing of ours is loaded for it."""
        if self._clash is None or entry.origin.name == OURS:
            return
        for name, others in self._entries.items():
            if name == entry.name:
                return
            other = self.get(name) if any(one.origin.name != OURS for one in others) else None
            if other is None or (origin := self.origin(name)).name == OURS:
                continue
            if (clash := self._clash(loaded, other)) is not None:
                raise ValueError(
                    text(
                        "{clash} in {name} from {origin}; rename it in one of the two, or uninstall one",
                        clash=clash,
                        name=name,
                        origin=origin,
                    )
                )

    def __iter__(self) -> Iterator[str]:
        return (name for name in self._entries if name in self)

    def __len__(self) -> int:
        return sum(1 for _ in self)

    @property
    def names(self) -> tuple[str, ...]:
        """The names, of what cannot be loaded too; nothing is loaded for it."""
        return tuple(self._entries)

    def origin(self, name: str) -> Origin:
        """Return where a declaration comes from. Raises KeyError for a name that there is not."""
        entries = self._entries[name]
        # Of several, who has the name is known when they are loaded.
        held = name in self._holders or (len(entries) > 1 and name in self)
        return (self._holders[name] if held else entries[0]).origin

    def broken(self, *, load: bool = True) -> tuple[BrokenPlugin, ...]:
        """Return what cannot be used: of everything, or without `load` of what was asked for and of names that several have."""
        for name, entries in self._entries.items():
            if load or len(entries) > 1:
                self.get(name)
        return tuple(self._broken.values())

    def known(self, names: Sequence[str] | None = None) -> Text:
        """Return the names, all or some, each with where it comes from unless that is motorbench itself, as a sentence's end."""
        return lines(
            (
                name if self.origin(name).name == OURS else f"{name} ({self.origin(name)})"
                for name in (self if names is None else names)
            ),
            between=", ",
        )

    def why_not(self, name: str, among: Sequence[str] | None = None) -> Text:
        """Return what to say of a name that cannot be had: why it is broken at each origin, else the nearest and other faults.

        The nearest `among` those that can be meant, where not all can.
        """
        known = list(self) if among is None else among
        faults = self.faults(name)
        own = any(broken.name == name for broken in self._broken.values())
        return lines(faults if own else (nearest(name, known), *faults), between="; ")

    def faults(self, name: str) -> list[Text]:
        """Return why a name is broken, at each origin; where it is not, the plug-ins that may have declared it but cannot be used."""
        own = [broken.sentence for broken in self._broken.values() if broken.name == name]
        return own or [broken.sentence for broken in self._unusable]

    def need(self, name: str, place: Callable[[Text], InputError]) -> T:
        """Return a declaration; where it cannot be had, raise what `place` makes of the reason."""
        try:
            return self[name]
        except KeyError:
            raise place(self.why_not(name)) from None


def reason(error: BaseException) -> Text:
    """Return what an error of a plug-in says, on one line, with its kind where it is not one that we raise."""
    message = text_of(error)
    if isinstance(error, ValueError | InputError):
        return message
    if isinstance(error, AttributeError) and isinstance(error.obj, EnumMeta):
        # Python says the name alone.
        hint = nearest(str(error.name), list(error.obj.__members__))
        message = text("{kind} has no {name}; {hint}", kind=error.obj.__name__, name=error.name, hint=hint)
    one_line = " ".join(str(message).split())
    return text("{kind}: {said}", kind=type(error).__name__, said=message if one_line == str(message) else one_line)


def placed_reason(error: BaseException, module: str) -> Text:
    """Return what an error of a plug-in says, with the last line in the package of its `module` that led to it.

    A syntax error names its own.
    """
    # Where somebody wanted to end the program, that is what he did.
    where = error.__cause__ if isinstance(error, ExitAttemptError) and error.__cause__ else error
    place = None if isinstance(where, SyntaxError) else place_in(where, module)
    said = reason(error)
    return said if place is None else text("{error} ({file}, line {line})", error=said, file=place[0], line=place[1])


def place_in(error: BaseException, module: str) -> tuple[str, int] | None:
    """Return file and line of the last call within a module's package, None where there is none."""
    found: tuple[str, int] | None = None
    package, trace = module.partition(".")[0], error.__traceback__
    while trace is not None:
        if package and str(trace.tb_frame.f_globals.get("__name__", "")).partition(".")[0] == package:
            found = basename(trace.tb_frame.f_code.co_filename), trace.tb_lineno
        trace = trace.tb_next
    return found
