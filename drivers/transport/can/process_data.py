"""Objects that a node sends on a SYNC (CiA 301): mapped into its transmit PDOs, read at one instant, given back at the end."""

import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Protocol

from drivers.interfaces import CommunicationError, InstrumentError, ReportedError
from drivers.interfaces.text import text
from drivers.transport.can.objects import NodeObjects

_COMMUNICATION, _MAPPING = 0x1800, 0x1A00
#: Bits of a PDO's identifier: not valid; and the identifier itself. Its transmission type: with every SYNC.
_NOT_VALID, _IDENTIFIER, _EVERY_SYNC = 1 << 31, 0x7FF, 1
#: How long (s) the frames may take after a SYNC.
_TIME = 0.3


@dataclass(frozen=True)
class MappedObject:
    """One object without members that is to be sent: `size` in bytes."""

    index: int
    size: int
    signed: bool = False


class SyncBus(Protocol):
    """Bus as process data use it."""

    def hear(self, identifier: int, take: Callable[[bytes], None]) -> Callable[[], None]:
        """Subscribe `take` to the data of each frame with an identifier; return what ends that."""

    def synchronise(self) -> None:
        """Send a SYNC. Raises CommunicationError for a dead bus."""


@dataclass
class _Pdo:
    """One transmit PDO as it was found, and what is mapped into it now."""

    number: int
    identifier: int
    type: int
    entries: list[int]
    objects: Sequence[MappedObject] = ()
    data: bytes | None = None
    end: Callable[[], None] = field(default=lambda: None)


class ProcessData:
    """The transmit PDOs of one node, which are ours from `map` to `give_back`."""

    def __init__(self, objects: NodeObjects, bus: SyncBus) -> None:
        self._objects = objects
        self._bus = bus
        self._pdos: list[_Pdo] = []
        self._arrived = threading.Condition()

    @property
    def mapped(self) -> tuple[int, ...]:
        """The objects that are sent."""
        return tuple(one.index for pdo in self._pdos for one in pdo.objects)

    def map(self, *groups: Sequence[MappedObject]) -> None:
        """Map each group, of eight bytes at most, into a PDO of its own; one that the node does not let be mapped is left as it is."""
        for number, group in enumerate(groups):
            try:
                pdo = self._found(number)
            except ReportedError:
                return
            try:
                self._set(
                    pdo, _EVERY_SYNC, [one.index << 16 | one.size * 8 for one in group], pdo.identifier & ~_NOT_VALID
                )
            except ReportedError:
                self._restore(pdo)
                continue
            pdo.objects = tuple(group)
            pdo.end = self._bus.hear(pdo.identifier & _IDENTIFIER, lambda data, pdo=pdo: self._take(pdo, data))  # type: ignore[misc]
            self._pdos.append(pdo)

    def read(self) -> dict[int, int]:
        """Return all objects as they were at one SYNC, by index; raises CommunicationError where a frame does not come."""
        with self._objects.calls.exchange(), self._arrived:
            for pdo in self._pdos:
                pdo.data = None
            self._objects.trace("write", "SYNC")
            self._bus.synchronise()
            if not self._arrived.wait_for(lambda: all(pdo.data is not None for pdo in self._pdos), _TIME):
                raise CommunicationError(self._objects.name, text("no process data came"), command="SYNC")
            frames = [(pdo.objects, pdo.data or b"") for pdo in self._pdos]
        self._objects.trace("read", " | ".join(data.hex(" ") for _, data in frames))
        return {index: value for objects, data in frames for index, value in self._unpacked(objects, data)}

    def give_back(self) -> None:
        """Put every PDO back as it was found, where the node still answers; may be called twice."""
        pdos, self._pdos = self._pdos, []
        for pdo in pdos:
            pdo.end()
            self._restore(pdo)

    def _take(self, pdo: _Pdo, data: bytes) -> None:
        with self._arrived:
            pdo.data = data
            self._arrived.notify_all()

    def _unpacked(self, objects: Sequence[MappedObject], data: bytes) -> list[tuple[int, int]]:
        if len(data) != sum(one.size for one in objects):
            raise CommunicationError(
                self._objects.name, text("{count} bytes of process data", count=len(data)), command="SYNC"
            )
        found, place = [], 0
        for one in objects:
            value = int.from_bytes(data[place : place + one.size], "little", signed=one.signed)
            found.append((one.index, value))
            place += one.size
        return found

    def _found(self, number: int) -> _Pdo:
        read = self._objects.read
        identifier, kind = read(_COMMUNICATION + number, 1, 4), read(_COMMUNICATION + number, 2, 1)
        count = read(_MAPPING + number, 0, 1)
        entries = [read(_MAPPING + number, subindex, 4) for subindex in range(1, count + 1)]
        return _Pdo(number, identifier, kind, entries)

    def _set(self, pdo: _Pdo, kind: int, entries: Sequence[int], identifier: int) -> None:
        """Write a mapping in the order that CiA 301 prescribes: not valid, none, each, how many, valid."""
        write, communication, mapping = self._objects.write, _COMMUNICATION + pdo.number, _MAPPING + pdo.number
        write(communication, 1, pdo.identifier | _NOT_VALID, 4)
        write(communication, 2, kind, 1)
        write(mapping, 0, 0, 1)
        for subindex, entry in enumerate(entries, 1):
            write(mapping, subindex, entry, 4)
        write(mapping, 0, len(entries), 1)
        write(communication, 1, identifier, 4)

    def _restore(self, pdo: _Pdo) -> None:
        with suppress(InstrumentError):
            self._set(pdo, pdo.type, pdo.entries, pdo.identifier)
