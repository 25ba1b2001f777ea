"""The run's record: one file that only grows, one event a line, each chained to the line before."""

import hashlib
import json
import os
import threading
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.errors import InputError
from bench.record.encoding import dumps, to_bytes

#: Events that must have reached the disk, not only the operating system, before what follows them happens.
DURABLE = frozenset(
    {
        "run_started",
        "run_resumed",
        "run_finished",
        "procedure_finished",
        "procedure_failed",
        "step_finished",
        "step_failed",
        "energising",
    }
)

Listener = Callable[[str, Mapping[str, Any]], None]


@dataclass(frozen=True)
class Event:
    """One line of a journal: `number` from 1, `wall` time (ISO 8601, UTC), bench `time` (s), `kind`, `data`."""

    number: int
    wall: str
    time: float
    kind: str
    data: Mapping[str, Any] = field(default_factory=dict)


class Journal:
    """Appends events to `journal.jsonl`; the line of an event is with the operating system when `event` returns.

    `now` gives the bench time (s). Kinds in `durable` are forced to the disk as well. Listeners hear every event
    after it is written; whatever they raise reaches the caller.
    """

    def __init__(
        self,
        path: Path,
        now: Callable[[], float],
        *,
        durable: frozenset[str] = DURABLE,
        previous: "JournalFile | None" = None,
    ) -> None:
        self.path = path
        self._now = now
        self._durable = durable
        self._lock = threading.Lock()
        self._listeners: list[Listener] = []
        self._number = len(previous.events) if previous else 0
        self._hash = previous.last_hash if previous else ""
        self._file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        if previous is not None and previous.torn:
            os.ftruncate(self._file, previous.length)

    def listen(self, listener: Listener) -> None:
        """Have `listener(kind, data)` called after each event."""
        self._listeners.append(listener)

    def event(self, kind: str, **data: Any) -> None:
        """Append one event."""
        with self._lock:
            self._number += 1
            line = to_bytes(
                dumps(
                    {
                        "n": self._number,
                        "wall": datetime.now(UTC).isoformat(timespec="microseconds"),
                        "time": self._now(),
                        "kind": kind,
                        "data": data,
                        "previous": self._hash,
                    }
                )
            )
            self._hash = hashlib.sha256(line).hexdigest()
            _write(self._file, line + b"\n")
            if kind in self._durable:
                os.fsync(self._file)
        for listener in self._listeners:
            listener(kind, data)

    def close(self) -> None:
        """Let go of the file; safe to call twice."""
        with self._lock:
            if self._file >= 0:
                os.close(self._file)
                self._file = -1


@dataclass(frozen=True)
class JournalFile:
    """A journal that was read: its whole events, whether the last line was torn, and where and how it ends."""

    events: tuple[Event, ...]
    torn: bool
    length: int
    last_hash: str


def read_journal(path: Path) -> JournalFile:
    """Read a journal; a last line that was cut off in writing is left out and reported as `torn`.

    Raises InputError for a file that is missing, or whose chain of hashes is broken at some line.
    """
    try:
        content = path.read_bytes()
    except OSError as error:
        raise InputError(f"{path}: the journal cannot be read: {error.strerror}") from None
    events: list[Event] = []
    last_hash, length, torn = "", 0, False
    for line in _lines(content):
        number = len(events) + 1
        whole = line.endswith(b"\n")
        event = _event(line)
        if event is None and not whole:
            torn = True
            break
        if event is None:
            raise InputError(f"{path}: line {number} is not an event; the journal was changed after it was written")
        if not whole:
            # Everything but the line's end arrived; a new event must not be glued to it.
            torn = True
            break
        if event[1] != last_hash or event[0].number != number:
            raise InputError(f"{path}: line {number} does not follow from the line before; the journal was changed")
        events.append(event[0])
        last_hash = hashlib.sha256(line[:-1]).hexdigest()
        length += len(line)
    return JournalFile(tuple(events), torn, length, last_hash)


def _lines(content: bytes) -> Iterator[bytes]:
    start = 0
    while start < len(content):
        end = content.find(b"\n", start)
        stop = len(content) if end < 0 else end + 1
        yield content[start:stop]
        start = stop


def _event(line: bytes) -> tuple[Event, str] | None:
    try:
        raw = json.loads(line)
        return Event(raw["n"], raw["wall"], raw["time"], raw["kind"], raw["data"]), raw["previous"]
    except (ValueError, KeyError, TypeError):
        return None


def _write(file: int, line: bytes) -> None:
    view = memoryview(line)
    while view:
        view = view[os.write(file, view) :]
