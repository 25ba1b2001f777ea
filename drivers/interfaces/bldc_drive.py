"""Six-step drive of a brushless DC motor: a three-phase bridge commutated by Hall signals, fed from a DC source."""

from contextlib import AbstractContextManager
from typing import Protocol

from drivers.interfaces.declarations import ELECTRICAL, Quantity, energises, reading
from drivers.interfaces.identity import Instrument, Reading


class BldcDrive(Instrument, Protocol):
    """A drive with 120° conduction at full voltage, which reads its DC link and its Hall sensors."""

    @energises(source="measure_bus_voltage")
    def running(self) -> AbstractContextManager[None]:
        """Commutate the motor at full voltage for the length of the block; at its end the bridge is off, confirmed.

        Raises ReportedError where the drive is in fault, MeasurementError where it does not reach operation.
        """

    @reading("V", Quantity.VOLTAGE, label="DC link voltage")
    def measure_bus_voltage(self) -> Reading:
        """Return the mean voltage (V) of the DC link, behind the source's resistance."""

    @reading("A", Quantity.CURRENT, label="DC link current")
    def measure_bus_current(self) -> Reading:
        """Return the mean current (A) out of the DC source."""

    @reading("Hz", Quantity.FREQUENCY, also=ELECTRICAL)
    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz) from the Hall signals' edges."""

    @reading()
    def hall_state(self) -> tuple[bool, bool, bool]:
        """Return the three Hall signals now."""
