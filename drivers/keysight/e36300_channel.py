"""One output in the E36300's dialogue: every command and query carries its channel list, every setting is read back."""

from drivers.interfaces import CommunicationError
from drivers.transport.visa.session import ScpiSession

#: How far a level read back may lie from the one set: steps of the converters are below 5 mV and 5 mA.
READBACK_STEP = 5e-3


class Channel:
    """Output `number` of the supply behind a session; `name` stands for it in messages."""

    def __init__(self, session: ScpiSession, number: int, name: str) -> None:
        self._session = session
        self._list = f"(@{number})"
        self._name = name

    def command(self, header: str, value: str = "") -> str:
        """Return a command as it is sent."""
        return f"{header} {value},{self._list}" if value else f"{header} {self._list}"

    def write(self, header: str, value: str = "") -> None:
        """Send a command and make sure that the instrument took it."""
        self._session.write(self.command(header, value))

    def number(self, header: str) -> float:
        """Return the number that a query is answered with."""
        return self._session.query_number(f"{header}? {self._list}")

    def flag(self, header: str) -> bool:
        """Return whether a query is answered with other than 0."""
        return self.number(header) != 0

    def confirm(self, header: str, value: float) -> None:
        """Raise CommunicationError where a setting does not read back."""
        found = self.number(header)
        if abs(found - value) > READBACK_STEP:
            raise CommunicationError(
                self._name, f"reads back {found:g} after {value:g} was set", command=f"{header}? {self._list}"
            )

    def confirm_word(self, header: str, word: str) -> None:
        """Raise CommunicationError where a choice does not read back, in its short or its long form."""
        query = f"{header}? {self._list}"
        found = self._session.query(query).strip()
        if not found.upper().startswith(word[:3]):
            raise CommunicationError(self._name, f"reads back {found} after {word} was set", command=query)
