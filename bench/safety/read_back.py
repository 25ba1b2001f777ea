"""Reads back the sources of a run and the shaft while a person may work at the motor."""

from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from typing import Protocol

from bench.safety.shutdown_items import Measured, measured
from bench.station.shutdown_sequence import BELOW, OFF_BY, ROLES_OF, Item, ShutdownSequence, item
from drivers.interfaces import Instrument, InstrumentError, Role
from drivers.interfaces.text import Text, text_of

#: Where a role that feeds nothing says how fast the shaft turns.
_SPEED = (Role.TACHOMETER,)


class Found(StrEnum):
    """State of one instrument as found."""

    OFF = "off"
    ON = "on"
    #: It did not answer.
    SILENT = "silent"
    #: A person sets and reads it.
    BY_HAND = "by_hand"
    #: Its driver has nothing that could be read while it is off.
    UNREADABLE = "unreadable"


@dataclass(frozen=True)
class ReadBack:
    """Reply of one instrument: its values and their units, or why there are none; `feeds` where it is a source."""

    role: str
    found: Found
    feeds: bool
    values: tuple[Measured, ...] = ()
    error: Text | None = None


class _Instruments(Protocol):
    """A run's instruments, as far as they are needed here."""

    def open(self, role: Role) -> None:
        """Open the instrument of a role. Raises InstrumentError."""

    def opened(self) -> Mapping[Role, Instrument]:
        """Return those that are open, with nothing in front."""


class SourceReader:
    """Reads back the sources of a run by what its station's shutdown measures, with the shutdown's own limits.

    To be asked by the thread that commands the instruments, between its commands.
    """

    def __init__(self, instruments: _Instruments, roles: Collection[Role], way_down: ShutdownSequence) -> None:
        self._instruments = instruments
        self._roles = sorted((role for role in roles if role in OFF_BY or role in _SPEED), key=lambda role: role.value)
        self._items = {role: tuple(_items(role, way_down)) for role in self._roles}
        self._by_hand = way_down.by_hand
        self._unopened: dict[Role, Text] = {}

    def read(self, *, again: bool = False) -> tuple[ReadBack, ...]:
        """Return what each says now; one that could not be opened is tried `again` only where that is wanted."""
        if again:
            self._unopened.clear()
        return tuple(self._read(role) for role in self._roles)

    def _read(self, role: Role) -> ReadBack:
        result = ReadBack(role.value, Found.BY_HAND, role in OFF_BY)
        if role in self._by_hand:
            return result
        if not self._items[role]:
            return replace(result, found=Found.UNREADABLE)
        try:
            if role in self._unopened:
                return replace(result, found=Found.SILENT, error=self._unopened[role])
            if role not in self._instruments.opened():
                self._open(role)
            instrument = self._instruments.opened()[role]
            values = tuple(measured(one, instrument) for one in self._items[role])
        except InstrumentError as error:
            return replace(result, found=Found.SILENT, error=text_of(error))
        off = all(value.value <= one.below for one, value in zip(self._items[role], values, strict=True))
        return replace(result, found=Found.OFF if off else Found.ON, values=values)

    def _open(self, role: Role) -> None:
        try:
            self._instruments.open(role)
        except InstrumentError as error:
            self._unopened[role] = text_of(error)
            raise


def _items(role: Role, way_down: ShutdownSequence) -> Iterator[Item]:
    own = {one.do: one for one in way_down.items if one.role is role}
    for do in BELOW:
        if role in ROLES_OF[do]:
            yield own.get(do) or item(do, role)
