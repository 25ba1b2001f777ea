"""Verifies that a run is unchanged: the journal's chain, its end, the waveform files, the result, the guardian's record."""

import hashlib
import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bench.i18n.errors import InputError
from bench.i18n.language import translator
from bench.journal.chain import first_fault
from bench.journal.codec import RecordedEvent
from bench.journal.encoding import plain
from bench.journal.events.instruments import WaveformsTaken
from bench.journal.events.run import ProcedureFailed, RunBegun, RunFinished
from bench.journal.journal_file import JournalFile, JournalLine, read_lines
from bench.journal.removed import removed_files
from bench.journal.run_folder import RunFolder, stored_form
from bench.journal.run_result import result_of
from bench.journal.run_tables import tables_of
from bench.journal.verification import RecordFault, Verification
from bench.journal.verify_guardian import check_chain, check_guardian
from drivers.interfaces.text import Text, Translate, english, reason_of, text

#: Differences between result and journal that a finding names.
_NAMED = 5


@dataclass(frozen=True)
class _End:
    """Reference of a result to the journal it was made from."""

    events: int
    sha256: str
    content: dict[str, Any]


def verify(folder: RunFolder, noted: str = "") -> Verification:
    """Compare the journal with itself, and the waveform files and the result with the journal.

    `noted` is the hash of the last event as it was noted outside the run's folder. Raises InputError for what cannot be read.
    """
    lines = list(read_lines(folder.journal))
    verification = Verification()
    torn = _take_torn(lines)
    end = _stored_end(folder, verification)
    fault = first_fault(lines, {end.events: end.sha256} if end else {})
    whole = lines[: fault.line - 1] if fault else lines
    verification.events, verification.last_hash = len(whole), whole[-1].sha256 if whole else ""
    if fault:
        verification.findings.append(RecordFault(folder.journal.name, fault.line, fault.what))
    elif end is not None and end.events > len(lines):
        what = text(
            "is missing: result.json was made of {events} events, so the journal's end was changed or removed",
            events=end.events,
        )
        verification.findings.append(RecordFault(folder.journal.name, len(lines) + 1, what))
    elif noted and noted.lower() != verification.last_hash:
        what = text(
            "its last event has the hash {hash}, but the hash noted was {noted}",
            hash=verification.last_hash,
            noted=noted,
        )
        verification.findings.append(RecordFault(folder.journal.name, 0, what))
    events = [line.event for line in whole if line.event is not None]
    _check_waveforms(folder, events, verification)
    hashes = [line.sha256 for line in whole]
    if verification.findings:
        check_chain(folder.path, verification)
        return verification
    if why := _unproven(events, end, torn, noted):
        verification.doubt(why)
    check_guardian(folder.path, events, hashes, verification)
    if not verification.findings:
        _check_result(folder, events, end, verification, hashes)
    return verification


def _take_torn(lines: list[JournalLine]) -> int:
    """Take what was cut off in writing from the end; return its length (bytes)."""
    torn = 0
    while lines and (lines[-1].torn or lines[-1].event is None):
        torn += lines.pop().length
    return torn


def _stored_end(folder: RunFolder, found: Verification) -> _End | None:
    try:
        content = json.loads(folder.result.read_bytes())
        end = content["journal"]
        events, sha256 = end["events"], end["sha256"]
        if type(events) is int and isinstance(sha256, str) and events > 0:
            return _End(events, sha256, content)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InputError(
            text("{result}: cannot be read: {strerror}", result=folder.result, strerror=reason_of(error))
        ) from None
    except (ValueError, KeyError, TypeError, RecursionError):
        content = None
    what = text("is not a result as a run writes it, with the journal's last event in it: it was changed")
    found.findings.append(RecordFault(folder.result.name, 0, what))
    return None


def _check_waveforms(folder: RunFolder, events: Sequence[RecordedEvent], found: Verification) -> None:
    removed = removed_files(folder.path)
    for recorded in events:
        # A plan may have said that they need not be kept; those that were are vouched for by the motor's record.
        if not isinstance(recorded.event, WaveformsTaken) or not recorded.event.file.sha256:
            continue
        file = recorded.event.file
        found.waveforms += 1
        path = folder.path / file.path
        if not path.is_file() and removed.get(file.path) == file.sha256:
            found.waveforms -= 1
            found.doubt(text("{file} was removed by a rule of retention", file=file.path))
            continue
        if not path.is_file():
            what = text("is missing; event {number} of the journal refers to it", number=recorded.number)
        elif _sha256(path) != file.sha256:
            what = text("was changed: its hash is not the one in event {number} of the journal", number=recorded.number)
        else:
            continue
        found.findings.append(RecordFault(file.path, 0, what))


