"""The record of a guardian, in a file whose space is reserved at the start, so that a full disk does not stop it."""

import fcntl
import hashlib
import os
import queue
import select
import threading
from contextlib import suppress
from dataclasses import replace
from datetime import UTC, datetime
from pathlib import Path
from time import monotonic

from bench.journal.codec import RecordedEvent, decode, encode
from bench.journal.events.safety import GuardianLeft, RecordEnd
from bench.journal.journal_file import last_whole_line
from procedures.core.events import Event

#: The file in a run's folder.
FILE = "guardian.jsonl"
#: Room (bytes) for some hundred events.
_ROOM = 1 << 16
#: How long (s) the guardian before this one may still be there.
_LEAVING = 8.0
#: How long (s) a guardian that has nothing else to do waits for the disk.
_DISK = 20.0
_STDERR = 2


class GuardianRecord:
    """Appends events to a run's `guardian.jsonl`; one that cannot be written goes to standard error and is passed over.

    A thread of its own writes: a disk that hangs keeps nothing switched on. Lines are those of a journal, each with the hash
    of the one before; `time` is in seconds since this guardian's start.
    """

    def __init__(self, folder: Path) -> None:
        self._lock = threading.Lock()
        self._file = -1
        self._length = self._number = 0
        self._hash = ""
        self._begun = monotonic()
        self._events: queue.SimpleQueue[tuple[str, float, Event] | threading.Event] = queue.SimpleQueue()
        try:
            self._file = os.open(folder / FILE, os.O_RDWR | os.O_CREAT, 0o644)
            _wait_for_lock(self._file)
            # A run that is resumed goes on with the same file.
            content = _whole(os.pread(self._file, 1 << 24, 0))
            self._length, lines = len(content), content.splitlines()
            self._number, self._hash = len(lines), hashlib.sha256(lines[-1]).hexdigest() if lines else ""
            os.ftruncate(self._file, self._length)
            os.posix_fallocate(self._file, self._length, _ROOM)
        except OSError as error:
            complain(f"{folder / FILE} cannot be written: {error}")
            if isinstance(error, BlockingIOError):
                # Another guardian's file stays another guardian's.
                os.close(self._file)
                self._file = -1
        threading.Thread(target=self._write_all, name="guardian's record", daemon=True).start()

    @property
    def head(self) -> RecordEnd:
        """The number and the SHA-256 of the last event on the disk, which is waited for."""
        self._written()
        return RecordEnd(self._number, self._hash)

    def record(self, event: Event) -> None:
        """Append one event, soon and without waiting; one that says that the guardian leaves holds its own digest."""
        with self._lock:
            wall = datetime.now(UTC).isoformat(timespec="microseconds")
            self._events.put((wall, monotonic() - self._begun, event))

    def close(self) -> bool:
        """Release the unused space; tell whether the file now ends with the last event."""
        if not self._written():
            complain("its record is not on the disk, which does not answer")
            return False
        with self._lock:
            if self._file < 0:
                return False
            try:
                os.ftruncate(self._file, self._length)
            except OSError as error:
                complain(f"its record's room cannot be given back: {error}")
                return False
            else:
                return True
            finally:
                os.close(self._file)
                self._file = -1

    def _written(self) -> bool:
        """Wait for the disk; tell whether all that was recorded is on it, but for what it did not take."""
        reached = threading.Event()
        self._events.put(reached)
        return reached.wait(_DISK)

    def _write_all(self) -> None:
        while True:
            recorded = self._events.get()
            if isinstance(recorded, threading.Event):
                recorded.set()
            elif self._file >= 0:
                self._write(*recorded)

    def _write(self, wall: str, time: float, event: Event) -> None:
        recorded = RecordedEvent(self._number + 1, wall, time, event)
        line = sealed(recorded, event, self._hash) if isinstance(event, GuardianLeft) else encode(recorded, self._hash)
        try:
            os.pwrite(self._file, line + b"\n", self._length)
            self._length += len(line) + 1
            self._number, self._hash = self._number + 1, hashlib.sha256(line).hexdigest()
            os.fdatasync(self._file)
        except OSError as error:
            complain(f"an event cannot be written ({error}): {line.decode(errors='replace')}")


def sealed(recorded: RecordedEvent, event: GuardianLeft, previous: str) -> bytes:
    """Return the line of a guardian's last event, with the digest of its content; a digest already in it is ignored."""
    content = encode(replace(recorded, event=replace(event, digest="")), previous)
    return encode(replace(recorded, event=replace(event, digest=hashlib.sha256(content).hexdigest())), previous)


def journal_head(folder: Path, *, durable: bool) -> RecordEnd | None:
    """Return the number and the SHA-256 of the last whole event of the run's journal, None where there is none.

    With `durable` it is on the disk: who wrote it is dead and cannot see to that.
    """
    try:
        # One that was packed is on the disk.
        if durable and (folder / "journal.jsonl").exists():
            file = os.open(folder / "journal.jsonl", os.O_RDONLY)
            try:
                os.fsync(file)
            finally:
                os.close(file)
        line = last_whole_line(folder / "journal.jsonl")
    except OSError as error:
        complain(f"the run's journal cannot be read: {error}")
        return None
    return None if line is None or line.event is None else RecordEnd(line.event.number, line.sha256)


def _wait_for_lock(file: int) -> None:
    """Wait until the guardian of the run that is resumed has left: it may still be in its shutdown.

    Raises OSError where it does not leave.
    """
    begun = monotonic()
    while True:
        try:
            fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if monotonic() - begun > _LEAVING:
                raise
            threading.Event().wait(0.05)
        else:
            return


def complain(words: str) -> None:
    """Report it on standard error, unless that is closed or not read at the moment: nothing waits for it."""
    with suppress(OSError, ValueError):
        _, ready, _ = select.select([], [_STDERR], [], 0.0)
        if ready:
            # What is ready takes so much without waiting.
            os.write(_STDERR, f"motorbench guardian: {words}".encode()[: select.PIPE_BUF - 1] + b"\n")


def read_guardian(folder: Path) -> list[RecordedEvent]:
    """Return the events in a run's folder, oldest first; empty where no guardian was needed."""
    path = folder / FILE
    if not path.exists():
        return []
    return [found[0] for line in _whole(path.read_bytes()).splitlines() if (found := decode(line))]


def _whole(content: bytes) -> bytes:
    """Return the lines that were written to their end; room that was not used is zeros."""
    used = content.rstrip(b"\0")
    return used[: used.rfind(b"\n") + 1]
