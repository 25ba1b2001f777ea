"""The result of a scan: its findings, its questions, and the places that it left out."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from drivers.catalogue import Driver
from drivers.interfaces import Identity
from drivers.interfaces.text import Text, Translate, english


@dataclass(frozen=True)
class DriverMatch:
    """A driver that recognises an instrument, and the `options` of it that the scan found out."""

    driver: Driver
    options: Mapping[str, Any] = field(default_factory=dict)

    def as_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {"driver": self.driver.name, "role": self.driver.role.value, "options": dict(self.options)}


@dataclass(frozen=True)
class FoundInstrument:
    """One instrument: how it is reached, what it said, and the drivers for it.

    `addresses` has the one to prefer first. `near` are drivers of its relatives where none recognises it; `used_by` is what of a station
    file has this address.
    """

    addresses: tuple[str, ...]
    said: Text
    identity: Identity | None = None
    matches: tuple[DriverMatch, ...] = ()
    near: tuple[str, ...] = ()
    used_by: tuple[str, ...] = ()

    @property
    def address(self) -> str:
        """The address to prefer."""
        return self.addresses[0]

    def as_dict(self, translate: Translate = english) -> dict[str, Any]:
        """Return it for JSON."""
        identity = self.identity
        return {
            "address": self.address,
            "other_addresses": list(self.addresses[1:]),
            "answer": self.said.render(translate),
            "manufacturer": identity.manufacturer if identity else None,
            "model": identity.model if identity else None,
            "serial_number": (identity.serial_number if identity else "") or None,
            "drivers": [match.as_dict() for match in self.matches],
            "near": list(self.near),
            "station": list(self.used_by),
        }


@dataclass(frozen=True)
class Question:
    """Something that was asked: `where`, `what`, and the `outcome`; `answered` where something usable came."""

    where: str
    what: Text
    outcome: Text
    answered: bool


@dataclass(frozen=True)
class NotScanned:
    """A place that was not looked at, and why."""

    where: str
    why: Text


@dataclass
class ScanReport:
    """The result of a scan so far; `interrupted` if it was broken off."""

    found: list[FoundInstrument] = field(default_factory=list)
    asked: list[Question] = field(default_factory=list)
    unlooked: list[NotScanned] = field(default_factory=list)
    interrupted: bool = False

    def as_dict(self, translate: Translate = english) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "found": [one.as_dict(translate) for one in self.found],
            "asked": [
                {
                    "where": one.where,
                    "what": one.what.render(translate),
                    "outcome": one.outcome.render(translate),
                    "answered": one.answered,
                }
                for one in self.asked
            ],
            "not_looked_at": [{"where": one.where, "why": one.why.render(translate)} for one in self.unlooked],
            "interrupted": self.interrupted,
        }
