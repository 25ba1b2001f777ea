"""One catalogue: declarations by name, each with where it comes from, loaded when it is first asked for."""

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import redirect_stdout
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

from bench.files.toml_file import nearest
from bench.i18n.errors import InputError
from drivers.interfaces.strangers_code import strangers_code
from drivers.interfaces.text import Text, lines, text, text_of

T = TypeVar("T")


@dataclass(frozen=True)
class Origin:
    """Where a declaration comes from: a distribution and its version, or a plug-in file and its SHA-256."""

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
    """A declaration that is not loaded yet."""

    name: str
    origin: Origin
    load: Callable[[], object]


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
                "{name} of {origin} cannot be used: {error}", name=self.name, origin=self.origin, error=self.error
            )
        return text("plug-in {origin} cannot be used: {error}", origin=self.origin, error=self.error)

    def as_dict(self) -> dict[str, Any]:
        """Return it in JSON's types."""
        return {"name": self.name, "from": self.origin.as_dict(), "error": str(self.error)}


class Catalogue(Mapping[str, T], Generic[T]):
    """Declarations of one kind by name. A name that was taken first stays; what cannot be loaded is among `broken` only.

    `accept` takes a name and what was loaded under it, and returns the declaration; it raises ValueError for another thing.
    `unusable` are plug-ins of which nothing is known but that they cannot be used.
    """

    def __init__(
        self,
        entries: Iterable[UnloadedDeclaration],
        accept: Callable[[str, object], T],
        unusable: Sequence[BrokenPlugin] = (),
    ) -> None:
        self._accept = accept
        self._entries: dict[str, UnloadedDeclaration] = {}
        self._loaded: dict[str, T] = {}
        self._unusable = tuple(unusable)
        self._broken: dict[tuple[str, Origin], BrokenPlugin] = {}
        for entry in entries:
            taken = self._entries.setdefault(entry.name, entry)
            if taken is not entry:
                error = text("the name is taken by {origin}", origin=taken.origin)
                self._broken[entry.name, entry.origin] = BrokenPlugin(entry.name, entry.origin, error)

    def __getitem__(self, name: str) -> T:
        if name not in self._loaded:
            entry = self._entries[name]
            if (name, entry.origin) in self._broken:
                raise KeyError(name)
            try:
                # What a plug-in prints must not end up in JSON, nor in what a guardian says.
                with redirect_stdout(sys.stderr), strangers_code():
                    self._loaded[name] = self._accept(name, entry.load())
            except Exception as error:
                self._broken[name, entry.origin] = BrokenPlugin(name, entry.origin, reason(error))
                raise KeyError(name) from error
        return self._loaded[name]

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
        return self._entries[name].origin

    def broken(self, *, load: bool = True) -> tuple[BrokenPlugin, ...]:
        """Return what cannot be used: of everything, or without `load` as far as it is known by now."""
        for name in self._entries if load else ():
            self.get(name)
        return tuple(self._broken.values())

    def known(self, names: Sequence[str] | None = None) -> Text:
        """Return the names, all or some, each with where it comes from unless that is motorbench itself, as a sentence's end."""
        return lines(
            (
                name if self.origin(name).name == "motorbench" else f"{name} ({self.origin(name)})"
                for name in (self if names is None else names)
            ),
            between=", ",
        )

    def why_not(self, name: str) -> Text:
        """Return what to say of a name that cannot be had: why it is broken, else the nearest and what may be broken besides."""
        for broken in self._broken.values():
            if broken.name == name:
                return broken.sentence
        return lines((nearest(name, list(self)), *(broken.sentence for broken in self._unusable)), between="; ")

    def need(self, name: str, place: Callable[[Text], InputError]) -> T:
        """Return a declaration; where it cannot be had, raise what `place` makes of the reason."""
        try:
            return self[name]
        except KeyError:
            raise place(self.why_not(name)) from None


def reason(error: BaseException) -> Text:
    """Return what an error of a plug-in says, on one line, with its kind where it is not one that we raise."""
    said = text_of(error)
    if isinstance(error, ValueError | InputError):
        return said
    return text("{kind}: {said}", kind=type(error).__name__, said=" ".join(str(said).split()))
