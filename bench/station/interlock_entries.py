"""`[interlocks.<name>]`: contacts that must be closed while anything is energised."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import Field

from bench.files.toml_file import Section, validate
from bench.i18n.errors import FileError, InputError
from bench.plugins.catalogue import Catalogue
from bench.station.driver_options import read_options
from drivers.interfaces.text import text
from drivers.safety_devices import InterlockDriver

#: Keys of a contact's table that are not its driver's.
_COMMON = ("driver", "address")


class _Contact(Section):
    driver: str = Field(default="", description="the driver's name, where the address does not tell it")
    address: str = Field(min_length=1, description="tcp://…, rtu:///… or can://…, text in quotes")


@dataclass(frozen=True)
class InterlockEntry:
    """One contact of a station: its name in the file, and how it is read."""

    name: str
    driver: InterlockDriver
    address: str
    options: object


def interlocks_of(
    tables: Mapping[str, Mapping[str, Any]], source: str, known: Catalogue[InterlockDriver]
) -> tuple[InterlockEntry, ...]:
    """Return a station's interlocks; `known` are the drivers to be had.

    Raises InputError naming file, key, what was given and what is allowed.
    """
    entries = []
    for name, table in tables.items():
        prefix = f"interlocks.{name}"
        common = validate(_Contact, {key: table[key] for key in _COMMON if key in table}, source, prefix)
        driver = _driver(common, f"{source}: {prefix}", known)
        own = {key: value for key, value in table.items() if key not in _COMMON}
        entries.append(InterlockEntry(name, driver, common.address, read_options(driver.options, own, source, prefix)))
    return tuple(entries)


def _driver(contact: _Contact, place: str, known: Catalogue[InterlockDriver]) -> InterlockDriver:
    """Return the driver that a contact's table names, else the one that takes addresses of this scheme."""
    if contact.driver:
        return known.need(
            contact.driver,
            lambda why: InputError(
                text(
                    "{place}.driver = {driver!r} is no driver for an interlock contact; {hint}",
                    place=place,
                    driver=contact.driver,
                    hint=why,
                )
            ),
        )
    scheme = contact.address.partition("://")[0]
    for driver in known.values():
        if scheme in driver.schemes:
            return driver
    raise FileError(
        text(
            "{place}.address = {address!r}: write tcp://host:port, rtu:///dev/…?baudrate=… or "
            "can://interface/channel?bitrate=…, or name the driver of another kind of contact; {hint}",
            place=place,
            address=contact.address,
            hint=known.why_not(""),
        )
    )
