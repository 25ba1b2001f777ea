"""A relay that drops out by itself without a heartbeat. It removes the energy from instruments that have no watchdog of their own."""

from typing import Protocol

from drivers.interfaces.watchdog import Watchdog


class WatchdogRelay(Protocol):
    """One contact, closed while the relay has picked up."""

    @property
    def watchdog(self) -> Watchdog:
        """The time (s) within which it must be fed, and by which of its settings."""

    def picked_up(self) -> bool:
        """Return whether the contact is closed now; changes nothing and feeds nothing."""

    def pick_up(self) -> None:
        """Arm the watchdog, close the contact and make sure of both.

        Raises SetpointError for a time that cannot be, ReportedError where the relay refuses, CommunicationError where it does not answer.
        """

    def feed(self) -> None:
        """Keep the contact closed for another period. Raises ReportedError where it has dropped out, CommunicationError for no answer."""

    def drop_out(self) -> None:
        """Open the contact and make sure of it; raises ReportedError where it stays closed, CommunicationError for no answer."""

    def close(self) -> None:
        """Restore changed settings and close the connection; may be called twice. Raises InstrumentError."""
