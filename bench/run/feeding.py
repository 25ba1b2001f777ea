"""The instruments that feed the motor or turn its shaft, by the run's journal."""

from collections.abc import Collection

from bench.journal.events.instruments import DeEnergised, Energising
from bench.journal.events.safety import MadeSafe
from drivers.interfaces import Role
from drivers.interfaces.role import ROLES
from procedures.core.events import Event

#: What may drive the shaft faster than a hand does.
_TURNING = frozenset({Role.DYNAMOMETER, *(role for role, spec in ROLES.items() if spec.feeds_winding)} - {Role.SUPPLY})
_WATCHED = {role.value: role for role in (*_TURNING, Role.SUPPLY)}


class FeedingRoles:
    """Listens to the journal; an instrument counts as on until it is switched off or made safe."""

    def __init__(self) -> None:
        self._on: set[Role] = set()
        self.turned = False

    @property
    def roles(self) -> Collection[Role]:
        """The roles that feed the motor or drive its shaft now."""
        return frozenset(self._on)

    def stands(self) -> None:
        """Count the shaft as at rest."""
        self.turned = False

    def hear(self, event: Event) -> None:
        """Take an event of the journal."""
        match event:
            case Energising() if (role := _WATCHED.get(event.instrument)) is not None:
                self._on.add(role)
                self.turned = self.turned or role in _TURNING
            case DeEnergised() if (role := _WATCHED.get(event.instrument)) is not None and event.error is None:
                self._on.discard(role)
            case MadeSafe() if (role := _WATCHED.get(event.instrument)) is not None and event.outcome == "safe":
                self._on.discard(role)
