"""The drivers that match an answer, by each driver's declaration of its instrument."""

from collections.abc import Callable, Iterable, Mapping
from difflib import SequenceMatcher
from typing import TypeVar

from bench.discovery.findings import DriverMatch
from drivers.catalogue import Driver
from drivers.interfaces import Identity
from drivers.interfaces.strangers_code import strangers_code
from drivers.interfaces.text import Text, text_of
from drivers.recognition import CanFdTalk, CanOpenProfile, ModbusUnit, Registers, ScpiIdentity, SerialTalk

A = TypeVar("A")
B = TypeVar("B")
#: Drivers named for an instrument that none recognises, at most, and how alike (0 … 1) two models of unrelated makers must be.
_MOST_NEAR, _ALIKE = 3, 0.6


class KnownInstruments:
    """The drivers to be had, by what they recognise."""

    def __init__(self, drivers: Iterable[Driver]) -> None:
        self._drivers = tuple(drivers)
        #: What went wrong in a driver's own judgement of an answer, by the driver's or the unit's name.
        self.faults: dict[str, Text] = {}

    def judged(self, name: str, judge: Callable[[A], B | None], answer: A) -> B | None:
        """Return a driver's evaluation of an answer; if it fails, as a plug-in's may, None and an entry in `faults`."""
        try:
            with strangers_code():
                return judge(answer)
        except Exception as error:  # noqa: BLE001  the other drivers are still asked
            self.faults[name] = text_of(error)
            return None

    def scpi(self, line: str) -> tuple[Identity | None, tuple[DriverMatch, ...], tuple[str, ...]]:
        """Return the identity in a reply to *IDN?, the drivers that recognise it, and those near where none does."""
        matches, identity = [], None
        for driver in self._drivers:
            for kind in driver.recognised_by:
                if not isinstance(kind, ScpiIdentity):
                    continue
                known = self.judged(driver.name, kind.identity_of, line)
                if known is not None:
                    identity = known
                    matches.append(DriverMatch(driver))
        if matches:
            return identity, tuple(matches), ()
        fields = [field.strip() for field in line.split(",")]
        if len(fields) != 4:
            return None, (), ()
        return Identity(*fields), (), self._near(fields[0], fields[1])

    def can_open(self, device_type: int) -> tuple[DriverMatch, ...]:
        """Return the drivers for a node of this device type (0x1000)."""
        return tuple(
            DriverMatch(driver)
            for driver in self._drivers
            for kind in driver.recognised_by
            if isinstance(kind, CanOpenProfile) and kind.matches(device_type)
        )

    def fd_nodes(self) -> tuple[tuple[Driver, CanFdTalk], ...]:
        """Return what nodes of CAN FD may answer."""
        return tuple((d, kind) for d in self._drivers for kind in d.recognised_by if isinstance(kind, CanFdTalk))

    def modbus_units(self) -> tuple[ModbusUnit, ...]:
        """Return every unit that a driver knows."""
        kinds = [kind for driver in self._drivers for kind in driver.recognised_by]
        return tuple(dict.fromkeys(kind for kind in kinds if isinstance(kind, ModbusUnit)))

    def unit_at(self, registers: Registers) -> tuple[ModbusUnit, Text] | None:
        """Return which of the units has these registers, with what it is; None for an unknown one."""
        for unit in self.modbus_units():
            said = self.judged(unit.name, unit.recognise, registers)
            if said is not None:
                return unit, said
        return None

    def modbus(self, units: Mapping[int, ModbusUnit]) -> tuple[tuple[DriverMatch, ...], tuple[str, ...]]:
        """Return the drivers whose units are all among those of a line (by number), and those of which some are missing."""
        matches, near = [], []
        for driver in self._drivers:
            parts = [kind for kind in driver.recognised_by if isinstance(kind, ModbusUnit)]
            there = {part.option: number for part in parts for number, unit in units.items() if unit == part}
            if parts and len(there) == len(parts):
                matches.append(DriverMatch(driver, there))
            elif there:
                near.append(driver.name)
        return tuple(matches), tuple(near)

    def serial_lines(self) -> tuple[tuple[Driver, SerialTalk], ...]:
        """Return what may be heard on a serial line; what talks by itself comes before what is asked."""
        found = [(d, kind) for d in self._drivers for kind in d.recognised_by if isinstance(kind, SerialTalk)]
        return tuple(sorted(found, key=lambda pair: bool(pair[1].question)))

    def serial_scpi_rates(self) -> tuple[int, ...]:
        """Return the rates (bit/s) of drivers that speak SCPI on a serial line."""
        # What has no rate of its own in a station file could not be opened at it.
        rates = [getattr(driver.options, "baud_rate", None) for driver in self._drivers if _speaks_scpi(driver)]
        return tuple(sorted({rate for rate in rates if isinstance(rate, int)}))

    def _near(self, maker: str, model: str) -> tuple[str, ...]:
        """Return drivers for other models of the same maker, else for models called alike, the nearest first."""
        scored = []
        for driver in self._drivers:
            for kind in driver.recognised_by:
                if not isinstance(kind, ScpiIdentity):
                    continue
                alike = max(SequenceMatcher(None, model.upper(), known).ratio() for known in kind.models)
                own = maker.lower() in (*kind.makers, kind.unnamed.lower())
                if own or alike >= _ALIKE:
                    scored.append((own, alike, driver.name))
        scored.sort(key=lambda one: (not one[0], -one[1], one[2]))
        return tuple(dict.fromkeys(name for *_, name in scored))[:_MOST_NEAR]


def _speaks_scpi(driver: Driver) -> bool:
    return any(isinstance(kind, ScpiIdentity) for kind in driver.recognised_by)
