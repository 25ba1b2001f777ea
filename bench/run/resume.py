"""Checks that a run can be continued: same motor, station with its calibrations, instruments, software."""

import json
import tomllib
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from bench.i18n.errors import FileError, InputError, UsageError
from bench.journal.codec import RecordedEvent
from bench.journal.events.instruments import InstrumentOpened
from bench.journal.events.run import RunBegun, RunFinished, RunStarted
from bench.journal.events.safety import MadeSafe
from bench.journal.journal_file import JournalFile, read_journal
from bench.journal.run_folder import RunFolder
from bench.motor.motor_file import MotorFile
from bench.run.plan import Planned
from bench.station.station_file import Station
from drivers.interfaces import Identity, Instrument
from drivers.interfaces.text import Text, lines, text
from procedures.core.bench import Role

_FILES = {"motor": text("motor"), "station": text("station")}
#: Changes that a message tells.
_TOLD = 5
_NOT_TOGETHER = text("otherwise the figures from before and after would not belong together")


def begun(folder: RunFolder) -> tuple[JournalFile, RunStarted]:
    """Return a run's journal and what its first event tells. Raises InputError where it has no beginning."""
    read = read_journal(folder.journal)
    first = read.events[0].event if read.events else None
    if not isinstance(first, RunStarted):
        raise FileError(
            text(
                "{journal}: the first event is missing, so the run cannot be continued; start a new run",
                journal=folder.journal,
            )
        )
    return read, first


def check_resumable(folder: RunFolder | None, plan: Sequence[Planned]) -> None:
    """Raise UsageError for a run that is to go on and whose commands nobody can take up where they ended."""
    if folder is not None and (manual := next((each.name for each in plan if each.procedure.manual), None)):
        raise UsageError(
            text(
                "{folder}: a run of {name} cannot be continued; begin a new one",
                folder=folder.path,
                name=manual,
            )
        )


def check_unchanged(
    folder: RunFolder, began: RunStarted, motor: MotorFile, station: Station, software: Mapping[str, str]
) -> None:
    """Raise InputError naming what has changed since the run began; a comment in a file may."""
    files = (
        ("motor", began.motor, began.motor_file, motor.source, motor.content, motor.sha256),
        ("station", began.station, began.station_file, station.source, station.content, station.sha256),
    )
    for what, then, before, source, content, sha256 in files:
        if then.sha256 == sha256:
            continue
        changed = _changes(before, content) if before else None
        if changed is None or changed:
            raise FileError(
                text(
                    "{path}: the {what} file {source} is not the one this run began with ({then}): "
                    "{changes}. {remedy}; {not_together}",
                    path=folder.path,
                    what=_FILES[what],
                    source=source,
                    then=then.source,
                    changes=_few(changed or [text("its content")]),
                    remedy=_station_remedy(station, changed) if what == "station" else _RESTORE,
                    not_together=_NOT_TOGETHER,
                )
            )
    known = began.software
    changed = [
        _change(
            name,
            _short(known[name]) if name in known else text("not recorded"),
            _short(software[name]) if name in software else text("gone"),
        )
        for name in dict.fromkeys((*known, *software))
        if known.get(name) != software.get(name)
    ]
    if changed:
        raise FileError(
            text(
                "{path}: the software is not the one this run began with: {changes}. Install those versions again "
                "(requirements.lock names them), or start a new run; {not_together}",
                path=folder.path,
                changes=_few(changed),
                not_together=_NOT_TOGETHER,
            )
        )


def check_identities(folder: RunFolder, events: Iterable[RecordedEvent], opened: Mapping[Role, Instrument]) -> None:
    """Raise InputError where another instrument answers than the one that a role had before."""
    before = identities(events)
    for role, instrument in opened.items():
        then, now = before.get(role.value), instrument.identity
        if then is not None and _who(then) != _who(now):
            raise InputError(
                text(
                    "{path}: another instrument answers as {role} than before: it was {former} and is {present}. "
                    "Connect the former again, or start a new run; {not_together}",
                    path=folder.path,
                    role=role.value,
                    former=_who(then),
                    present=_who(now),
                    not_together=_NOT_TOGETHER,
                )
            )


def identities(events: Iterable[RecordedEvent]) -> dict[str, Identity]:
    """Return who answered last in each role that was opened."""
    opened = (recorded.event for recorded in events)
    return {event.instrument: event.identity for event in opened if isinstance(event, InstrumentOpened)}


def left_unsafe(events: Iterable[RecordedEvent]) -> bool:
    """Return whether a run's last session may have left an output on: it has no end, or part of its shutdown failed."""
    ended = failed = False
    for recorded in events:
        match recorded.event:
            case RunBegun():
                ended = failed = False
            case MadeSafe(outcome="failed"):
                failed = True
            case RunFinished():
                ended = True
    return failed or not ended


_RESTORE = text("Restore it, or start a new run")


def _station_remedy(station: Station, changed: Sequence[Text] | None) -> Text:
    if station.control and changed:
        keys = [str(change.values["name"]) for change in changed]
        if all(key.endswith(("control", "address")) for key in keys):
            return text("A bench that was started again has other ports and another state")
    return _RESTORE


def _changes(before: str, after: str) -> list[Text] | None:
    """Return the keys that differ between two files; None where that cannot be told."""
    then, now = _parsed(before), _parsed(after)
    if then is None or now is None:
        return None
    flat_then, flat_now = dict(_flat(then)), dict(_flat(now))
    return [
        _change(key, _shown(flat_then, key), _shown(flat_now, key))
        for key in dict.fromkeys((*flat_then, *flat_now))
        if flat_then.get(key, ...) != flat_now.get(key, ...)
    ]


def _change(name: str, then: Text | str, now: Text | str) -> Text:
    return text("{name} was {then} and is {now}", name=name, then=then, now=now)


def _parsed(content: str) -> Mapping[str, Any] | None:
    for parse in (tomllib.loads, json.loads):
        try:
            found: Any = parse(content)
        except (ValueError, RecursionError):
            continue
        return found if isinstance(found, dict) else None
    return None


def _flat(table: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, object]]:
    for key, value in table.items():
        if isinstance(value, dict) and value:
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value


def _shown(table: Mapping[str, object], key: str) -> Text | str:
    return str(table[key])[:60] if key in table else text("not there")


def _few(changes: Sequence[Text]) -> Text:
    more = len(changes) - _TOLD
    result = [*changes[:_TOLD], *([text("and {number} more", number=more)] if more > 0 else [])]
    return lines(result, between="; ")


def _short(value: object) -> str:
    message = str(value)
    return f"{message[:12]}…" if len(message) > 40 else message


def _who(identity: Identity) -> Text | str:
    parts = (identity.manufacturer, identity.model, identity.serial_number, identity.firmware)
    return " ".join(part for part in parts if part) or text("unknown")
