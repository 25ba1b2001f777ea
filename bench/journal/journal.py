"""The run's record: one file that only grows, one event a line, each chained to the line before."""

import errno
import fcntl
import hashlib
import os
import threading
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from bench.i18n.errors import InputError
from bench.journal.disk import Reserve, sync_folder, write_all
from bench.journal.encoding import dumps, to_bytes
from bench.journal.errors import RecordError
from bench.journal.journal_file import Event, JournalFile, read_journal
from bench.journal.wall import WallTime
from drivers.interfaces.text import text

__all__ = ["CLOSING", "DURABLE", "Event", "Journal", "JournalFile", "read_journal"]

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
        "commanding",
        "record_failed",
        "guardian_ready",
    }
)

#: Events that tell how a run ends: they are still tried when the record could not be written.
CLOSING = frozenset(
    {
        "instrument_error",
        "de_energising",
        "de_energised",
        "way_down_started",
        "step_failed",
        "procedure_failed",
        "made_safe",
        "record_failed",
        "run_finished",
    }
)

_NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)

Listener = Callable[[str, Mapping[str, Any]], None]


class Journal:
    """Appends events to `journal.jsonl`; the line of an event is with the operating system when `event` returns.

    `now` gives the bench time (s). Kinds in `durable` are forced to the disk as well. Listeners hear every event
    after it is written; whatever they raise reaches the caller. `reserve` is given back when the disk is full.
    Raises InputError where the file cannot be written, or another process writes it.
    """

    def __init__(
        self,
        path: Path,
        now: Callable[[], float],
        *,
        durable: frozenset[str] = DURABLE,
        previous: JournalFile | None = None,
        reserve: Reserve | None = None,
        wall: WallTime | None = None,
    ) -> None:
        self.path = path
        self._now = now
        self._durable = durable
        self._reserve = reserve
        self._wall = wall or WallTime(previous.events[-1].wall if previous and previous.events else "")
        self._lock = threading.Lock()
        self._listeners: list[Listener] = []
        #: Number and hash of the last event, and the length of the file up to it.
        self._end = (len(previous.events), previous.last_hash, previous.length) if previous else (0, "", 0)
        #: A line that may or may not stand in the file, where its writing was interrupted.
        self._pending = b""
        self._failure: RecordError | None = None
        try:
            self._file = _opened(path, previous)
        except BaseException:
            self._release()
            raise

    @property
    def failure(self) -> RecordError | None:
        """What kept an event from being written, where something did."""
        return self._failure

    @property
    def last_hash(self) -> str:
        """The SHA-256 of the last event that was written."""
        return self._end[1]

    def listen(self, listener: Listener) -> None:
        """Have `listener(kind, data)` called after each event."""
        self._listeners.append(listener)

    def event(self, kind: str, **data: Any) -> None:
        """Append one event. Raises RecordError where that is not possible, now or before."""
        told: list[tuple[str, Mapping[str, Any]]] = []
        with self._lock:
            if self._failure is not None and kind not in CLOSING:
                raise self._failure
            wall, back = self._wall.read()
            if back:
                self._append("clock_set_back", {"seconds": back}, wall)
                told.append(("clock_set_back", {"seconds": back}))
            self._append(kind, data, wall)
            told.append((kind, data))
        for listener in self._listeners:
            for each in told:
                listener(*each)

    def close(self) -> None:
        """Let go of the file and of the room kept for its end; safe to call twice."""
        with self._lock:
            if self._file >= 0:
                os.close(self._file)
                self._file = -1
                self._release()

    def _append(self, kind: str, data: Mapping[str, Any], wall: str) -> None:
        try:
            self._write(kind, data, wall)
        except OSError as error:
            if self._failure is not None:
                raise RecordError(self.path, error) from error
            self._failure = RecordError(self.path, error)
            self._release()
            self._tell_failure(kind, wall)
            if kind not in CLOSING:
                raise self._failure from error
            # The room given back is for telling how it ends.
            self._append(kind, data, wall)

    def _tell_failure(self, kind: str, wall: str) -> None:
        try:
            self._write("record_failed", {"lost": kind, "error": str(self._failure)}, wall)
        except OSError as error:
            raise RecordError(self.path, error) from error

    def _write(self, kind: str, data: Mapping[str, Any], wall: str) -> None:
        self._settle()
        number, previous, length = self._end
        line = to_bytes(
            dumps(
                {
                    "n": number + 1,
                    "wall": wall,
                    "time": self._now(),
                    "kind": kind,
                    "data": data,
                    "previous": previous,
                }
            )
        )
        digest = hashlib.sha256(line).hexdigest()
        self._pending = line + b"\n"
        try:
            write_all(self._file, self._pending)
            if kind in self._durable:
                os.fsync(self._file)
        except OSError:
            self._take_back()
            raise
        self._end = (number + 1, digest, length + len(self._pending))
        self._pending = b""

    def _settle(self) -> None:
        """Find out what became of a line whose writing an interrupt broke off, and go on behind it."""
        if not self._pending:
            return
        number, _, length = self._end
        if os.fstat(self._file).st_size == length + len(self._pending):
            digest = hashlib.sha256(self._pending[:-1]).hexdigest()
            self._end = (number + 1, digest, length + len(self._pending))
            self._pending = b""
        else:
            self._take_back()

    def _take_back(self) -> None:
        os.ftruncate(self._file, self._end[2])
        self._pending = b""

    def _release(self) -> None:
        if self._reserve is not None:
            self._reserve.release()
            self._reserve = None


def _opened(path: Path, previous: JournalFile | None) -> int:
    try:
        file = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    except OSError as error:
        raise InputError(
            text(
                "{path}: the journal cannot be written: {strerror}. Make the folder writable, or copy the run to one that is",
                path=path,
                strerror=error.strerror,
            )
        ) from None
    try:
        _lock(file, path)
        _check_length(file, path, previous.length + previous.torn_bytes if previous else 0)
        if previous is not None:
            os.ftruncate(file, previous.length)
        os.fsync(file)
        for folder in (path.parent, path.parent.parent):
            sync_folder(folder)
    except OSError as error:
        os.close(file)
        raise InputError(
            text("{path}: the journal cannot be brought to the disk: {strerror}", path=path, strerror=error.strerror)
        ) from None
    except InputError:
        os.close(file)
        raise
    return file


def _check_length(file: int, path: Path, known: int) -> None:
    if os.fstat(file).st_size != known:
        raise InputError(
            text("{path}: the journal holds more than was read of it; another process wrote to it", path=path)
        )


def _lock(file: int, path: Path) -> None:
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        raise InputError(
            text("{path}: another process is writing this run; wait for its end, or end it", path=path)
        ) from None
    except OSError as error:
        # Some network file systems know no locks: the run itself does not need one.
        if error.errno not in _NO_LOCKS:
            raise
