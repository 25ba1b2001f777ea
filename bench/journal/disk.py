"""Durable files, which are on the disk when the call returns; and space reserved for the end of a run."""

import errno
import fcntl
import os
from pathlib import Path

from bench.i18n.errors import InputError
from bench.journal.errors import NoRoomError, RecordError
from drivers.interfaces.text import reason_of, text

#: Room (bytes) kept for the events of the shutdown and for the result, should the disk fill up.
RESERVE = 512 * 1024
_NO_ROOM = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
_NO_LOCKS = (errno.ENOLCK, errno.EOPNOTSUPP, errno.ENOSYS)


def lock(file: int) -> bool:
    """Lock an open file until its last descriptor is closed; tell whether no other process has it. Raises OSError."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError as error:
        # Some network file systems know no locks: what is written there does not need one.
        if error.errno not in _NO_LOCKS:
            raise
    return True


def write_all(file: int, content: bytes) -> None:
    """Write all of it to an open file."""
    view = memoryview(content)
    while view:
        view = view[os.write(file, view) :]


def write_file(path: Path, content: bytes, *, durable: bool = True) -> None:
    """Write a file completely or not at all; with `durable` it is on the disk when this returns. Raises RecordError."""
    part = path.with_name(f".{path.name}.part")
    try:
        file = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o644)
        try:
            write_all(file, content)
            if durable:
                os.fsync(file)
        finally:
            os.close(file)
        part.replace(path)
        if durable:
            sync_folder(path.parent)
    except OSError as error:
        _remove(part)
        raise RecordError(path, error) from error


def sync_folder(path: Path) -> None:
    """Force a folder's entries to the disk."""
    folder = os.open(path, os.O_RDONLY | os.O_DIRECTORY)
    try:
        os.fsync(folder)
    finally:
        os.close(folder)


class Reserve:
    """Room on the disk that is given back when it is needed most."""

    def __init__(self, path: Path, size: int = RESERVE) -> None:
        self._path = path
        try:
            file = os.open(path, os.O_WRONLY | os.O_CREAT, 0o644)
            try:
                os.posix_fallocate(file, 0, size)
            finally:
                os.close(file)
        except OSError as error:
            self.release()
            if error.errno not in _NO_ROOM:
                raise InputError(
                    text(
                        "{parent}: the run cannot be written there: {strerror}. Make the folder writable, or copy the run "
                        "to one that is",
                        parent=path.parent,
                        strerror=reason_of(error),
                    )
                ) from None
            raise NoRoomError(path.parent, reason_of(error), size) from None

    def release(self) -> None:
        """Give the room back; may be called twice."""
        _remove(self._path)

    def end(self) -> None:
        """Note that the run has ended that it was kept for."""
        self.release()


class StandingReserve(Reserve):
    """Disk space reserved for the ends of successive runs; `keep` before each, `release` after the last."""

    def __init__(self, path: Path) -> None:
        self._path = path

    def keep(self) -> None:
        """Reserve the space if it is not reserved. Raises NoRoomError if there is none."""
        if not self._path.exists():
            super().__init__(self._path)

    def end(self) -> None:
        """Keep it for the next run."""


def _remove(path: Path) -> None:
    try:
        path.unlink(missing_ok=True)
    except OSError as error:
        # A file that cannot be removed harms nobody; the error that led here is the one to be told.
        if error.errno not in (errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO, errno.ENOENT):
            raise
