"""Whether the guardian's record is as it was written: held by the run's journal, by its own chain, and closed by itself."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from bench.journal.chain import first_fault
from bench.journal.encoding import dumps, to_bytes
from bench.journal.guardian_record import FILE, sealed_entry
from bench.journal.journal_file import Event, Line, parse_line, read_lines
from bench.journal.verification import Finding, Verification
from bench.station.station_file import VIRTUAL
from drivers.catalogue import MANUAL

_JOURNAL = "journal.jsonl"


@dataclass(frozen=True)
class _Anchor:
    """What an event of the journal says of the guardian's record: its event `line` has this hash. `closed`: it ends there."""

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


def check_guardian(folder: Path, events: Sequence[Event], hashes: Sequence[str], found: Verification) -> None:
    """Add to `found` what is wrong with the guardian's record, and what of it cannot be proved.

    `events` and `hashes` are the journal's, which is whole.
    """
    sessions = list(_sessions(events))
    path = folder / FILE
    if not path.exists():
        _missing(sessions, found)
        return
    lines, rest = _read(path)
    if fault := first_fault(lines, {}):
        found.findings.append(Finding(FILE, fault.line, fault.what))
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
        found.findings.append(Finding(FILE, fault.line, fault.what))


def _sessions(events: Sequence[Event]) -> Iterator[_Session]:
    session: _Session | None = None
    for event in events:
        if event.kind in ("run_started", "run_resumed"):
            if session is not None:
                yield session
            told = event.data.get("guardian")
            token = str(told.get("token", "")) if isinstance(told, Mapping) else None
            session = _Session(event.number, "guardian" in event.data, _may_have_had(event.data), token)
        elif session is not None and event.kind in ("guardian_ready", "run_finished"):
            session.anchors += _anchors(event)
    if session is not None:
        yield session


def _may_have_had(about: Mapping[str, Any]) -> bool:
    """Tell whether a run of a version that did not say so may have had a guardian."""
    station = about.get("station")
    if not isinstance(station, Mapping) or station.get("source") == VIRTUAL:
        return False
    instruments = station.get("instruments")
    entries = instruments.values() if isinstance(instruments, Mapping) else ()
    return any(isinstance(entry, Mapping) and entry.get("driver") != MANUAL for entry in entries)


def _anchors(event: Event) -> Iterator[_Anchor]:
    told = event.data if event.kind == "guardian_ready" else event.data.get("guardian")
    record = told.get("record") if isinstance(told, Mapping) else None
    if not isinstance(told, Mapping) or not isinstance(record, Mapping):
        return
    line, sha256 = record.get("events"), record.get("sha256")
    if isinstance(line, int) and isinstance(sha256, str) and line > 0:
        yield _Anchor(event.number, line, sha256, told.get("closed") is True)


def _missing(sessions: Sequence[_Session], found: Verification) -> None:
    for session in sessions:
        if session.anchors:
            anchor = session.anchors[-1]
            what = f"is missing; event {anchor.event} of the journal holds the hash of its event {anchor.line}"
            found.findings.append(Finding(FILE, 0, what))
            return
    for session in sessions:
        if session.token is not None:
            found.doubt(
                f"{FILE} is missing, although event {session.event} of the journal says that a guardian was started; "
                "the journal holds no hash of it yet"
            )
        elif not session.tells and session.may_have_had:
            found.doubt(
                f"the run was made by a version that did not tie {FILE} to the journal: whether there was one cannot be proved"
            )
            return


def _read(path: Path) -> tuple[list[Line], bytes]:
    """Return the whole lines, and what follows them: zeros are room that was not used."""
    lines = list(read_lines(path))
    if not lines or not lines[-1].torn:
        return lines, b""
    length = lines.pop().length
    with path.open("rb") as file:
        file.seek(-length, 2)
        return lines, file.read()


