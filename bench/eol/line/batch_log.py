"""A batch's own file: what it is, and which motors were begun, so that a batch that was killed can go on."""

import json
import os
import uuid
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from bench.i18n.errors import InputError
from bench.journal.disk import lock, sync_folder, write_all
from drivers.interfaces.text import Text, reason_of, text

FILE = "batch.jsonl"
#: Where panels reach the line of a batch that goes on: one that they scan for, and one whose serial numbers come from elsewhere.
ANNOUNCEMENTS = ("line.json", "watched-line.json")
#: What must be the same for a batch to go on, and what it is called.
_SAME = {
    "plan": text("the plan"),
    "motor": text("the motor file"),
    "line": text("the station"),
    "seed": text("the seed"),
    "again": Text("--again"),
}


@dataclass(frozen=True)
class BatchMotor:
    """A motor that was begun: its number in the batch and its serial number.

    It is the serial number's test of this number, again by a person where one is named; a `golden` one watches the station.
    `judged_before` tells that an earlier test of it came to a verdict.
    """

    number: int
    serial_number: str
    test_number: int = 1
    again_by: str = ""
    golden: bool = False
    judged_before: bool = False


class BatchLog:
    """Appends to `batch.jsonl` of the batch `name`; `uid` is its own for ever, `last` the highest number begun so far.

    Raises InputError where it cannot be written, another process measures the batch, or it is not the one that was begun.
    """

    def __init__(self, folder: Path, identity: Mapping[str, Any]) -> None:
        self.name, self.path = folder.name, folder / FILE
        try:
            folder.mkdir(parents=True, exist_ok=True)
            resumed = self.path.exists()
            self._file = os.open(self.path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
        except OSError as error:
            raise InputError(
                text(
                    "{folder}: the batch's folder cannot be made: {strerror}; see --runs",
                    folder=folder,
                    strerror=reason_of(error),
                )
            ) from None
        try:
            # Two would give their motors the same numbers, and of two records of one number the database keeps the first.
            _lock(self._file, self.path)
            # What is there now: another process may have begun it meanwhile.
            head = self._head()
            if head:
                self._check(head, identity)
                self._end_torn_line()
            else:
                head = {"batch": uuid.uuid4().hex, **identity}
                self._write(head)
                os.fsync(self._file)
                sync_folder(folder)
        except OSError as error:
            self.close()
            raise InputError(
                text(
                    "{path}: the batch cannot be begun: {strerror}; see --runs",
                    path=self.path,
                    strerror=reason_of(error),
                )
            ) from None
        except InputError:
            self.close()
            raise
        self.uid = str(head["batch"])
        self.resumed = resumed
        self.last = max((motor.number for motor in self.begun()), default=0)

    def begin(self, motor: BatchMotor, socket: str) -> None:
        """Write that a motor is begun. Raises OSError."""
        usual = BatchMotor(motor.number, motor.serial_number)
        own = {key: value for key, value in asdict(motor).items() if value != getattr(usual, key)}
        self._write({"number": motor.number, "serial_number": motor.serial_number, "socket": socket, **own})
        self.last = max(self.last, motor.number)

    def begun(self) -> Iterator[BatchMotor]:
        """Give the motors that were begun, in order; one begun twice stands there twice."""
        with self.path.open("rb") as file:
            for line in file:
                entry = _entry(line)
                number = entry.get("number")
                if isinstance(number, int) and number > 0 and isinstance(entry.get("serial_number"), str):
                    yield BatchMotor(**{name: entry[name] for name in BatchMotor.__dataclass_fields__ if name in entry})

    def identifier(self, number: int) -> str:
        """Return what the record of the batch's motor of this number is identified by, for ever."""
        return record_identifier(self.uid, number)

    def owns(self, number: int, identifier: str) -> bool:
        """Tell whether a record of this number and identifier is of this batch, and not of another one of its name."""
        return owns_record(self.uid, number, identifier)

    def close(self) -> None:
        """Close the file."""
        if self._file >= 0:
            os.close(self._file)
            self._file = -1

    def _head(self) -> dict[str, Any]:
        with self.path.open("rb") as file:
            line = file.readline()
        if not line.endswith(b"\n"):
            # It was cut off before it was anything.
            os.ftruncate(self._file, 0)
            return {}
        head = _entry(line)
        if "batch" not in head:
            raise InputError(
                text("{path}: this is not a batch's file; choose another --batch or --runs", path=self.path)
            )
        return head

    def _end_torn_line(self) -> None:
        """Have what follows begin on a line of its own, whatever was cut off in writing before it."""
        with self.path.open("rb") as file:
            file.seek(-1, os.SEEK_END)
            if file.read(1) != b"\n":
                write_all(self._file, b"\n")

    def _check(self, head: Mapping[str, Any], identity: Mapping[str, Any]) -> None:
        for key, what in _SAME.items():
            if key in identity and head.get(key) != identity[key]:
                raise InputError(
                    text(
                        "{path}: {what} is not the one with which this batch was started; start another batch "
                        "with --batch NAME, or use the earlier one",
                        path=self.path,
                        what=what,
                    )
                )

    def _write(self, entry: Mapping[str, Any]) -> None:
        write_all(self._file, json.dumps(entry, ensure_ascii=False).encode("utf-8", "backslashreplace") + b"\n")


@contextmanager
def held_batch(folder: Path) -> Iterator[None]:
    """Keep everybody from measuring the batch of a folder, if it is one. Raises InputError where it is being measured."""
    path = folder / FILE
    if not path.is_file():
        yield
        return
    try:
        file = os.open(path, os.O_RDONLY)
    except OSError as error:
        raise InputError(text("{folder} cannot be read: {error}", folder=path, error=reason_of(error))) from None
    try:
        _lock(file, path)
        yield
    finally:
        os.close(file)


def is_measured(folder: Path) -> bool:
    """Tell whether another process is measuring the batch of a folder."""
    try:
        with held_batch(folder):
            return False
    except InputError:
        return True


def broken_off(folder: Path) -> bool:
    """Tell whether a batch has no process and did not end itself: it left its announcement to panels behind."""
    return any((folder / name).exists() for name in ANNOUNCEMENTS) and not is_measured(folder)


def batches_broken_off(runs: Path) -> list[str]:
    """Return the names of the batches of a folder that were broken off, the one that was written last first."""
    folders = [log.parent for log in runs.glob(f"*/{FILE}") if broken_off(log.parent)]
    return [folder.name for folder in sorted(folders, key=lambda folder: (folder / FILE).stat().st_mtime, reverse=True)]


def close_batch(folder: Path, person: str) -> None:
    """Note that a batch that was broken off is not to go on, and take back its announcement.

    Raises InputError where it is being measured, or its folder cannot be written.
    """
    with held_batch(folder):
        try:
            file = os.open(folder / FILE, os.O_WRONLY | os.O_APPEND)
            try:
                closed = {"closed": datetime.now(UTC).isoformat(timespec="seconds"), "by": person}
                # On a line of its own, whatever was cut off before it.
                write_all(
                    file, b"\n" + json.dumps(closed, ensure_ascii=False).encode("utf-8", "backslashreplace") + b"\n"
                )
                os.fsync(file)
            finally:
                os.close(file)
            for name in ANNOUNCEMENTS:
                (folder / name).unlink(missing_ok=True)
        except OSError as error:
            raise InputError(
                text("{folder} cannot be written: {error}", folder=folder, error=reason_of(error))
            ) from None


def _lock(file: int, path: Path) -> None:
    if not lock(file):
        raise InputError(
            text("{path}: another process is measuring this batch; wait until it ends, or end it", path=path)
        )


def batch_uid(folder: Path) -> str | None:
    """Return the `uid` of a folder's batch, None where it is none. Raises InputError where that cannot be read."""
    path = folder / FILE
    if not path.is_file():
        return None
    try:
        with path.open("rb") as file:
            return _entry(file.readline()).get("batch")
    except OSError as error:
        raise InputError(text("{folder} cannot be read: {error}", folder=path, error=reason_of(error))) from None


def record_identifier(uid: str, number: int) -> str:
    """Return the identifier of a motor's record, the same for the same motor of the same batch."""
    return str(uuid.uuid5(uuid.UUID(uid), str(number)))


def owns_record(uid: str | None, number: int, identifier: str) -> bool:
    """Tell whether a record is of the batch of a `uid`, and not of another one of its name; without a `uid` of any of that name."""
    return uid is None or identifier == record_identifier(uid, number)


def _entry(line: bytes) -> dict[str, Any]:
    """Return a line's object; one that was cut off in writing, or damaged, holds nothing."""
    try:
        entry = json.loads(line)
    except ValueError:
        return {}
    return entry if isinstance(entry, dict) else {}
