"""Records that no database takes: a file each, durable, until one does."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from bench.eol.record import MotorRecord
from bench.eol.store.faults import StoreError
from bench.eol.store.spooled_form import record_content, record_of_content
from bench.i18n.errors import InputError
from bench.journal.disk import Reserve, sync_folder, write_file
from bench.journal.encoding import dumps, to_bytes
from bench.journal.errors import RecordError
from drivers.interfaces.text import Text, reason_of, text

#: The folder among the runs.
FOLDER = "unstored"
#: Room (bytes) kept for the records of the motors that are measured when the disk fills up.
_ROOM = 256 * 1024


class SpooledFileError(Exception):
    """A file of the spool does not hold a record as it was written."""


class Spool:
    """Keeps records in a folder, whole or not at all; `database` names what they are for.

    Several processes may use one folder: a record's file bears its identifier.
    """

    def __init__(self, folder: Path, database: str) -> None:
        self._folder = folder / hashlib.sha256(database.encode()).hexdigest()[:12]
        self._database = database
        self._reserve: Reserve | None = None

    @property
    def folder(self) -> Path:
        """The folder of the files."""
        return self._folder

    def reserve(self) -> None:
        """Reserve room for some records should the disk fill up. Raises InputError where there is none, or nothing can be written."""
        try:
            self._make()
        except OSError as error:
            raise InputError(
                text(
                    "{folder}: the folder for records that are in no database cannot be created: {strerror}; see "
                    "--runs",
                    folder=self._folder,
                    strerror=reason_of(error),
                )
            ) from None
        self._reserve = Reserve(self._folder / ".reserve", _ROOM)

    def close(self) -> None:
        """Give back the room, and the folder where it holds nothing."""
        self._release()
        for folder in (self._folder, self._folder.parent):
            # Another process, or a record that waits, may still need it.
            with suppress(OSError):
                folder.rmdir()

    def keep(self, record: MotorRecord) -> None:
        """Write a record durably. Raises StoreError."""
        line = to_bytes(dumps({"database": self._database, **record_content(record)}))
        try:
            self._make()
            try:
                write_file(self._file(record.identifier), line)
            except OSError:
                if self._reserve is None:
                    raise
                self._release()
                write_file(self._file(record.identifier), line)
        except OSError as error:
            raise StoreError(
                text("{folder} cannot be written: {error}", folder=self._folder, error=_why(error))
            ) from error

    def names(self) -> list[str]:
        """Return the identifiers of the records that are here, those kept first first. Raises StoreError."""
        try:
            files = [(file.stat().st_mtime_ns, file.stem) for file in self._folder.glob("[!.]*.json")]
        except OSError as error:
            raise StoreError(
                text("{folder} cannot be read: {error}", folder=self._folder, error=_why(error))
            ) from error
        return [name for _, name in sorted(files)]

    def read(self, name: str) -> MotorRecord | None:
        """Return a record, None where it is not here any more. Raises SpooledFileError for a file that was changed."""
        try:
            return record_of_content(json.loads(self._file(name).read_bytes()))
        except FileNotFoundError:
            return None
        except (OSError, ValueError, KeyError, TypeError) as error:
            raise SpooledFileError(str(error)) from error

    def records(self) -> Iterator[MotorRecord]:
        """Give the records that are here; files that hold none are passed over. Raises StoreError."""
        for name in self.names():
            try:
                record = self.read(name)
            except SpooledFileError:
                continue
            if record is not None:
                yield record

    def drop(self, name: str) -> None:
        """Delete a record that a database has. Raises StoreError."""
        try:
            self._file(name).unlink(missing_ok=True)
        except OSError as error:
            raise StoreError(
                text("{file} cannot be removed: {error}", file=self._file(name), error=_why(error))
            ) from error

    def _make(self) -> None:
        if not self._folder.is_dir():
            self._folder.mkdir(parents=True, exist_ok=True)
            for parent in (self._folder.parent, self._folder.parent.parent):
                sync_folder(parent)

    def _release(self) -> None:
        if self._reserve is not None:
            self._reserve.release()
            self._reserve = None

    def _file(self, name: str) -> Path:
        return self._folder / f"{name}.json"


def _why(error: OSError) -> Text:
    cause = error.cause if isinstance(error, RecordError) else error
    return reason_of(cause)
