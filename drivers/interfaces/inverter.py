"""Three-phase inverter that turns the motor under test."""

from contextlib import AbstractContextManager
from typing import Protocol

from drivers.interfaces.declarations import (
    ELECTRICAL,
    Amount,
    Quantity,
    energises,
    makes_safe,
    question,
    reading,
    set_point,
)
from drivers.interfaces.identity import Instrument, Reading

FREQUENCY = Amount(Quantity.FREQUENCY, "Hz", own="maximum_frequency", signed=True, also=ELECTRICAL)
AMPLITUDE = Amount(Quantity.CURRENT, "A", own="maximum_current")
CURRENT = Amount(Quantity.CURRENT, "A", own="maximum_current", signed=True)


class Inverter(Instrument, Protocol):
    """A drive with an open-loop frequency mode and a current (torque) mode. Currents are phase, peak, in A."""

    @property
    @question
    def maximum_current(self) -> float:
        """Largest phase current (A, peak) that may be commanded."""

    @property
    @question
    def maximum_frequency(self) -> float:
        """Largest electrical frequency (Hz) that may be commanded."""

    @energises(frequency=FREQUENCY, current=AMPLITUDE)
    def driving_frequency(self, frequency: float, current: float) -> AbstractContextManager[None]:
        """Turn the field at a fixed electrical frequency (Hz, sign is direction) with a phase current (A, peak).

        The block is entered once the ramp has ended; at its end the drive is disabled.
        """

    @energises(current=CURRENT)
    def driving_current(self, current: float) -> AbstractContextManager[None]:
        """Regulate the torque-producing (q-axis) current (A, peak) for the length of the block."""

    @set_point(current=CURRENT)
    def set_current(self, current: float) -> None:
        """Change the q-axis current (A, peak) inside a `driving_current` block and wait until it has settled."""

    @makes_safe("command_zero")
    def command_zero(self) -> None:
        """Command no speed and no current, whatever the drive does now; it stays enabled if it was."""

    @reading("Hz", Quantity.FREQUENCY, also=ELECTRICAL)
    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz) the drive puts out."""

    @reading("A", Quantity.CURRENT)
    def measure_current(self) -> Reading:
        """Return the torque-producing current (A, peak) as the drive reports it."""
