"""Verifies that the guardian's record is unchanged: by hashes in the run's journal, by its own chain, and by its closing event."""

import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from bench.journal.chain import first_fault
from bench.journal.codec import RecordedEvent
from bench.journal.events.run import RunBegun, RunFinished
from bench.journal.events.safety import UNTOLD, GuardianEnd, GuardianLeft, GuardianReady, GuardianStarted
from bench.journal.guardian_record import FILE, sealed
from bench.journal.journal_file import JournalLine, read_lines
from bench.journal.verification import RecordFault, Verification
from bench.station.station_file import VIRTUAL
from drivers.catalogue import MANUAL
from drivers.interfaces.text import text

_JOURNAL = "journal.jsonl"


@dataclass(frozen=True)
class _Anchor:
    """Reference of a journal's event to the guardian's record: its event `line` has this hash. `closed`: it ends there."""

    event: int
    line: int
    sha256: str
    closed: bool


@dataclass
class _Session:
    """A beginning or resumption of the run: whether its journal tells of guardians at all, and of this one."""

    event: int
    tells: bool
    may_have_had: bool
    token: str | None
    anchors: list[_Anchor] = field(default_factory=list)


def check_guardian(folder: Path, events: Sequence[RecordedEvent], hashes: Sequence[str], found: Verification) -> None:
    """Add to `found` the faults of the guardian's record, and what cannot be verified.

    `events` and `hashes` are the journal's, which is whole.
    """
    sessions = list(_sessions(events))
    path = folder / FILE
    if not path.exists():
        _missing(sessions, found)
        return
    lines, rest = _read(path)
    if fault := first_fault(lines, {}):
        found.findings.append(RecordFault(FILE, fault.line, fault.what))
        return
    anchors = [anchor for session in sessions for anchor in session.anchors]
    sealed = [line for line in lines if _is_sealed(line)]
    broken = next(filter(None, (_against_anchor(anchor, lines) for anchor in anchors)), None)
    broken = broken or next(filter(None, (_against_seal(line, hashes) for line in sealed)), None)
    if broken:
        found.findings.append(broken)
        return
    covered = max((anchor.line for anchor in anchors), default=0)
    told = {anchor.line for anchor in anchors if anchor.closed}
    closed = told | {line.place for line in sealed}
    _check_end(lines, rest, closed, told, found)
    _check_blocks(lines, sessions, covered, closed, told, found)


def check_chain(folder: Path, found: Verification) -> None:
    """Add to `found` what is wrong in the chain alone, where the journal cannot be asked."""
    path = folder / FILE
    if path.exists() and (fault := first_fault(_read(path)[0], {})):
        found.findings.append(RecordFault(FILE, fault.line, fault.what))


def _sessions(events: Sequence[RecordedEvent]) -> Iterator[_Session]:
    session: _Session | None = None
    for recorded in events:
        event = recorded.event
        if isinstance(event, RunBegun):
            if session is not None:
                yield session
            tells = event.guardian != UNTOLD
            token = event.guardian.token if event.guardian is not None and tells else None
            session = _Session(recorded.number, tells, _may_have_had(event), token)
        elif session is not None and (anchor := _anchor(recorded)) is not None:
            session.anchors.append(anchor)
    if session is not None:
        yield session


def _may_have_had(begun: RunBegun) -> bool:
    """Tell whether a run of a version that did not say so may have had a guardian."""
    if begun.station.source == VIRTUAL:
        return False
    return any(entry.driver != MANUAL for entry in begun.station.instruments.values())


def _anchor(recorded: RecordedEvent) -> _Anchor | None:
    match recorded.event:
        case GuardianReady(record=record):
            closed = False
        case RunFinished(guardian=GuardianEnd(record=record, closed=closed)):
            pass
        case _:
            return None
    return _Anchor(recorded.number, record.events, record.sha256, closed) if record.events > 0 else None


def _missing(sessions: Sequence[_Session], found: Verification) -> None:
    for session in sessions:
        if session.anchors:
            anchor = session.anchors[-1]
            what = text(
                "is missing; event {event} of the journal holds the hash of its event {line}",
                event=anchor.event,
                line=anchor.line,
            )
            found.findings.append(RecordFault(FILE, 0, what))
            return
    for session in sessions:
        if session.token is not None:
            found.doubt(
                text(
                    "{file} is missing, although event {event} of the journal says that a guardian was started; "
                    "the journal holds no hash of it yet",
                    file=FILE,
                    event=session.event,
                )
            )
        elif not session.tells and session.may_have_had:
            found.doubt(
                text(
                    "the run was made by a version that stored no hash of {file} in the journal: whether the file "
                    "existed cannot be verified",
                    file=FILE,
                )
            )
            return


def _read(path: Path) -> tuple[list[JournalLine], bytes]:
    """Return the whole lines, and what follows them: zeros are room that was not used."""
    lines = list(read_lines(path))
    if not lines or not lines[-1].torn:
        return lines, b""
    length = lines.pop().length
    with path.open("rb") as file:
        file.seek(-length, 2)
        return lines, file.read()


