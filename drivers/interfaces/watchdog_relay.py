"""A relay that drops out by itself once nobody feeds it: what takes the energy from instruments without a watchdog of their own."""

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
        """Have it stay closed for another of its times. Raises ReportedError where it has dropped out, CommunicationError for no answer."""

    def drop_out(self) -> None:
        """Open the contact and make sure of it; raises ReportedError where it stays closed, CommunicationError for no answer."""

    def close(self) -> None:
        """Put settings back that were changed and let go of the connection; may be called twice. Raises InstrumentError."""
