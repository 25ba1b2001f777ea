"""Tachometer."""

from typing import Protocol

from drivers.interfaces.declarations import Quantity, reading
from drivers.interfaces.identity import Instrument, Reading


class Tachometer(Instrument, Protocol):
    """A rotational speed meter; it does not see the direction."""

    @reading("rad/s", Quantity.SPEED)
    def measure_speed(self) -> Reading:
        """Return the speed as a Reading in rad/s (mechanical), averaged over the instrument's gate."""