def _against_anchor(anchor: _Anchor, lines: Sequence[Line]) -> Finding | None:
    """Return what differs from what the journal says of the record."""
    if anchor.line > len(lines):
        what = f"is missing: event {anchor.event} of the journal holds its hash, so the record's end was changed or removed"
        return Finding(FILE, len(lines) + 1, what)
    if lines[anchor.line - 1].sha256 != anchor.sha256:
        what = (
            f"was changed, or the whole record is another run's: event {anchor.event} of the journal holds the hash "
            f"{anchor.sha256[:12]}… of it"
        )
        return Finding(FILE, anchor.line, what)
    return None


def _is_sealed(line: Line) -> bool:
    return line.event is not None and line.event.kind == "left" and "journal" in line.event.data


def _against_seal(line: Line, hashes: Sequence[str]) -> Finding | None:
    """Return what differs from what a closing event says of itself and of the journal."""
    event = line.event
    if event is None:
        return None
    entry = {
        "n": event.number,
        "wall": event.wall,
        "time": event.time,
        "kind": event.kind,
        "data": dict(event.data),
        "previous": line.previous,
    }
    if parse_line(line.place, to_bytes(dumps(sealed_entry(entry))) + b"\n").sha256 != line.sha256:
        return Finding(FILE, line.place, "was changed: it does not hold the digest of its own content")
    head = event.data["journal"]
    number, sha256 = (head.get("events"), head.get("sha256")) if isinstance(head, Mapping) else (0, "")
    if not isinstance(number, int) or number < 1:
        return None
    if number > len(hashes):
        what = f"is missing: event {event.number} of {FILE} holds the hash of event {number}, so the journal's end was removed"
        return Finding(_JOURNAL, len(hashes) + 1, what)
    if hashes[number - 1] != sha256:
        what = f"was changed, or {FILE} was, whose event {event.number} holds the hash {str(sha256)[:12]}… of it"
        return Finding(_JOURNAL, number, what)
    return None


def _check_end(lines: Sequence[Line], rest: bytes, closed: set[int], told: set[int], found: Verification) -> None:
    """Look at what follows the last line; the run was `told` where the record ends after its room had been given back."""
    if not rest:
        return
    torn = rest.rstrip(b"\0")
    if len(lines) in told or (torn and len(lines) in closed):
        what = f"was put in: {len(rest)} bytes follow the event that closed the record"
        found.findings.append(Finding(FILE, len(lines) + 1, what))
    elif torn:
        found.doubt(f"{len(torn)} bytes at the end of {FILE} are no whole event")
    elif len(lines) in closed:
        found.doubt(f"the room at the end of {FILE} was not given back: its guardian was ended as it left")


def _check_blocks(
    lines: Sequence[Line],
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
        token = str(first.data.get("token", "")) if first is not None and first.kind == "started" else ""
        seen.add(token)
        after = [place for place in closed if begin < place < end]
        if after:
            what = f"was put in: event {min(after)} closed the record of that guardian"
            found.findings.append(Finding(FILE, min(after) + 1, what))
        elif end < covered or end in told:
            continue
        elif token and token not in known:
            found.doubt(
                f"{FILE}, from line {begin + 1}: the journal has no session for this guardian; that session was cut off before "
                "its first event, or the lines were put in"
            )
        elif not token and old:
            found.doubt(
                f"the run was made by a version that did not tie {FILE} to the journal: what it holds follows from line to "
                "line, whether it is all cannot be proved"
            )
        elif not token:
            found.findings.append(Finding(FILE, begin + 1, "was put in: no guardian of this run begins there"))
        elif end not in closed:
            found.doubt(
                f"{FILE} is not closed after its line {end}: the guardian still goes on, was ended itself, or the record's end was "
                "taken away"
            )
    for session in sessions:
        if session.token and session.token not in seen and not session.anchors:
            found.doubt(
                f"{FILE} holds nothing of the guardian that was started with event {session.event} of the journal"
            )


def _blocks(lines: Sequence[Line]) -> Iterator[tuple[int, int]]:
    """Give from which index to before which one each guardian's events stand."""
    starts = [index for index, line in enumerate(lines) if line.event is not None and line.event.kind == "started"]
    starts = starts if starts[:1] == [0] else [0, *starts]
    for begin, end in zip(starts, [*starts[1:], len(lines)], strict=True):
        if begin < end:
            yield begin, end
