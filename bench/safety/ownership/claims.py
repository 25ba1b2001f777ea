"""Claims on a station by its user: its instruments by canonical address and serial number."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from bench.station.station_file import Entry, Station
from drivers.catalogue import MANUAL
from drivers.interfaces import Identity
from drivers.interfaces.text import Text, text
from drivers.transport.canonical_address import canonical_addresses, is_serial_line

#: What stands in place of a serial number where there is none.
_NO_NUMBER = ("", "none", "unknown", "n/a")


@dataclass(frozen=True)
class Claim:
    """Something that has one owner at a time: its name in messages, and all its identifiers."""

    name: Text | str
    keys: frozenset[str]


def claims_of(station: Station) -> tuple[Claim, ...]:
    """Return everything of a station: its instruments, the serial lines of its interlocks, a served bench's hands.

    What a person works by hand needs no owner.
    """
    claims = [claim_of(station, entry) for entry in station.entries.values()]
    claims += interlock_claims(station)
    claims += relay_claims(station)
    if station.control:
        claims.append(Claim(text("the virtual bench at {address}", address=station.control), _keys(station.control)))
    return tuple(claim for claim in claims if claim.keys)


def claim_of(station: Station, entry: Entry) -> Claim:
    """Return one instrument, by its address and, where the station file has it, its serial number."""
    name = text("{instrument} ({address})", instrument=entry.name, address=entry.address)
    if entry.driver.name == MANUAL or not entry.address:
        return Claim(name, frozenset())
    number = getattr(entry.options, "serial_number", None) or ""
    known = identity_keys(station, entry, Identity("", "", number)) if number else frozenset[str]()
    # A simulation of pyvisa-sim lives in the process that has opened it.
    if station.visa_library.endswith("@sim") and "::" in entry.address:
        return Claim(name, frozenset())
    return Claim(name, _keys(entry.address, getattr(entry.options, "units", ())) | known)


def interlock_claims(station: Station) -> tuple[Claim, ...]:
    """Return the serial lines that carry interlocks; contacts on a network or a CAN bus may be read by several."""
    return tuple(
        Claim(text("{instrument} ({address})", instrument=entry.name, address=entry.address), _keys(entry.address))
        for entry in station.interlocks
        if is_serial_line(entry.address)
    )


def relay_claims(station: Station) -> tuple[Claim, ...]:
    """Return the relays with a watchdog: who feeds one beside another keeps it closed for him."""
    return tuple(
        Claim(
            text("{instrument} ({address})", instrument=entry.name, address=entry.address),
            _keys(entry.address, getattr(entry.options, "units", ())),
        )
        for entry in station.watchdog_relays
    )


def identity_keys(station: Station, entry: Entry, identity: Identity) -> frozenset[str]:
    """Return the names of an instrument by what it says of itself; none where it has no serial number.

    Virtual instruments have theirs within one served bench.
    """
    number = identity.serial_number.strip().casefold()
    if entry.driver.name == MANUAL or not is_number(number):
        return frozenset()
    within = f" at {station.control}" if station.control else ""
    makers = [entry.driver.name, *([identity.manufacturer.strip().casefold()] if identity.manufacturer else [])]
    return frozenset(f"number {maker} {number}{within}" for maker in makers)


def is_number(serial_number: str) -> bool:
    """Return whether a serial number is one, and not what stands in its place."""
    number = serial_number.strip().casefold()
    return number not in _NO_NUMBER and number.strip("0") != ""


def all_keys(claims: Iterable[Claim]) -> Mapping[str, Claim]:
    """Return the claims by each of their names."""
    return {key: claim for claim in claims for key in claim.keys}


def _keys(address: str, units: Iterable[int] = ()) -> frozenset[str]:
    return frozenset(canonical_addresses(address, units=tuple(units)))
