"""What the driver of every instrument on a VISA session has, whatever its role."""

from drivers.interfaces import Clock, Identity
from drivers.transport.visa.session import ScpiSession


class ScpiDriver:
    """An instrument's identity and connection; `name` stands for it in messages.

    A driver is derived from this and then from its role's interface, and sets `_identity` when it is made.
    """

    _identity: Identity

    def __init__(self, session: ScpiSession, clock: Clock, name: str) -> None:
        self._session = session
        self._clock = clock
        self._name = name

    @property
    def identity(self) -> Identity:
        """Who answered *IDN? when this was opened."""
        return self._identity

    def close(self) -> None:
        """Close the connection; what the instrument is set to stays as it is."""
        self._session.close()
