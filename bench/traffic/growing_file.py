"""The file of a recording while it is made: a kill loses none of it, and a power cut no more than its last second."""

import os
import threading
from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path
from queue import SimpleQueue
from typing import Any, TextIO

from bench.i18n.errors import FileError
from bench.journal.disk import sync_folder, write_file
from bench.journal.errors import RecordError
from bench.traffic.anonymity import InstrumentSerials, anonymous_tables
from bench.traffic.recorder import made_now
from bench.traffic.traffic_file import SessionRecording, TrafficLine
from drivers.interfaces.text import reason_of, text

#: What was written is on the disk after this time (s) at the latest, as fast as the disk is.
SYNC_INTERVAL = 1.0


class GrowingFile:
    """Writes lines as they come, from its own thread; an exchange with an instrument does not wait for the disk. Another one has what
    was written synced once a second, so that a slow disk holds up no line on its way to the system.

    `tables` are those of the station file, by role; hosts and serial numbers are left out unless the file is to be `identifiable`, the
    latter as far as they are known by then. Raises FileError where the file cannot be written.
    """

    def __init__(self, path: Path, tables: Mapping[str, Mapping[str, Any]], *, identifiable: bool = False) -> None:
        self._path, self._identifiable = path, identifiable
        self._numbers = InstrumentSerials()
        self._lines: SimpleQueue[TrafficLine | None] = SimpleQueue()
        named = tables if identifiable else anonymous_tables(tables)
        try:
            self._file: TextIO = path.open("w", encoding="utf-8", newline="")
            self._file.write(SessionRecording(named, {}, (), made_now()).head(unfinished=True))
            self._file.flush()
            sync_folder(path.parent)
        except OSError as error:
            raise self._unwritten(error) from None
        self._unsynced, self._finished = True, threading.Event()
        self._threads = [
            threading.Thread(target=self._write, name="recording", daemon=True),
            threading.Thread(target=self._sync, name="recording-sync", daemon=True),
        ]
        for thread in self._threads:
            thread.start()

    def take(self, line: TrafficLine) -> None:
        """Queue a line for writing; returns at once."""
        self._lines.put(line)

    def finish(self, recording: SessionRecording) -> None:
        """Write the whole recording to the disk in place of the growing one; again is allowed. Raises FileError if that fails."""
        self._lines.put(None)
        self._finished.set()
        for thread in self._threads:
            thread.join()
        try:
            self._file.close()
            write_file(self._path, recording.text().encode())
        except RecordError as error:
            raise self._unwritten(error.cause) from None
        except OSError as error:
            raise self._unwritten(error) from None

    def _write(self) -> None:
        writes = True
        while (line := self._lines.get()) is not None:
            if not self._identifiable:
                self._numbers.learn(line)
                line = self._numbers.crossed_out(line)
            try:
                if writes:
                    self._file.write(f"{line.row()}\n")
                    self._file.flush()
                    self._unsynced = True
            except OSError:
                # A full disk ends no measurement; what is in memory is written at the end, and what hinders that is said then.
                writes = False

    def _sync(self) -> None:
        while not self._finished.wait(SYNC_INTERVAL):
            if self._unsynced:
                self._unsynced = False
                # As above: what hinders is said at the end.
                with suppress(OSError):
                    os.fsync(self._file.fileno())

    def _unwritten(self, error: OSError) -> FileError:
        return FileError(
            text("{path}: the recording cannot be written: {error}", path=self._path, error=reason_of(error))
        )
