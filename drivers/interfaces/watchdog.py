"""Reaction of an instrument when it no longer receives messages."""

from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, runtime_checkable


class WhenSilent(StrEnum):
    """The action that removes the energy without a computer."""

    VOLTAGE_OFF = "switches its voltage off"
    COAST = "coasts to a stop"
    CONTACT_OPENS = "opens its contact"
    AS_SET_UP = "reacts to a heartbeat error as it is set up to"


@dataclass(frozen=True)
class Watchdog:
    """A watchdog: the `time` (s) of silence after which the instrument acts, how, and by which of its settings."""

    time: float
    action: WhenSilent
    setting: str


@runtime_checkable
class Watching(Protocol):
    """An instrument, or the options of one, that can have a watchdog."""

    @property
    def watchdog(self) -> Watchdog | None:
        """Return the watchdog that is armed, or that the options ask for; None where there is none."""
