"""Events of the shutdown, of interlocks and watchdog relays, and of a guardian in the run's journal and in its own record."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from procedures.core.events import Event, optional


@dataclass(frozen=True)
class RecordEnd:
    """The end of a journal or a guardian's record: its number of events and the SHA-256 of the last one."""

    events: int
    sha256: str


@dataclass(frozen=True)
class GuardianStart:
    """The guardian of a run: the token in its own record, the systemd manager in whose scope it runs, and why in none."""

    token: str = ""
    scope: str | None = None
    said: str | None = None


@dataclass(frozen=True)
class GuardianEnd:
    """The end of a guardian's record; `closed` is false if the guardian did not report its end."""

    record: RecordEnd
    closed: bool


#: Stands in runs of versions that did not tell of guardians.
UNTOLD = GuardianStart()


@dataclass(frozen=True)
class InterlocksStart:
    """The interlocks that are watched, and the reset of a trip that no record holds yet."""

    names: Sequence[str] = ()
    reset: Mapping[str, Any] | None = None


class ShutdownStarted(Event, kind="way_down_started", closing=True):
    """The shutdown begins, and why; how long (s) after a request to stop the run was interrupted, and this began."""

    cause: str
    interrupted_after: float | None = optional()
    started_after: float | None = optional()


class ItemDone(Event):
    """An item of the shutdown sequence of a role: `safe`, or `failed` and why; and what was measured."""

    instrument: str
    item: str
    outcome: str
    error: str = ""
    value: float | None = optional()
    unit: str | None = optional()


class MadeSafe(ItemDone, kind="made_safe", closing=True):
    """An item of the shutdown sequence was done, or could not be."""


class InterlockOpened(Event, kind="interlock_opened"):
    """An interlock has opened; `not_kept` says why the trip could not be stored, None if it is stored."""

    interlock: str
    how: str
    not_kept: str | None = optional()


class WatchdogRelayPickedUp(Event, kind="watchdog_relay_picked_up"):
    """A watchdog relay has closed its contact; it drops out after `time` (s) without a feed."""

    relay: str
    time: float
    setting: str


class WatchdogRelayDroppedOut(Event, kind="watchdog_relay_dropped_out"):
    """A watchdog relay was told to open its contact, and what went wrong."""

    relay: str
    faults: Sequence[str]


class WatchdogRelayLost(Event, kind="watchdog_relay_lost"):
    """A watchdog relay has dropped out by itself, or does not answer."""

    relay: str
    error: str


class GuardianReady(Event, kind="guardian_ready", durable=True):
    """The guardian watches; how far its own record reaches."""

    record: RecordEnd


class GuardianStarted(Event, kind="started"):
    """A guardian begins its record: its process and the run's, the token that the run's journal holds, the roles it guards."""

    pid: int
    run: int
    token: str = ""
    roles: Sequence[str] = ()


class GuardianConnected(Event, kind="ready"):
    """A guardian is ready: the roles it is connected to, errors by role of those it is not, and how long that took (s)."""

    opened: Sequence[str]
    failed: Mapping[str, str]
    seconds: float


class GuardianTakesOver(Event, kind="took"):
    """A guardian takes the shutdown over, and why."""

    cause: str


class GuardianShutdownDone(Event, kind="walked"):
    """A guardian has done the shutdown: how long it took (s), and what could not be done."""

    seconds: float
    failed: Sequence[str]


class GuardianMeasured(ItemDone, kind="measured"):
    """A guardian measured whether a role is safe."""


class GuardianLeft(Event, kind="left"):
    """A guardian leaves: where the run's journal ended, None where it cannot be read, and the digest of this event itself."""

    journal: RecordEnd | None
    digest: str = optional("")
