"""DC supply (IviDCPwr)."""

from contextlib import AbstractContextManager
from enum import Enum
from typing import Protocol

from drivers.interfaces.declarations import (
    NO_QUANTITY,
    Amount,
    Quantity,
    energises,
    makes_safe,
    question,
    reading,
    set_point,
)
from drivers.interfaces.identity import Instrument, Reading


class OutputMode(Enum):
    """Quantity at which the output is regulated now."""

    OFF = "off"
    CONSTANT_VOLTAGE = "constant voltage"
    CONSTANT_CURRENT = "constant current"
    UNREGULATED = "unregulated"
    TRIPPED = "tripped"


class Regulated(Enum):
    """The quantity that an output must regulate; reaching the limit of the other one is then a fault.

    An output that is to hold its voltage goes off where the current reaches its limit (over-current protection). One that is to
    hold its current is always at that limit; its voltage level is what it must not pass.
    """

    VOLTAGE = "voltage"
    CURRENT = "current"


VOLTAGE = Amount(Quantity.VOLTAGE, "V", own="maximum_voltage")
CURRENT = Amount(Quantity.CURRENT, "A", own="maximum_current")


class Supply(Instrument, Protocol):
    """One output of a DC supply, with voltage level and current limit."""

    @property
    @question
    def maximum_voltage(self) -> float:
        """Largest voltage (V) this output may be set to: the lesser of the model's and the station's."""

    @property
    @question
    def maximum_current(self) -> float:
        """Largest current limit (A) this output may be set to."""

    @set_point(voltage=VOLTAGE, current_limit=CURRENT, regulated=NO_QUANTITY)
    def configure(self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE) -> None:
        """Set voltage level (V), current limit (A), and the protections of an output that holds what is `regulated`.

        The output stays as it is. Raises SetpointError where a value is outside the allowed range.
        """

    @energises(voltage=VOLTAGE, current_limit=CURRENT, regulated=NO_QUANTITY)
    def energised(
        self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE
    ) -> AbstractContextManager[None]:
        """Configure, switch the output on, and off again at the end of the block, however it ends.

        Raises ReportedError at the end where a protection has switched it off meanwhile.
        """

    @makes_safe("output_off")
    def output_off(self) -> None:
        """Switch the output off and confirm that it is."""

    @reading()
    def output_mode(self) -> OutputMode:
        """Say what regulates the output now."""

    @reading("V", Quantity.VOLTAGE)
    def measure_voltage(self) -> Reading:
        """Return the output voltage (V) by the supply's own meter."""

    @reading("A", Quantity.CURRENT)
    def measure_current(self) -> Reading:
        """Return the output current (A) by the supply's own meter."""
