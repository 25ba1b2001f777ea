"""The dialogue with one output of a SCPI supply and with its protections: commands, and what reads back after them."""

from drivers.bases.supply_data import SupplyCommands
from drivers.interfaces import CommunicationError, ReportedError
from drivers.interfaces.text import Text, text
from drivers.transport.visa.session import ScpiSession

#: How far a level read back may lie from the one set: steps of the converters are below 5 mV and 5 mA.
READBACK_STEP = 5e-3


class ScpiOutput:
    """One output's dialogue over a session; `channel` is appended to what is sent, `name` stands for it in messages."""

    def __init__(self, session: ScpiSession, channel: str, name: str) -> None:
        self._session = session
        self._channel = channel
        self._name = name

    def command(self, header: str, value: str = "") -> str:
        """Return a command as it is sent."""
        arguments = f"{value},{self._channel}" if value and self._channel else value or self._channel
        return f"{header} {arguments}" if arguments else header

    def write(self, header: str, value: str = "") -> None:
        """Send a command and make sure that the instrument took it."""
        self._session.write(self.command(header, value))

    def number(self, header: str) -> float:
        """Return the number that a query is answered with."""
        return self._session.query_number(self.command(f"{header}?"))

    def flag(self, header: str) -> bool:
        """Return whether a query is answered with other than 0."""
        return self.number(header) != 0

    def confirm(self, header: str, value: float) -> None:
        """Raise CommunicationError where a setting does not read back."""
        found = self.number(header)
        if abs(found - value) > READBACK_STEP:
            raise CommunicationError(
                self._name,
                text("reads back {found:g} after {value:g} was set", found=found, value=value),
                command=self.command(f"{header}?"),
            )

    def confirm_word(self, header: str, word: str) -> None:
        """Raise CommunicationError where a choice, given as its short form, does not read back in that or its long form."""
        query = self.command(f"{header}?")
        found = self._session.query(query).strip()
        if not found.upper().startswith(word):
            raise CommunicationError(
                self._name, text("reads back {found} after {word} was set", found=found, word=word), command=query
            )


class SupplyProtection:
    """Over-current and over-voltage protection as far as they trip and latch."""

    def __init__(self, output: ScpiOutput, commands: SupplyCommands, name: str) -> None:
        self._output, self._commands, self._name = output, commands, name

    def set_over_current(self, *, trips: bool) -> None:
        """Switch the over-current protection on or off."""
        if self._commands.over_current:
            self._output.write(self._commands.over_current, "ON" if trips else "OFF")

    def confirm_over_current(self, *, trips: bool) -> None:
        """Raise CommunicationError where that does not read back."""
        if self._commands.over_current:
            self._output.confirm(self._commands.over_current, float(trips))

    def tripped(self) -> Text | None:
        """Return which protection has tripped, None where none has."""
        for header, which in (
            (self._commands.over_current_tripped, text("over-current")),
            (self._commands.over_voltage_tripped, text("over-voltage")),
        ):
            if header and self._output.flag(header):
                return which
        return None

    def refuse_latched(self) -> None:
        """Raise ReportedError if a protection tripped earlier, because a person must find the cause."""
        tripped = self.tripped()
        if tripped:
            raise ReportedError(
                self._name,
                text("{tripped} protection has tripped earlier and holds the output off", tripped=tripped),
                remedy=text("Remove the cause, then clear the protection at the front panel"),
            )
