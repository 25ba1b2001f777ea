"""The common part of Modbus TCP and RTU: requests to units, their virtual time and their faults."""

import threading
from collections.abc import Mapping, Sequence

import numpy as np

from sim_instruments.faults.line_faults import Fault, Faults
from sim_instruments.instruments.registers import RegisterDevice
from sim_instruments.instruments.serial_framing import SerialFraming
from sim_instruments.scpi.exchange import InstrumentClock
from sim_instruments.transports.connection import Connection


class ModbusLine:
    """The units behind an endpoint, and the faults of its line.

    Faults see requests as "read UNIT ADDRESS COUNT" and "write UNIT ADDRESS COUNT", the address like 2103H.
    """

    def __init__(self, units: Sequence[RegisterDevice], clock: InstrumentClock, generator: np.random.Generator) -> None:
        self._units = tuple(units)
        if len({unit.unit for unit in units}) != len(units):
            raise ValueError(f"two units share an identifier among {[unit.unit for unit in units]}")
        self.clock = clock
        self.generator = generator
        self.faults = Faults()
        self.connection = Connection()
        self.lock = threading.Lock()

    @property
    def units(self) -> Mapping[int, RegisterDevice]:
        """The units by the numbers that they answer to now."""
        return {unit.unit: unit for unit in self._units}

    def framing_of(self, unit: int) -> SerialFraming | None:
        """Return how a unit frames what it sends; None for one that takes what comes, or is not there."""
        return getattr(self.units.get(unit), "framing", None)

    def recorded(self, unit: int, request: bytes) -> tuple[bytes, Fault | None] | None:
        """Return the answer to a request where all are known beforehand; None where the units work them out."""
        return None
