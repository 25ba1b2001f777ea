"""`[interlocks.<name>]`: contacts that must be closed while anything is energised."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import Field

from bench.files.toml_file import Section, validate
from bench.i18n.errors import InputError, at
from bench.station.driver_options import read_options
from drivers.interfaces.text import text_of
from drivers.interlocks.catalogue import InterlockOptions, options_for


class _Common(Section):
    address: str = Field(min_length=1, description="tcp://…, rtu:///… or can://…, text in quotes")


@dataclass(frozen=True)
class InterlockEntry:
    """One contact of a station: its name in the file, and how it is read."""

    name: str
    address: str
    options: InterlockOptions


def interlocks_of(tables: Mapping[str, Mapping[str, Any]], source: str) -> tuple[InterlockEntry, ...]:
    """Return a station's interlocks. Raises InputError naming file, key, what was given and what is allowed."""
    entries = []
    for name, table in tables.items():
        prefix = f"interlocks.{name}"
        common = validate(_Common, {key: table[key] for key in ("address",) if key in table}, source, prefix)
        try:
            kind = options_for(common.address)
        except ValueError as error:
            raise InputError(at(f"{source}: {prefix}.address = {common.address!r}", text_of(error))) from error
        options = read_options(kind, {key: value for key, value in table.items() if key != "address"}, source, prefix)
        entries.append(InterlockEntry(name, common.address, options))
    return tuple(entries)
