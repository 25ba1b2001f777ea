"""A run read from its folder: the result of the journal, the motor's nameplate, and where the record ends."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bench.i18n.errors import FileError
from bench.journal.codec import RecordedEvent
from bench.journal.events.run import RunStarted
from bench.journal.journal_file import read_journal
from bench.journal.run_folder import RunFolder, existing_run_folder
from bench.journal.run_view import RunView, view_of
from bench.motor.motor_file import recorded_motor
from drivers.interfaces.text import text
from procedures.core.nameplate import Nameplate


@dataclass(frozen=True)
class FinishedRun:
    """A run as its journal records it; `last_hash` is that of the journal's last line, `torn` whether a line after it is incomplete."""

    folder: RunFolder
    events: Sequence[RecordedEvent]
    view: RunView
    start: RunStarted
    nameplate: Nameplate
    last_hash: str
    torn: bool

    @property
    def name(self) -> str:
        """The run's own name: that of its folder."""
        return self.folder.path.resolve().name

    @property
    def started(self) -> str:
        """The time at which it began (ISO 8601, UTC)."""
        return self.events[0].wall


def read_run(reference: str, runs: Path) -> FinishedRun:
    """Return a run by its folder, or by its name under `runs`.

    Raises InputError where there is none, its journal was changed, or it does not begin as a run's does.
    """
    folder = existing_run_folder(reference, runs)
    journal = read_journal(folder.journal)
    view = view_of(journal.events)
    if view.start is None:
        raise FileError(text("{journal}: the first event is missing; nothing was recorded", journal=folder.journal))
    motor = recorded_motor(view.start.motor_file, view.start.motor.source)
    # A type's file has no serial number, or another motor's: what was scanned or typed for the run counts.
    number = view.start.motor.serial_number or motor.nameplate.serial_number
    plate = replace(motor.nameplate, serial_number=number)
    return FinishedRun(folder, journal.events, view, view.start, plate, journal.last_hash, journal.torn)
