"""Framing of an instrument on a shared serial line that lets it be set over the line; imports no transport library."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

from drivers.interfaces.text import Text


@dataclass(frozen=True)
class Framing:
    """Rate (bit/s), data bits with parity and stop bits ("8N2"), ASCII frames or RTU, and the number of the unit."""

    rate: int
    form: str
    in_ascii: bool
    unit: int

    @property
    def words(self) -> str:
        """All of it in a few words."""
        return f"{self.rate} bit/s, {self.form} {'ASCII' if self.in_ascii else 'RTU'}, unit {self.unit}"


@dataclass(frozen=True)
class FoundFraming:
    """An instrument found on the line: its description, the framing that it answers `at`, and the one that its parameters have
    `stored`.
    """

    said: Text
    at: Framing
    stored: Framing


class FramingSetter(Protocol):
    """Finds one instrument on a line whatever its framing, and sets that; nothing is open between calls."""

    @property
    def present(self) -> Framing:
        """Options of it in the station file."""

    def wanted(self, rate: int | None, form: str | None, unit: int | None) -> Framing:
        """Return the framing asked for, the station file's where nothing is; raises ReportedError where it cannot be."""

    def find(self, say: Callable[[Text], None]) -> FoundFraming:
        """Look for the instrument by reading alone, first where the station file says; raises CommunicationError where it is nowhere.

        `say` is told before what takes long.
        """

    def refuse(self, found: FoundFraming, wanted: Framing) -> None:
        """Raise ReportedError where it must not be changed now: it puts something out, or another unit answers there."""

    def set(self, found: FoundFraming, wanted: Framing) -> Framing:
        """Set it, verify it, and return the framing that it answers at now; another than wanted acts once its power was off.

        Raises ReportedError where it does not keep what was set, CommunicationError where it is lost, with the way back.
        """

    def partners(self, wanted: Framing) -> tuple[Text, ...]:
        """Say of what shares the line whether it answers with a framing, and what to do where it does not."""

    def entries(self, wanted: Framing) -> dict[str, object]:
        """Return what the station file must say for a framing, by key."""
