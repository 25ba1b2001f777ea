"""Over-current protection of an E36300's output: when it trips after the output went over to constant current."""

from drivers.bases.scpi_supply import ScpiOutput, SupplyCommands, SupplyProtection
from drivers.bases.set_points import check_setpoint

#: Longest delay (s) of the over-current protection (the same in Keysight's N6700 and E36731A).
LONGEST_DELAY = 0.255


class Protection(SupplyProtection):
    """The protections of one output; over-current trips `delay` (s) after the output went over to constant current.

    Raises SetpointError for a delay that cannot be.
    """

    def __init__(self, output: ScpiOutput, commands: SupplyCommands, delay: float, name: str) -> None:
        check_setpoint(name, "over_current_delay", delay, "s", 0.0, LONGEST_DELAY, "the model")
        super().__init__(output, commands, name)
        self._delay = delay

    def set_over_current(self, *, trips: bool) -> None:
        """Switch the over-current protection on or off."""
        self._output.write("CURR:PROT:DEL", f"{self._delay:.6g}")
        # The delay is to pass over a moment at the limit, whenever it comes.
        self._output.write("CURR:PROT:DEL:STAR", "CCTR")
        super().set_over_current(trips=trips)

    def confirm_over_current(self, *, trips: bool) -> None:
        """Raise CommunicationError where that does not read back."""
        self._output.confirm("CURR:PROT:DEL", self._delay)
        super().confirm_over_current(trips=trips)
        self._output.confirm_word("CURR:PROT:DEL:STAR", "CCTR")
