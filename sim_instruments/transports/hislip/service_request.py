"""Service requests of one HiSLIP client: told when there is a new reason (IVI-6.1, 6.9; IEEE 488.2, 11.3)."""

from sim_instruments.scpi.instrument import REQUEST
from sim_instruments.scpi.session import ClientSession
from sim_instruments.transports.client import Client
from sim_instruments.transports.hislip.messages import Message, MessageType


class ServiceRequests:
    """Sends AsyncServiceRequest with the status byte; a reason that lasts is told once."""

    def __init__(self, session: ClientSession, client: Client) -> None:
        self._session = session
        self._client = client
        self._told = 0

    def look(self, available: bool) -> None:
        """Ask for service where there is a reason that there was not before; `available` says that a reply is to be fetched."""
        reasons = self._session.service_reasons(available)
        new, self._told = reasons & ~self._told, reasons
        if new:
            status = self._session.status_byte(available) | REQUEST
            Message(MessageType.ASYNC_SERVICE_REQUEST, status).offer(self._client)
