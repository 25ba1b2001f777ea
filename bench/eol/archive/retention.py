"""Retention: what of the runs of old motors is removed, by a rule in a file, each removal in a log first."""

import hashlib
import json
import os
import shutil
from collections.abc import Iterator
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta
from itertools import chain
from pathlib import Path
from typing import Any

from pydantic import Field

from bench.eol.archive.run_among import run_among
from bench.eol.line.batch_log import batch_uid, owns_record
from bench.eol.record import MotorRecord
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from bench.files.toml_file import Section, read, validate
from bench.i18n.errors import InputError
from bench.journal.disk import write_all
from bench.journal.removed import note_removed
from drivers.interfaces.text import reason_of, text

#: The log among the runs.
LOG = "retention.jsonl"
#: From one record to the next, and from the last to now, at most so much counts: a long weekend, or what is usual of a line that
#: works seldom. More is a line that stood still, or a clock that was set.
_STANDSTILL = timedelta(days=4)
#: What is usual: three in four of the pauses of a day and more are not longer, and there must be so many of them.
_PAUSE, _USUAL, _PAUSES = timedelta(days=1), 0.75, 4
_WAVEFORMS = "waveforms"


def _days() -> Any:
    return Field(default=None, ge=0.0, le=100_000.0, description="days that it is kept; for ever where nothing is said")


class _Days(Section):
    """For how many days something is kept, by the motor's verdict."""

    passed: float | None = _days()
    failed: float | None = _days()
    error: float | None = _days()
    aborted: float | None = _days()

    def of(self, verdict: Verdict) -> float | None:
        """Return the days of a verdict."""
        by_verdict = {
            Verdict.PASS: self.passed,
            Verdict.FAIL: self.failed,
            Verdict.ERROR: self.error,
            Verdict.ABORTED: self.aborted,
        }
        return by_verdict[verdict]


class RetentionRule(Section):
    """`[waveforms]` and `[runs]`: for how many days they are kept. Records stay, and so does what no rule is about."""

    waveforms: _Days = _Days()
    runs: _Days = _Days()

    @property
    def removes_nothing(self) -> bool:
        """Tell whether it names no days at all."""
        return all(days.of(verdict) is None for days in (self.waveforms, self.runs) for verdict in Verdict.of_motors())


@dataclass(frozen=True)
class Removal:
    """Removal of one motor's run: `runs` for the whole folder, or `waveforms`; its size (bytes), and after how many days.

    It is `held_back` where so many days have passed by this computer's clock alone.
    """

    record: MotorRecord
    folder: Path
    what: str
    size: int
    days: float
    held_back: bool


def load_rule(path: Path) -> RetentionRule:
    """Return the rule of a file. Raises InputError naming file, key and what is allowed."""
    return validate(RetentionRule, read(path, text("retention rule"))[1], str(path))


class _LineTime:
    """The time of a line as its records tell it, in the order in which they were kept: the latest so far, and how long it has worked.

    A record that is earlier than one before it counts as of that time, for the clock may have been behind; one that is later than
    `now` does not count. Of a pause at most a `standstill` counts.
    """

    def __init__(self, now: datetime, standstill: timedelta = timedelta.max) -> None:
        self._now, self._standstill = now, standstill
        self.latest: datetime | None = None
        self.worked = timedelta()

    def reach(self, time: datetime) -> timedelta:
        """Go on to a record's time; return the pause before it."""
        if time > self._now or (self.latest is not None and time <= self.latest):
            return timedelta()
        pause = time - (self.latest or time)
        self.worked += min(pause, self._standstill)
        self.latest = time
        return pause


def longest_pause(records: Records, now: datetime) -> timedelta:
    """Return how much of a pause between two tests counts: four days, or more for a line whose pauses are usually longer.

    One time that the clock was wrong does not change what is usual.
    """
    line = _LineTime(now)
    pauses = sorted(pause for pause in map(line.reach, records.ends()) if pause >= _PAUSE)
    usual = pauses[int(_USUAL * (len(pauses) - 1))] if len(pauses) >= _PAUSES else _STANDSTILL
    return max(_STANDSTILL, usual)


def due(
    records: Records, rule: RetentionRule, runs: Path, now: datetime, *, clock_is_right: bool = False
) -> Iterator[Removal]:
    """Give what the rule has removed now, in the order in which it was kept; only folders among the `runs` are touched.

    What is old by this computer's clock alone is held back unless the `clock_is_right`.
    """
    uids: dict[str, str | None] = {}
    standstill = longest_pause(records, now)
    whole, line = _LineTime(now, standstill), _LineTime(now, standstill)
    for ended in chain(records.ends(), (now,)):
        whole.reach(ended)
    for record in records.read():
        line.reach(record.ended)
        by_clock, age = now - (line.latest or now), whole.worked - line.worked
        folder = run_among(runs, record) if record.run else None
        if folder is None or not folder.is_dir() or not folder.resolve().is_relative_to(runs.resolve()):
            continue
        if record.batch not in uids:
            uids[record.batch] = batch_uid(runs / record.batch)
        # A server has other stations' records, whose batches may have the same name.
        if not owns_record(uids[record.batch], record.number, record.identifier):
            continue
        for what, days in (("runs", rule.runs.of(record.verdict)), (_WAVEFORMS, rule.waveforms.of(record.verdict))):
            place = folder if what == "runs" else folder / _WAVEFORMS
            if days is not None and by_clock >= timedelta(days=days) and place.is_dir():
                held_back = not clock_is_right and age < timedelta(days=days)
                yield Removal(record, folder, what, _size(place), days, held_back)
                if not held_back:
                    break


def remove(removal: Removal, log: Path, person: str) -> None:
    """Log a removal, durably, and do it. Raises InputError where either cannot be done."""
    record, now = removal.record, datetime.now(UTC)
    entry = {
        "time": now.isoformat(timespec="seconds"),
        "person": person,
        "removed": removal.what,
        "days": removal.days,
        "batch": record.batch,
        "number": record.number,
        "serial_number": record.serial_number,
        "verdict": record.verdict.value,
        "run": str(removal.folder),
        "journal_sha256": record.journal_sha256,
        "size": removal.size,
    }
    try:
        _append(log, entry)
        if removal.what == "runs":
            shutil.rmtree(removal.folder)
            return
        place = removal.folder / _WAVEFORMS
        files = {f"{_WAVEFORMS}/{file.name}": _sha256(file) for file in sorted(place.iterdir()) if file.is_file()}
        rule = f"waveforms, {record.verdict.value}, {removal.days:g} days"
        note_removed(removal.folder, files, rule, now.isoformat(timespec="seconds"))
        shutil.rmtree(place)
    except OSError as error:
        raise InputError(
            text(
                "{folder}: the {what} cannot be removed: {error}",
                folder=removal.folder,
                what=removal.what,
                error=reason_of(error),
            )
        ) from None


def _append(log: Path, entry: dict[str, Any]) -> None:
    file = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        write_all(file, json.dumps(entry, ensure_ascii=False).encode("utf-8", "backslashreplace") + b"\n")
        os.fsync(file)
    finally:
        os.close(file)


def _size(folder: Path) -> int:
    return sum(file.stat().st_size for file in folder.rglob("*") if file.is_file())


def _sha256(file: Path) -> str:
    with file.open("rb") as content:
        return hashlib.file_digest(content, "sha256").hexdigest()
