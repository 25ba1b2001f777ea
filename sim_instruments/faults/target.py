"""The interface of a bench onto which described faults are brought."""

from typing import Protocol

from sim_instruments.clock.virtual_clock import BenchClock
from sim_instruments.faults.line_faults import Faults
from sim_instruments.transports.connection import Connection
from sim_instruments.world.world import World


class FaultTarget(Protocol):
    """A virtual bench, as its faults see it."""

    world: World
    clock: BenchClock

    @property
    def roles(self) -> tuple[str, ...]:
        """The roles that the bench has."""

    def transport(self, role: str, /) -> str:
        """Return what a role's instrument is reached by. Raises ValueError for an unknown role."""

    def faults(self, role: str, /) -> Faults:
        """Return the faults of a role's line. Raises ValueError for an unknown role."""

    def connection(self, role: str, /) -> Connection:
        """Return the cable of a role's instrument. Raises ValueError for an unknown role."""

    def check_crosspoint(self, crosspoint: str, /) -> None:
        """Raise ValueError for a crosspoint that there is not."""

    def relay_called(self, crosspoint: str, /) -> bool:
        """Tell whether a relay's coil has ever been commanded closed."""

    def stick_relay(self, crosspoint: str, closed: bool | None, /) -> None:
        """Make a relay's contact stick closed or open, or repair it with None."""
