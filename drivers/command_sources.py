"""The sources for each command that a driver sends: tables in `sources.toml` beside the drivers.

A file is read when it is asked for, not when a driver is imported. `[sources.KEY]` names what was opened once for all rows of the
file, the one of `drivers.bases` for those of every file; `[DRIVER]` has a row for each command, with the keys of the sources in which it
was seen.
"""

import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from typing import Any

from drivers.interfaces.text import Text, text, text_of

_FILE = "sources.toml"
#: Sources that several files name.
_SHARED = "drivers.bases"


class SourcesError(ValueError):
    """A driver's table of commands cannot be had; its argument is a Text that names driver and package."""


@dataclass(frozen=True)
class CommandSource:
    """A document or program that states commands: its `name`, and the `address` where it is found.

    It was written `after` others, by their keys; a source `of_relative` tells of another instrument of the maker's.
    """

    key: str
    name: str
    address: str
    after: tuple[str, ...] = ()
    of_relative: bool = False


@dataclass(frozen=True)
class SourcedCommand:
    """One command, register, object or frame, and the sources in which it was seen."""

    command: str
    sources: tuple[CommandSource, ...]

    @property
    def independent(self) -> int:
        """The number of sources that describe this instrument and were not written after another of them."""
        keys = {source.key for source in self.sources}
        return sum(not source.of_relative and not keys & set(source.after) for source in self.sources)

    @property
    def words(self) -> Text:
        """The strength of the evidence: a fact is established if two sources state it that do not copy each other."""
        if self.independent > 1:
            return text("two sources or more")
        return text("one source") if self.independent else text("no source")


def sourced_commands(package: str, driver: str) -> tuple[SourcedCommand, ...]:
    """Return the rows of a driver's table, in their order; none where the package has no table of that name.

    Raises ValueError where a row names a source that the file has not.
    """
    tables = _tables(package)
    known = {**_sources(_tables(_SHARED)), **_sources(tables)}
    return tuple(
        SourcedCommand(command, tuple(_source(known, key, command) for key in keys))
        for command, keys in tables.get(driver, {}).items()
    )


def declared_commands(package: str, driver: str) -> tuple[SourcedCommand, ...]:
    """Return the rows of a driver that says that it has them. Raises SourcesError where it has not, or they cannot be read."""
    try:
        if driver in _tables(package):
            return sourced_commands(package, driver)
    # A plug-in's file may be of any form, and its package no package.
    except Exception as error:
        raise SourcesError(
            text(
                "{driver}: {file} of {package} cannot be used ({error})",
                driver=driver,
                file=_FILE,
                package=package,
                error=text_of(error),
            )
        ) from error
    raise SourcesError(
        text("{driver}: {package} has no table [{driver}] in a {file}", driver=driver, package=package, file=_FILE)
    )


def _tables(package: str) -> Mapping[str, Any]:
    file = files(package) / _FILE
    return tomllib.loads(file.read_text(encoding="utf-8")) if file.is_file() else {}


def _sources(tables: Mapping[str, Any]) -> Mapping[str, CommandSource]:
    found: Mapping[str, Mapping[str, Any]] = tables.get("sources", {})
    return {
        key: CommandSource(
            key, table["name"], table["address"], tuple(table.get("after", ())), table.get("of_relative", False)
        )
        for key, table in found.items()
    }


def _source(known: Mapping[str, CommandSource], key: str, command: str) -> CommandSource:
    if key not in known:
        raise ValueError(text("{command}: there is no source {key}", command=command, key=key))
    return known[key]


def sources_of(commands: Sequence[SourcedCommand]) -> tuple[CommandSource, ...]:
    """Return every source of some commands once, in the order in which they are first named."""
    return tuple(dict.fromkeys(source for command in commands for source in command.sources))
