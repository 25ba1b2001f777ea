"""Status registers of SCPI: condition, event, enable and transition filters (SCPI-99 volume 1, chapter 9)."""

from collections.abc import Callable

#: The bits of a register; the sixteenth is always 0.
_BITS = 0x7FFF


class StatusRegister:
    """A condition register with its event and enable registers; conditions are asked for when they matter."""

    def __init__(self, condition: Callable[[], int] | None = None) -> None:
        self._condition = condition
        self._last = 0
        self._event = 0
        self._enable = 0
        self.positive = _BITS
        self.negative = 0

    @property
    def enable(self) -> int:
        """Mask of the events that show in the summary."""
        return self._enable

    @enable.setter
    def enable(self, value: int) -> None:
        self._enable = value & _BITS

    def condition(self) -> int:
        """Return the conditions as they are now, latching their transitions."""
        if self._condition is not None:
            new = self._condition() & _BITS
            rising, falling = new & ~self._last, self._last & ~new
            self._event |= (rising & self.positive) | (falling & self.negative)
            self._last = new
        return self._last

    def latch(self, bits: int) -> None:
        """Set event bits directly."""
        self._event |= bits & _BITS

    def read_event(self) -> int:
        """Return the events and clear them."""
        self.condition()
        event, self._event = self._event, 0
        return event

    def clear(self) -> None:
        """Clear the events, not the mask."""
        self.condition()
        self._event = 0

    def summary(self) -> bool:
        """Return whether an enabled event is set."""
        self.condition()
        return bool(self._event & self._enable)
