"""`[watchdog_relays.<name>]`: relays that must be fed while the roles behind their contact are energised."""

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from pydantic import Field

from bench.files.toml_file import Section, validate
from bench.i18n.errors import FileError, InputError
from bench.plugins.catalogue import Catalogue
from bench.station.driver_options import read_options
from bench.station.shutdown_sequence import OFF_BY
from drivers.interfaces.text import text
from drivers.safety_devices import RelayDriver
from procedures.core.bench import Role

#: Keys of a relay's table that are not its driver's.
_COMMON = ("driver", "address", "roles")


class _Relay(Section):
    driver: str = Field(description="the driver's name, text in quotes")
    address: str = Field(min_length=1, description="tcp://host:port, text in quotes")
    roles: list[Role] = Field(min_length=1, description='the roles behind its contact, like ["supply"]')


@dataclass(frozen=True)
class RelayEntry:
    """One relay of a station: its name in the file, how it is reached, and the roles whose energy its contact carries."""

    name: str
    driver: RelayDriver
    address: str
    roles: frozenset[Role]
    options: object


def relays_of(
    tables: Mapping[str, Mapping[str, Any]], there: Collection[Role], source: str, known: Catalogue[RelayDriver]
) -> tuple[RelayEntry, ...]:
    """Return a station's relays with a watchdog; `there` are its instruments' roles, `known` the drivers to be had.

    Raises InputError naming file, key, what was given and what is allowed.
    """
    entries = []
    for name, table in tables.items():
        prefix = f"watchdog_relays.{name}"
        common = validate(_Relay, {key: table[key] for key in _COMMON if key in table}, source, prefix)
        driver = known.need(
            common.driver,
            lambda why, prefix=prefix, name=common.driver: InputError(  # type: ignore[misc]
                text(
                    "{source}: {prefix}.driver = {driver!r} is no driver for a relay with a watchdog; {hint}",
                    source=source,
                    prefix=prefix,
                    driver=name,
                    hint=why,
                )
            ),
        )
        allowed = [role.value for role in OFF_BY if role in there]
        for role in common.roles:
            if role.value not in allowed:
                raise FileError(
                    text(
                        "{source}: {prefix}.roles: {role} is no role of this station that feeds energy; allowed are {allowed}",
                        source=source,
                        prefix=prefix,
                        role=role.value,
                        allowed=allowed,
                    )
                )
        own = {key: value for key, value in table.items() if key not in _COMMON}
        options = read_options(driver.options, own, source, prefix)
        entries.append(RelayEntry(name, driver, common.address, frozenset(common.roles), options))
    check_addresses(entries, source)
    return tuple(entries)


def check_addresses(entries: Iterable[RelayEntry], source: str) -> None:
    """Raise InputError if two relays are at one address, because they would share one watchdog."""
    seen: dict[str, str] = {}
    for entry in entries:
        if entry.address in seen:
            raise FileError(
                text(
                    "{source}: watchdog_relays.{name}.address: {address} is the address of {other} too, and its watchdog is one; "
                    "give each relay a device of its own",
                    source=source,
                    name=entry.name,
                    address=entry.address,
                    other=seen[entry.address],
                )
            )
        seen[entry.address] = entry.name
