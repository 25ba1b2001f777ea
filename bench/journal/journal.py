"""The run's record: one file that only grows, one event a line, each chained to the line before."""

import hashlib
import os
import threading
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path

from bench.i18n.errors import InputError
from bench.journal.codec import line_of
from bench.journal.disk import Reserve, lock, sync_folder, write_all
from bench.journal.errors import RecordError
from bench.journal.events.run import ClockSetBack, RecordFailed, RunFinished
from bench.journal.journal_file import JournalFile
from bench.journal.wall import WallTime
from drivers.interfaces.text import reason_of, text
from procedures.core.events import Event

#: Takes an event after it was written.
Listener = Callable[[Event], None]


class Journal:
    """Appends events to `journal.jsonl`; the line of an event is with the operating system when `record` returns.

    `now` gives the bench time (s). Durable events are forced to the disk as well, those that join with the event after them,
    without `durable` the run's end alone. Listeners get every event after it is written; whatever they raise reaches the
    caller. `reserve` is given back when the disk is full.
    Raises InputError where the file cannot be written, or another process writes it.
    """

    def __init__(
        self,
        path: Path,
        now: Callable[[], float],
        *,
        durable: bool = True,
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
        #: Whether an event that joins waits for the next one to reach the disk with.
        self._unsynced = False
        self._failure: RecordError | None = None
        try:
            self._file = _opened(path, previous)
        except BaseException:
            self._release()
            raise

    @property
    def failure(self) -> RecordError | None:
        """Error that kept an event from being written, if any."""
        return self._failure

    @property
    def last_hash(self) -> str:
        """The SHA-256 of the last event that was written."""
        return self._end[1]

    def listen(self, listener: Listener) -> None:
        """Call `listener` after each event."""
        self._listeners.append(listener)

    def record(self, event: Event) -> None:
        """Append one event. Raises RecordError where that is not possible, now or before."""
        with self._lock:
            if self._failure is not None and not event.closing:
                raise self._failure
            wall, back = self._wall.read()
            written = [ClockSetBack(seconds=back), event] if back else [event]
            for each in written:
                self._append(each, wall)
        for listener in self._listeners:
            for each in written:
                listener(each)

    def close(self) -> None:
        """Close the file and release the space reserved for its end; safe to call twice."""
        with self._lock:
            if self._file >= 0:
                if self._unsynced:
                    # The end of the run could not be written, which is told already.
                    with suppress(OSError):
                        os.fsync(self._file)
                os.close(self._file)
                self._file = -1
                if self._reserve is not None:
                    self._reserve.end()
                    self._reserve = None

    def _append(self, event: Event, wall: str) -> None:
        try:
            self._write(event, wall)
        except OSError as error:
            if self._failure is not None:
                raise RecordError(self.path, error) from error
            self._failure = RecordError(self.path, error)
            self._release()
            self._record_failure(event, wall)
            if not event.closing:
                raise self._failure from error
            # The room given back is for telling how it ends.
            self._append(event, wall)

    def _record_failure(self, lost: Event, wall: str) -> None:
        try:
            self._write(RecordFailed(lost=lost.kind, error=str(self._failure)), wall)
        except OSError as error:
            raise RecordError(self.path, error) from error

    def _write(self, event: Event, wall: str) -> None:
        self._settle()
        number, previous, length = self._end
        line = line_of(number + 1, wall, self._now(), event, previous)
        digest = hashlib.sha256(line).hexdigest()
        self._pending = line + b"\n"
        try:
            write_all(self._file, self._pending)
            due = event.durable and (self._durable or isinstance(event, RunFinished))
            if self._unsynced or (due and not event.joins):
                os.fsync(self._file)
            self._unsynced = due and event.joins
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
                strerror=reason_of(error),
            )
        ) from None
    try:
        _lock(file, path)
        _check_length(file, path, previous.length + previous.torn_bytes if previous else 0)
        if previous is not None:
            os.ftruncate(file, previous.length)
        # What is in it is synced with the first event that must be.
        for folder in (path.parent, path.parent.parent):
            sync_folder(folder)
    except OSError as error:
        os.close(file)
        raise InputError(
            text("{path}: the journal cannot be saved to the disk: {strerror}", path=path, strerror=reason_of(error))
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
    if not lock(file):
        raise InputError(text("{path}: another process is writing this run; wait until it ends, or end it", path=path))
