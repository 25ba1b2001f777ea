"""Over-current and over-voltage protection of an E36300's output, as far as they trip and latch."""

from drivers.bases.set_points import check_setpoint
from drivers.interfaces import ReportedError
from drivers.keysight.e36300_channel import Channel

#: Longest delay (s) of the over-current protection (the same in Keysight's N6700 and E36731A).
LONGEST_DELAY = 0.255


class Protection:
    """The protections of one output; over-current trips `delay` (s) after the output went over to constant current.

    Raises SetpointError for a delay that cannot be.
    """

    def __init__(self, channel: Channel, delay: float, name: str) -> None:
        check_setpoint(name, "over_current_delay", delay, "s", 0.0, LONGEST_DELAY, "the model")
        self._channel = channel
        self._delay = delay
        self._name = name

    def set_over_current(self, *, trips: bool) -> None:
        """Switch the over-current protection on or off."""
        self._channel.write("CURR:PROT:DEL", f"{self._delay:.6g}")
        # The delay is to pass over a moment at the limit, whenever it comes.
        self._channel.write("CURR:PROT:DEL:STAR", "CCTR")
        self._channel.write("CURR:PROT:STAT", "ON" if trips else "OFF")

    def confirm_over_current(self, *, trips: bool) -> None:
        """Raise CommunicationError where that does not read back."""
        self._channel.confirm("CURR:PROT:DEL", self._delay)
        self._channel.confirm("CURR:PROT:STAT", float(trips))
        self._channel.confirm_word("CURR:PROT:DEL:STAR", "CCTR")

    def tripped(self) -> str:
        """Return which protection has tripped, nothing where none has."""
        if self._channel.flag("CURR:PROT:TRIP"):
            return "over-current"
        return "over-voltage" if self._channel.flag("VOLT:PROT:TRIP") else ""

    def refuse_latched(self) -> None:
        """Raise ReportedError where a protection tripped earlier: that is for a person to look into."""
        tripped = self.tripped()
        if tripped:
            raise ReportedError(
                self._name,
                f"{tripped} protection has tripped earlier and holds the output off",
                remedy="Remove the cause, then clear the protection at the front panel",
            )
