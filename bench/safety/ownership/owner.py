"""One instrument, one owner: who has what on this computer, held by the kernel and gone with the last process that has it."""

import json
import os
import pwd
import uuid
from collections.abc import Collection, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Protocol

from bench.i18n.errors import InputError
from bench.safety.ownership.claims import Claim, all_keys
from bench.safety.ownership.state_folder import StateFolder, try_lock
from drivers.interfaces import InstrumentError
from drivers.interfaces.text import Text, reason_of, text

#: An owner's file: a line for what it is, one for its folder, one for each lot of claims.
_FILES = "owner-*.jsonl"
_MODE = 0o644


@dataclass(frozen=True)
class Holder:
    """Owner of instruments: the user, the process that took them, what it runs, since when (ISO 8601, UTC) and in which folder.

    `gone` says that this process has ended, and that others of its have not.
    """

    user: str
    pid: int
    what: str
    since: str
    folder: str = ""
    gone: bool = False
    keys: frozenset[str] = field(default_factory=frozenset)

    @property
    def words(self) -> Text:
        """The owner as the subject of a sentence."""
        told = {"user": self.user, "pid": self.pid, "what": self.what, "since": self.since}
        folder = text(", folder {folder}", folder=self.folder) if self.folder else Text("")
        if self.gone:
            return text(
                "the guardian of {user}'s {what} (process {pid}, which has ended; since {since}{folder}), "
                "which switches off what was left on",
                folder=folder,
                **told,
            )
        return text("{user} with {what} (process {pid}, since {since}{folder})", folder=folder, **told)


class HeldError(InputError):
    """An instrument is in use by another owner; `holder` says by whom."""

    def __init__(self, claims: Collection[Claim], holder: Holder) -> None:
        self.holder = holder
        super().__init__(
            text(
                "{instruments}: in use by {holder}. Nothing was sent to it. Wait until that program has ended, "
                "or end it",
                instruments=[claim.name for claim in claims],
                holder=holder.words,
            )
        )


class HeldInstrumentError(InstrumentError):
    """An instrument that was opened is in use by another owner; it is closed again."""

    def __init__(self, instrument: str, cause: HeldError) -> None:
        super().__init__(instrument, text("in use by {holder}, at another address", holder=cause.holder.words))
        self.text = text(
            "{instrument}: it has the serial number of an instrument in use by {holder}. It was closed again and "
            "nothing was set. Wait until that program has ended, or end it",
            instrument=instrument,
            holder=cause.holder.words,
        )


class Ownership(Protocol):
    """Holding of an owner; `state` is where that is written down, `descriptors` are to be inherited by those who have it too."""

    @property
    def state(self) -> StateFolder | None:
        """The folder, None where nothing needs an owner."""

    @property
    def descriptors(self) -> tuple[int, ...]:
        """Descriptors; the claims last until the last copy of them is closed."""

    def claim(self, claims: Iterable[Claim]) -> None:
        """Take these from now on, all or none. Raises HeldError."""

    def work_in(self, folder: Path) -> None:
        """Say in which folder the record is."""


class Unowned:
    """Stands for the ownership of a bench in this process, which nobody else can reach."""

    state: StateFolder | None = None
    descriptors: tuple[int, ...] = ()

    def claim(self, claims: Iterable[Claim]) -> None:
        """Pass."""

    def work_in(self, folder: Path) -> None:
        """Pass."""


