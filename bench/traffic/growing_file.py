"""The file of a recording while it is made: a line is in the system's hands soon after it was said, so that a kill loses none."""

import os
import threading
from collections.abc import Mapping
from pathlib import Path
from queue import SimpleQueue
from typing import Any, TextIO

from bench.i18n.errors import FileError
from bench.traffic.anonymity import InstrumentSerials, anonymous_tables
from bench.traffic.recorder import made_now
from bench.traffic.traffic_file import SessionRecording, TrafficLine
from drivers.interfaces.text import reason_of, text


class GrowingFile:
    """Writes lines as they come, from a thread of its own: nobody who talks to an instrument waits for the disk.

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
        except OSError as error:
            raise self._unwritten(error) from None
        self._thread = threading.Thread(target=self._write, name="recording", daemon=True)
        self._thread.start()

    def take(self, line: TrafficLine) -> None:
        """Have a line written; returns at once."""
        self._lines.put(line)

    def finish(self, recording: SessionRecording) -> None:
        """Write the whole recording in place of what grew; again is allowed. Raises FileError where that cannot be."""
        self._lines.put(None)
        self._thread.join()
        part = self._path.with_name(f".{self._path.name}.{os.getpid()}")
        try:
            self._file.close()
            part.write_text(recording.text(), encoding="utf-8", newline="")
            part.replace(self._path)
        except OSError as error:
            part.unlink(missing_ok=True)
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
            except OSError:
                # A full disk ends no measurement; what is in memory is written at the end, and what hinders that is said then.
                writes = False

    def _unwritten(self, error: OSError) -> FileError:
        return FileError(
            text("{path}: the recording cannot be written: {error}", path=self._path, error=reason_of(error))
        )
