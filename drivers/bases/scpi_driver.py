"""Base of all drivers on a VISA session, for any role."""

from collections.abc import Callable, Iterable
from typing import Any, Self

from drivers.bases.found_state import FoundState, WantedSetting
from drivers.catalogue import Surroundings
from drivers.interfaces import Clock, Identity
from drivers.interfaces.found_state import FoundSetting
from drivers.transport.visa.opening import open_driver, open_session
from drivers.transport.visa.session import ScpiSession

#: How long (s) a setting may take to be told: one that a model does not have is met by silence.
_ASKING = 2.0


class ScpiDriver:
    """An instrument's identity and connection; `name` stands for it in messages.

    A driver is derived from this and then from its role's interface, and sets `_identity` when it is made. `_local` is the
    command that gives the front panel back, where the instrument has one.
    """

    _identity: Identity
    _local = ""

    def __init__(self, session: ScpiSession, clock: Clock, name: str) -> None:
        self._session = session
        self._clock = clock
        self._name = name
        self._found: FoundState | None = None

    @classmethod
    def open(cls, address: str, options: Any, surroundings: Surroundings, name: str, **line: Any) -> Self:
        """Open the instrument at a VISA address; `line` holds further arguments of `open_session`.

        Raises CommunicationError where nothing answers, IdentityError where something else does.
        """
        make: Callable[..., Self] = cls
        return open_driver(
            open_session(address, surroundings, name, **line),
            lambda session: make(session, surroundings.clock, options, name=name, guarding=surroundings.guarding),
        )

    @property
    def identity(self) -> Identity:
        """Identity by *IDN? when this was opened."""
        return self._identity

    @property
    def found_state(self) -> tuple[FoundSetting, ...]:
        """Settings found on opening that would change a figure."""
        return () if self._found is None else self._found.settings

    def close(self) -> None:
        """Restore the settings changed on opening, return control to the front panel, and close the connection."""
        found, self._found = self._found, None
        if found is not None:
            found.give_back()
            self._session.go_to_local(self._local)
        self._session.close()

    def _take_over(self, rows: Iterable[WantedSetting], plain: Callable[[str], str] = str.strip) -> None:
        """Ask and set what the last user left; `plain` makes of an answer what a setting takes.

        Raises ReportedError where something is wrong that may not be set.
        """
        session = self._session

        def put(row: WantedSetting, value: str) -> None:
            session.write(row.command.format(value=value))

        found = FoundState(self._name, lambda row: plain(session.query(row.query, timeout=_ASKING)), put)
        found.take_over(rows)
        self._found = found
