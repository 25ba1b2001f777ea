"""What Modbus TCP and RTU have in common: requests to units, their virtual time and their faults."""

import threading
from collections.abc import Sequence

import numpy as np

from sim_instruments.connection import Connection
from sim_instruments.faults import Fault, FaultKind, Faults
from sim_instruments.instruments.registers import RegisterDevice
from sim_instruments.scpi.exchange import Clock


class ModbusLine:
    """The units behind an endpoint, and the faults of its line.

    Faults see requests as "read UNIT ADDRESS COUNT" and "write UNIT ADDRESS COUNT", the address like 2103H.
    """

    def __init__(self, units: Sequence[RegisterDevice], clock: Clock, generator: np.random.Generator) -> None:
        self.units = {unit.unit: unit for unit in units}
        if len(self.units) != len(units):
            raise ValueError(f"two units share an identifier among {[unit.unit for unit in units]}")
        self.clock = clock
        self.generator = generator
        self.faults = Faults()
        self.connection = Connection()
        self.lock = threading.Lock()

    def strike(self, verb: str, unit: int, address: int, count: int) -> Fault | None:
        """Return the fault that strikes a request; a late one has been waited for."""
        fault = self.fault(verb, unit, address, count)
        if fault is not None and fault.kind is FaultKind.LATE and fault.delay > 0.0:
            self.clock.sleep(fault.delay)
        return fault

    def fault(self, verb: str, unit: int, address: int, count: int) -> Fault | None:
        """Return the fault that strikes a request, without waiting for a late one."""
        if not self.faults:
            return None
        return self.faults.strike(f"{verb} {unit} {address:04X}H {count}")
