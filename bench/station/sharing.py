"""Instruments that several sockets of a line use in turn."""

from collections.abc import Collection
from typing import Protocol

from procedures.core.bench import Role


class Sharing(Protocol):
    """A run's access to shared instruments; a procedure reserves all that it needs, or waits."""

    @property
    def roles(self) -> frozenset[Role]:
        """The roles whose instrument others use too."""

    def acquire(self, roles: Collection[Role], purpose: str) -> float:
        """Acquire instruments for `purpose` and return the time (s) waited.

        Raises InstrumentError naming who has one where it takes too long.
        """

    def release(self) -> None:
        """Give back what there is to give back."""


class NotShared:
    """Nobody else uses this station."""

    roles: frozenset[Role] = frozenset()

    def acquire(self, roles: Collection[Role], purpose: str) -> float:
        """Return at once: no other run uses the instruments."""
        return 0.0

    def release(self) -> None:
        """Pass."""
