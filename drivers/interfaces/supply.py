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


class Supply(Instrument, Protocol):
    """One output of a DC supply, with voltage level and current limit."""

    @property
    def maximum_voltage(self) -> float:
        """Largest voltage (V) this output may be set to: the lesser of the model's and the station's."""

    @property
    def maximum_current(self) -> float:
        """Largest current limit (A) this output may be set to."""

    def configure(self, voltage: float, current_limit: float) -> None:
        """Set voltage level (V) and current limit (A), and protections above them; the output stays as it is.

        Raises SetpointError where a value is outside the allowed range.
        """

    def energised(self, voltage: float, current_limit: float) -> AbstractContextManager[None]:
        """Configure, switch the output on, and off again at the end of the block, however it ends."""

    def output_off(self) -> None:
        """Switch the output off and confirm that it is."""

    def output_mode(self) -> OutputMode:
        """Say what regulates the output now."""

    def measure_voltage(self) -> Reading:
        """Return the output voltage (V) by the supply's own meter."""

    def measure_current(self) -> Reading:
        """Return the output current (A) by the supply's own meter."""
