"""Service requests of one client: told when there is a new reason (IVI-6.1, 6.9; VXI-11, B.6.13; IEEE 488.2, 11.3)."""

from collections.abc import Callable

from sim_instruments.scpi.instrument import REQUEST
from sim_instruments.scpi.session import ClientSession


class ServiceRequests:
    """Has `tell` told of the status byte; a reason that lasts is told once."""

    def __init__(self, session: ClientSession, tell: Callable[[int], None]) -> None:
        self._session = session
        self._tell = tell
        self._told = 0

    def look(self, available: bool) -> None:
        """Ask for service where there is a reason that there was not before; `available` says that a reply is to be fetched."""
        reasons = self._session.service_reasons(available)
        new, self._told = reasons & ~self._told, reasons
        if new:
            self._tell(self._session.status_byte(available) | REQUEST)
