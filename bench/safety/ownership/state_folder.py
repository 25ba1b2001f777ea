"""The folder that all users of this computer share: who has which instrument, and which interlocks have opened."""

import fcntl
import os
import stat
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from time import monotonic

from bench.i18n.errors import InputError, at
from bench.journal.disk import sync_folder, write_all
from bench.station.clock import SystemClock
from drivers.interfaces.text import Text, reason_of, text

#: Names the folder in place of the usual one; it must be the same for all who use the same instruments.
VARIABLE = "MOTORBENCH_STATE"
#: The usual places, the first where an administrator has made it. Both outlive a restart, as a trip must.
SYSTEM, USUAL = Path("/var/lib/motorbench"), Path("/var/tmp/motorbench")  # noqa: S108  checked before it is used
#: Everybody may write, and remove what is his own.
_MODE = 0o1777
#: Who has the folder to himself needs milliseconds; how long (s) others wait, and how often they look.
_LONGEST, _LOOK = 10.0, 0.005


class FolderBusyError(InputError):
    """Another process has locked the folder and does not release it."""


class StateFolder:
    """A folder where every user of the computer may write and nobody may remove what is another's.

    Made where it is missing. Raises InputError where it cannot be used so.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        try:
            self._make()
            found = path.lstat()
        except OSError as error:
            raise self._unusable(reason_of(error)) from error
        if not stat.S_ISDIR(found.st_mode):
            raise self._unusable(text("it is no folder"))
        if found.st_mode & stat.S_IWOTH and not found.st_mode & stat.S_ISVTX:
            raise self._unusable(
                text("all users may delete all files there; chmod 1777 restricts each user to own files")
            )
        if not os.access(path, os.R_OK | os.W_OK | os.X_OK):
            raise self._unusable(text("you have no permission to write there; chmod 1777 gives it to all users"))

    @contextmanager
    def exclusively(self) -> Iterator[None]:
        """Lock the folder for the length of the block. Raises FolderBusyError if another process does not release it."""
        lock = self.open("lock", os.O_RDONLY, 0o644)
        try:
            end = monotonic() + _LONGEST
            while not try_lock(lock):
                if monotonic() > end:
                    raise FolderBusyError(
                        text(
                            "{path}: another process has locked this folder for {time:g} s; find the process "
                            "that was stopped there, then try again",
                            path=self.path,
                            time=_LONGEST,
                        )
                    )
                SystemClock().sleep(_LOOK)
            yield
        finally:
            os.close(lock)

    def open(self, name: str, flags: int, mode: int) -> int:
        """Return a descriptor of a file, made with this mode where it is missing. Raises InputError where it cannot be had."""
        path = self.path / name
        try:
            try:
                # Where it is there, it is not asked for: Linux refuses O_CREAT for another user's file in such a folder.
                return os.open(path, flags | os.O_NOFOLLOW | os.O_CLOEXEC)
            except FileNotFoundError:
                return self._create(path, flags, mode)
        except OSError as error:
            raise self._unusable(at(name, reason_of(error))) from error

    def append(self, file: int, line: bytes, *, durable: bool = True) -> None:
        """Append a line to an open file, with `durable` on the disk when this returns. Raises OSError."""
        size = os.fstat(file).st_size
        torn = size > 0 and os.pread(file, 1, size - 1) != b"\n"
        write_all(file, (b"\n" if torn else b"") + line + b"\n")
        if durable:
            os.fsync(file)

    def _make(self) -> None:
        if self.path.is_dir():
            return
        self.path.parent.mkdir(parents=True, exist_ok=True)
        try:
            self.path.mkdir(_MODE)
        except FileExistsError:
            return
        # What mkdir was asked for, less the umask.
        self.path.chmod(_MODE)

    def _create(self, path: Path, flags: int, mode: int) -> int:
        try:
            file = os.open(path, flags | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, mode)
        except FileExistsError:
            return os.open(path, flags | os.O_NOFOLLOW | os.O_CLOEXEC)
        os.fchmod(file, mode)
        sync_folder(self.path)
        return file

    def _unusable(self, why: Text | str) -> InputError:
        return InputError(
            text(
                "{path}: this folder, which keeps the instruments in use and the interlocks that have opened, "
                "cannot be used: {why}. Correct that, or name another folder in {variable}, the same for all who "
                "use these instruments",
                path=self.path,
                why=why,
                variable=VARIABLE,
            )
        )


def state_folder(environment: Mapping[str, str] | None = None) -> StateFolder:
    """Return this computer's state folder. Raises InputError where it cannot be used."""
    named = (os.environ if environment is None else environment).get(VARIABLE, "")
    if named:
        return StateFolder(Path(named).absolute())
    return StateFolder(SYSTEM if SYSTEM.is_dir() else USUAL)


def try_lock(file: int) -> bool:
    """Lock an open file against everybody else, until its last descriptor is closed; tell whether it is had now."""
    try:
        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    return True