class Owner:
    """One owner, in one process or several that have its open file: `identifier` and `descriptor` make a share of it."""

    def __init__(self, state: StateFolder, identifier: str, descriptor: int) -> None:
        self.state: StateFolder | None = state
        self._folder = state
        self.identifier = identifier
        self.descriptor = descriptor
        self._had: set[str] = set()

    @property
    def descriptors(self) -> tuple[int, ...]:
        """Its open file."""
        return (self.descriptor,)

    def claim(self, claims: Iterable[Claim]) -> None:
        """Claim all of these, or none. Raises HeldError naming what is in use and by whom."""
        wanted = {key: claim for key, claim in all_keys(claims).items() if key not in self._had}
        if not wanted:
            return
        with self._folder.exclusively():
            for holder in _holders(self._folder, besides=self.identifier):
                taken = {id(claim): claim for key, claim in wanted.items() if key in holder.keys}
                if taken:
                    raise HeldError(list(taken.values()), holder)
            self._write({"keys": sorted(wanted)})
        self._had.update(wanted)

    def work_in(self, folder: Path) -> None:
        """Say in which folder the record is."""
        self._write({"folder": str(folder.resolve())})

    def _write(self, line: dict[str, Any]) -> None:
        try:
            # No lock outlives the computer's stop, so none needs to be on the disk.
            self._folder.append(self.descriptor, json.dumps(line, ensure_ascii=False).encode(), durable=False)
        except OSError as error:
            raise InputError(
                text(
                    "{path}: the list of instruments in use cannot be written there ({error}); free some space",
                    path=self._folder.path,
                    error=reason_of(error),
                )
            ) from error


@contextmanager
def owning(state: StateFolder, what: str) -> Iterator[Owner]:
    """Give an owner that has nothing yet; at the end it lets go, as far as no other process has its file.

    `what` is the command that it runs. Raises InputError where that cannot be written down.
    """
    identifier = uuid.uuid4().hex
    name = f"owner-{identifier}.jsonl"
    with state.exclusively():
        descriptor = state.open(name, os.O_RDWR | os.O_APPEND, _MODE)
        try_lock(descriptor)
    owner = Owner(state, identifier, descriptor)
    try:
        owner._write({"pid": os.getpid(), "what": what, "since": datetime.now(UTC).isoformat(timespec="seconds")})
        yield owner
    finally:
        os.close(descriptor)
        with suppress(InputError), state.exclusively():
            _look(state.path / name)


def holders(state: StateFolder) -> list[Holder]:
    """Return everybody who has something now. Raises InputError."""
    with state.exclusively():
        return [holder for holder in _holders(state) if holder.keys]


def _holders(state: StateFolder, besides: str = "") -> list[Holder]:
    paths = sorted(path for path in state.path.glob(_FILES) if not besides or besides not in path.name)
    return [holder for path in paths if (holder := _look(path)) is not None]


def _look(path: Path) -> Holder | None:
    """Return who has an owner's file open, None where nobody has; such a file is removed. Call it with the folder to oneself."""
    try:
        file = os.open(path, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    except FileNotFoundError:
        return None
    except OSError as error:
        raise InputError(
            text(
                "{path}: the list of instruments in use cannot be read there ({error}); make it readable, or "
                "remove it if nobody uses this computer's instruments",
                path=path,
                error=reason_of(error),
            )
        ) from error
    try:
        if try_lock(file):
            with suppress(PermissionError):
                # Another user's file in such a folder is his to remove; it keeps nobody from anything.
                path.unlink(missing_ok=True)
            return None
        with open(file, encoding="utf-8", errors="replace", closefd=False) as content:
            return _holder(content, os.fstat(file).st_uid)
    finally:
        os.close(file)


def _holder(content: Iterable[str], uid: int) -> Holder:
    told: dict[str, Any] = {}
    keys: set[str] = set()
    for line in content:
        try:
            said = json.loads(line)
        except ValueError:
            # Cut off as its writer was killed: what it claimed was not had yet.
            continue
        keys.update(said.get("keys", ()))
        told |= said
    pid = int(told.get("pid", 0))
    return Holder(
        _user(uid),
        pid,
        str(told.get("what", "?")),
        str(told.get("since", "?")),
        str(told.get("folder", "")),
        not _alive(pid),
        frozenset(keys),
    )


def _user(uid: int) -> str:
    try:
        return pwd.getpwuid(uid).pw_name
    except KeyError:
        return f"uid {uid}"


def _alive(pid: int) -> bool:
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        return True
    return pid > 0
