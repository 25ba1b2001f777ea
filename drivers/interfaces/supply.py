"""DC supply (IviDCPwr)."""

from contextlib import AbstractContextManager
from enum import Enum
from typing import Protocol

from drivers.interfaces.identity import Instrument, Reading


class OutputMode(Enum):
    """What regulates the output now."""

    OFF = "off"
    CONSTANT_VOLTAGE = "constant voltage"
    CONSTANT_CURRENT = "constant current"
    UNREGULATED = "unregulated"
    TRIPPED = "tripped"


class Regulated(Enum):
    """Which quantity an output is meant to hold; reaching the other one is then a fault.

    An output that is to hold its voltage goes off where the current reaches its limit (over-current protection). One that is to
    hold its current is always at that limit; its voltage level is what it must not pass.
    """

    VOLTAGE = "voltage"
    CURRENT = "current"


class Supply(Instrument, Protocol):
    """One output of a DC supply, with voltage level and current limit."""

    @property
    def maximum_voltage(self) -> float:
        """Largest voltage (V) this output may be set to: the lesser of the model's and the station's."""

    @property
    def maximum_current(self) -> float:
        """Largest current limit (A) this output may be set to."""

    @property
    def read_by_hand(self) -> bool:
        """Whether a person sets and reads it, and is not asked for more than a step needs."""

    def configure(self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE) -> None:
        """Set voltage level (V), current limit (A), and the protections of an output that holds what is `regulated`.

        The output stays as it is. Raises SetpointError where a value is outside the allowed range.
        """

    def energised(
        self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE
    ) -> AbstractContextManager[None]:
        """Configure, switch the output on, and off again at the end of the block, however it ends.

        Raises ReportedError at the end where a protection has switched it off meanwhile.
        """

    def output_off(self) -> None:
        """Switch the output off and confirm that it is."""

    def output_mode(self) -> OutputMode:
        """Say what regulates the output now."""

    def measure_voltage(self) -> Reading:
        """Return the output voltage (V) by the supply's own meter."""

    def measure_current(self) -> Reading:
        """Return the output current (A) by the supply's own meter."""