def _check_result(
    folder: RunFolder, events: Sequence[RecordedEvent], end: _End | None, found: Verification, hashes: Sequence[str]
) -> None:
    if end is None:
        return
    if end.sha256 != hashes[end.events - 1]:
        what = text("was changed: the hash it holds of event {number} is not that of the journal", number=end.events)
        found.findings.append(RecordFault(folder.result.name, 0, what))
        return
    made_of = JournalFile(tuple(events[: end.events]), 0, 0, end.sha256)
    for made in _results(made_of):
        view = json.loads(json.dumps(plain(made)))
        if not (differing := list(_differences(end.content, view))):
            break
    if differing:
        named, more = differing[:_NAMED], len(differing) - _NAMED
        what = (
            text(
                "was changed: {names} and {more} more differ from the result that follows from the journal",
                names=named,
                more=more,
            )
            if more > 0
            else text("was changed: {names} differ from the result that follows from the journal", names=named)
        )
        found.findings.append(RecordFault(folder.result.name, 0, what))
    elif folder.result.read_bytes() != stored_form(view):
        what = text("was rewritten: its content is the same, but not in the form in which a run writes it")
        found.findings.append(RecordFault(folder.result.name, 0, what))
    else:
        _check_tables(folder, view, found)


def _check_tables(folder: RunFolder, result: Mapping[str, Any], found: Verification) -> None:
    for name, content in tables_of(result):
        path = folder.path / name
        if not path.is_file():
            found.findings.append(RecordFault(name, 0, text("is missing; result.json holds it as a table")))
        elif path.read_bytes() != content:
            found.findings.append(RecordFault(name, 0, text("was changed: it differs from the table in result.json")))


def _unproven(events: Sequence[RecordedEvent], end: _End | None, torn: int, noted: str) -> Text | None:
    if torn:
        return text(
            "{count} bytes at the journal's end are not a complete event: the run was cut off there", count=torn
        )
    if not events or not isinstance(events[-1].event, RunFinished):
        return text("the journal has no end: the run was cut off or still goes on, or its end was taken away")
    if end is None and not noted:
        return text(
            "result.json is missing, so the end of the journal cannot be verified. Of a line's motor the record has the last hash: give "
            "it with --sha256 (journal_sha256 of motorbench eol export)"
        )
    if end is not None and end.events < len(events) and not noted:
        return text(
            "result.json was made of the first {events} events only, so the end of the journal cannot be verified",
            events=end.events,
        )
    return None


def _results(journal: JournalFile) -> Iterator[dict[str, Any]]:
    """Yield the results that follow from a journal: in the words known here, and with causes in those known to the run's plug-ins."""
    made = result_of(journal, _language(journal.events))
    yield made
    for recorded in journal.events:
        match recorded.event:
            case ProcedureFailed(procedure=name, cause=cause) if "cause" in made["procedures"][name]:
                made["procedures"][name]["cause"] = cause
            case RunFinished(cause=cause) if "cause" in made:
                made["cause"] = cause
    yield made


def _language(events: Sequence[RecordedEvent]) -> Translate:
    for event in reversed(events):
        if isinstance(event.event, RunBegun):
            return translator("zh") if event.event.language == "zh" else english
    return english


def _differences(stored: Any, view: Any, where: str = "") -> Iterator[str]:
    if isinstance(stored, dict) and isinstance(view, dict):
        for key in dict.fromkeys((*view, *stored)):
            if key not in stored or key not in view:
                yield f"{where}{key}"
            else:
                yield from _differences(stored[key], view[key], f"{where}{key}.")
    elif isinstance(stored, list) and isinstance(view, list) and len(stored) == len(view):
        for index, (one, other) in enumerate(zip(stored, view, strict=True)):
            yield from _differences(one, other, f"{where}{index}.")
    elif type(stored) is not type(view) or stored != view:
        yield where.rstrip(".")


def _sha256(path: Path) -> str:
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
