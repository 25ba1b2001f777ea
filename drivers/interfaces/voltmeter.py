"""DC voltmeter (IviDmm, DC volts)."""

from typing import Protocol

from drivers.interfaces.declarations import in_units, question, reading, setting
from drivers.interfaces.identity import Accuracy, Instrument, Reading


class Voltmeter(Instrument, Protocol):
    """A digital multimeter as a DC voltmeter, for the sense leads of a four-wire resistance measurement."""

    @property
    @question
    def maximum_voltage(self) -> float:
        """Largest voltage (V) that may be between its leads, whatever range is set."""

    @in_units(full_scale="V")
    @setting
    def configure(self, full_scale: float, power_line_cycles: float = 10.0) -> None:
        """Set the smallest range (V) that holds `full_scale`, and the integration time in power-line cycles.

        Raises SetpointError where no range holds it.
        """

    @reading("V")
    def measure_voltage(self) -> Reading:
        """Trigger one reading (V) and return it; raises OverloadError beyond the range."""

    @question
    def accuracy_at(self, voltage: float) -> Accuracy:
        """Return the limits of error that a reading of this voltage (V) would have in the range that holds it."""