def _against_anchor(anchor: _Anchor, lines: Sequence[JournalLine]) -> RecordFault | None:
    """Return what differs from what the journal says of the record."""
    if anchor.line > len(lines):
        what = text(
            "is missing: event {event} of the journal holds its hash, so the record's end was changed or removed",
            event=anchor.event,
        )
        return RecordFault(FILE, len(lines) + 1, what)
    if lines[anchor.line - 1].sha256 != anchor.sha256:
        what = text(
            "was changed, or the whole record is another run's: event {event} of the journal holds the hash {hash}… of it",
            event=anchor.event,
            hash=anchor.sha256[:12],
        )
        return RecordFault(FILE, anchor.line, what)
    return None


def _is_sealed(line: JournalLine) -> bool:
    # One that cannot be read is one that does not hold its own digest.
    return line.event is not None and line.event.kind == GuardianLeft.kind and "journal" in line.event.data


def _against_seal(line: JournalLine, hashes: Sequence[str]) -> RecordFault | None:
    """Return what differs from what a closing event says of itself and of the journal."""
    event = line.event.event if line.event is not None else None
    if (
        line.event is None
        or not isinstance(event, GuardianLeft)
        or hashlib.sha256(sealed(line.event, event, line.previous)).hexdigest() != line.sha256
    ):
        return RecordFault(FILE, line.place, text("was changed: it does not hold the digest of its own content"))
    end, number = event.journal, line.event.number
    if end is None or end.events < 1:
        return None
    if end.events > len(hashes):
        what = text(
            "is missing: event {number} of {file} holds the hash of event {event}, so the journal's end was removed",
            number=number,
            file=FILE,
            event=end.events,
        )
        return RecordFault(_JOURNAL, len(hashes) + 1, what)
    if hashes[end.events - 1] != end.sha256:
        what = text(
            "was changed, or {file} was, whose event {number} holds the hash {hash}… of it",
            file=FILE,
            number=number,
            hash=end.sha256[:12],
        )
        return RecordFault(_JOURNAL, end.events, what)
    return None


def _check_end(
    lines: Sequence[JournalLine], rest: bytes, closed: set[int], told: set[int], found: Verification
) -> None:
    """Look at what follows the last line; the run was `told` where the record ends after its room had been given back."""
    if not rest:
        return
    torn = rest.rstrip(b"\0")
    if len(lines) in told or (torn and len(lines) in closed):
        what = text("was inserted: {count} bytes follow the event that closed the record", count=len(rest))
        found.findings.append(RecordFault(FILE, len(lines) + 1, what))
    elif torn:
        found.doubt(text("{count} bytes at the end of {file} are not a complete event", count=len(torn), file=FILE))
    elif len(lines) in closed:
        found.doubt(
            text(
                "the space reserved at the end of {file} was not released: its guardian was terminated while it ended",
                file=FILE,
            )
        )


def _check_blocks(
    lines: Sequence[JournalLine],
    sessions: Sequence[_Session],
    covered: int,
    closed: set[int],
    told: set[int],
    found: Verification,
) -> None:
    """Look at what each guardian wrote: whether the journal knows it, and whether it ends where that guardian ended it."""
    known = {session.token for session in sessions if session.token is not None}
    old = any(not session.tells for session in sessions)
    seen = set[str]()
    for begin, end in _blocks(lines):
        first = lines[begin].event
        token = first.event.token if first is not None and isinstance(first.event, GuardianStarted) else ""
        seen.add(token)
        after = [place for place in closed if begin < place < end]
        if after:
            what = text("was inserted: event {event} closed the record of that guardian", event=min(after))
            found.findings.append(RecordFault(FILE, min(after) + 1, what))
        elif end < covered or end in told:
            continue
        elif token and token not in known:
            found.doubt(
                text(
                    "{file}, from line {line}: the journal has no session for this guardian; that session was cut "
                    "off before its first event, or the lines were inserted",
                    file=FILE,
                    line=begin + 1,
                )
            )
        elif not token and old:
            found.doubt(
                text(
                    "the run was made by a version that stored no hash of {file} in the journal: its lines follow "
                    "from each other, but whether it is complete cannot be verified",
                    file=FILE,
                )
            )
        elif not token:
            found.findings.append(
                RecordFault(FILE, begin + 1, text("was inserted: no guardian of this run begins there"))
            )
        elif end not in closed:
            found.doubt(
                text(
                    "{file} is not closed after its line {line}: the guardian is still running, was terminated "
                    "itself, or the record's end was removed",
                    file=FILE,
                    line=end,
                )
            )
    for session in sessions:
        if session.token and session.token not in seen and not session.anchors:
            found.doubt(
                text(
                    "{file} holds nothing of the guardian that was started with event {event} of the journal",
                    file=FILE,
                    event=session.event,
                )
            )


def _blocks(lines: Sequence[JournalLine]) -> Iterator[tuple[int, int]]:
    """Give from which index to before which one each guardian's events stand."""
    starts = [index for index, line in enumerate(lines) if line.event and isinstance(line.event.event, GuardianStarted)]
    starts = starts if starts[:1] == [0] else [0, *starts]
    for begin, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        if begin < end:
            yield begin, end
