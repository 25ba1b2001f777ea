"""A contact that must be closed while anything is energised: an emergency stop, a door."""

from typing import Protocol


class Interlock(Protocol):
    """One contact; every query reads it again."""

    def closed(self) -> bool:
        """Return whether it is closed now. Raises CommunicationError or ReportedError if that cannot be determined."""

    def close(self) -> None:
        """Close the connection; may be called twice."""
