"""A contact that must be closed while anything is energised: an emergency stop, a door."""

from typing import Protocol


class Interlock(Protocol):
    """One contact, read afresh each time it is asked for."""

    def closed(self) -> bool:
        """Return whether it is closed now. Raises CommunicationError or ReportedError where nobody can tell."""

    def close(self) -> None:
        """Let go of the connection; may be called twice."""
