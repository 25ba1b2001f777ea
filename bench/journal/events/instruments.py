"""Events of instruments: opened, set, read, energised."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from drivers.interfaces import Identity, Watchdog
from procedures.core.events import Event, optional


class InstrumentOpened(Event, kind="instrument_opened"):
    """The instrument of a role was opened: who answers there, and its watchdog where one is armed."""

    instrument: str
    driver: str
    address: str
    identity: Identity
    watchdog: Watchdog | None = None


class InstrumentFailed(Event, kind="instrument_error", closing=True):
    """A call to an instrument ended in an error; `driver` and `address` stand where it could not be opened."""

    instrument: str
    driver: str | None = optional()
    address: str | None = optional()
    call: str
    arguments: Sequence[Any] = optional(())
    named: Mapping[str, Any] = optional({})
    error: str


class InstrumentCall(Event):
    """A call to the instrument of a role, with its arguments in order and by name."""

    instrument: str
    call: str
    arguments: Sequence[Any] = optional(())
    named: Mapping[str, Any] = optional({})


class Commanding(InstrumentCall, kind="commanding", durable=True):
    """A call is about to energise or move something by itself, or to change the energy in an energised block."""


class SettingDone(InstrumentCall, kind="setting"):
    """A call was done that gives nothing."""


class ReadingTaken(InstrumentCall, kind="reading"):
    """A call was done and gave a value: the reading's fields by name, or the value itself."""

    value: Any


@dataclass(frozen=True)
class WaveformFile:
    """A file of samples: its path from the run's folder, its SHA-256 (empty where it need not be kept) and its length (bytes)."""

    path: str
    sha256: str
    bytes: int = 0


class WaveformsTaken(InstrumentCall, kind="waveforms"):
    """A call was done and gave samples: their file, and by channel where in it, how many, unit, converter step and clipping."""

    file: WaveformFile
    value: Mapping[str, Any]


class Energising(InstrumentCall, kind="energising", durable=True):
    """An energised block is about to be entered."""


class Energised(InstrumentCall, kind="energised"):
    """An energised block was entered."""


class DeEnergising(InstrumentCall, kind="de_energising", closing=True):
    """An energised block is about to be left because of an error."""

    error: str


class DeEnergised(InstrumentCall, kind="de_energised", closing=True):
    """An energised block was left; `error` says why it may be on still, None where it is off."""

    error: str | None = optional()


class TrafficSeen(Event, kind="traffic"):
    """Something went over the wire to or from an instrument."""

    instrument: str
    direction: str
    content: str
