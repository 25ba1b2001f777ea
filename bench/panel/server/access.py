"""Access to the panel from a network: people with hashed passwords, in a file that a command makes."""

import asyncio
import math
import os
import re
from collections import Counter
from collections.abc import Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from pydantic import Field
from tomli_w import dumps as toml_text

from bench.files.toml_file import Section, read, validate
from bench.i18n.errors import FileError, InputError, UsageError
from bench.panel.server.sessions import AccessRight
from bench.panel.server.throttle import LoginThrottle, network_of
from drivers.interfaces.text import reason_of, text

if TYPE_CHECKING:
    from argon2 import PasswordHasher

_NAME = re.compile(r"[\w.-]{1,64}")
#: A password that is tried by hand is not found out; one by a program should not be either.
_SHORTEST = 10
#: Passwords that are computed at the same time, each in 64 MiB of memory; all others wait in turn.
_AT_ONCE = 2
#: Tries at one account from one address that may be under way, and tries in all.
_OF_ONE = 2
_OF_ALL = 64


class _Person(Section):
    role: AccessRight
    password: str = Field(pattern=r"^\$argon2id\$", description="a hash that motorbench user add makes")


class _File(Section):
    people: dict[str, _Person] = Field(default_factory=dict)


@dataclass(frozen=True)
class Person:
    """Somebody known: role and the hash (argon2id) of the password."""

    role: AccessRight
    hashed: str


class TooManyTriesError(Exception):
    """A try at logging in that was not looked at; `wait` is the time (s) after which the next one will be."""

    def __init__(self, wait: float) -> None:
        self.wait = max(1, math.ceil(wait))
        super().__init__(f"too many tries; the next one in {self.wait} s")


class Access:
    """The people of a file. Raises InputError for a file that is not right."""

    def __init__(self, path: Path, throttle: LoginThrottle | None = None) -> None:
        self.path = path
        self._people = load_people(path)
        self._throttle = throttle or LoginThrottle()
        self._under_way: Counter[tuple[str, str]] = Counter()
        self._computing = ThreadPoolExecutor(_AT_ONCE, thread_name_prefix="password")
        if not self._people:
            raise FileError(
                text(
                    "{path}: nobody may log in; add people with motorbench user add NAME --role operator --file {path}",
                    path=path,
                )
            )

    async def check(self, name: str, password: str, address: str) -> Person | None:
        """Return the person if name and password are right; `address` is where they come from.

        Raises TooManyTriesError where this address has guessed wrong too often, or too much is under way.
        """
        # What nobody can be called needs no entry of its own.
        name = name if _NAME.fullmatch(name) else ""
        wait = self._throttle.wait(name, address)
        if wait > 0.0:
            raise TooManyTriesError(wait)
        slowness = self._throttle.slowness(name, address)
        with self._counted(name, "" if slowness else network_of(address)):
            await asyncio.sleep(slowness)
            person = self._people.get(name)
            # An unknown name takes as long as a wrong password.
            hashed = person.hashed if person else next(iter(self._people.values())).hashed
            loop = asyncio.get_running_loop()
            right = await loop.run_in_executor(self._computing, _is_right, hashed, password)
        if person is None or not right:
            self._throttle.failed(name, address)
            return None
        self._throttle.succeeded(name, address)
        return person

    @contextmanager
    def _counted(self, name: str, network: str) -> Iterator[None]:
        key = (name, network)
        if self._under_way[key] >= _OF_ONE or self._under_way.total() >= _OF_ALL:
            raise TooManyTriesError(1.0)
        self._under_way[key] += 1
        try:
            yield
        finally:
            self._under_way[key] -= 1
            if not self._under_way[key]:
                del self._under_way[key]


def _is_right(hashed: str, password: str) -> bool:
    from argon2 import PasswordHasher
    from argon2.exceptions import InvalidHashError, VerificationError

    try:
        return PasswordHasher().verify(hashed, password)
    except (VerificationError, InvalidHashError):
        return False


def load_people(path: Path) -> Mapping[str, Person]:
    """Return the people of a file. Raises InputError naming key and what is allowed."""
    _, data = read(path, text("file of people"))
    file = validate(_File, data, str(path))
    return {name: Person(person.role, person.password) for name, person in file.people.items()}


def add_person(path: Path, name: str, role: str, password: str, hasher: "PasswordHasher | None" = None) -> None:
    """Add a person to a file, or change role and password; the file is readable by its owner alone.

    Without a `hasher`, a password's hash takes the time and memory that argon2-cffi recommends.

    Raises UsageError for a name, role or password that will not do, InputError for a file that is not right.
    """
    from argon2 import PasswordHasher

    if not _NAME.fullmatch(name):
        raise UsageError(text("{name!r}: a name has up to 64 letters, digits, dots, dashes and underscores", name=name))
    if role not in [right.value for right in AccessRight]:
        raise UsageError(
            text("--role {role}: allowed are {names}", role=role, names=[right.value for right in AccessRight])
        )
    if len(password) < _SHORTEST:
        raise UsageError(
            text(
                "the password has {count} characters; at least {shortest} are needed",
                count=len(password),
                shortest=_SHORTEST,
            )
        )
    people = dict(load_people(path)) if path.exists() else {}
    people[name] = Person(AccessRight(role), (hasher or PasswordHasher()).hash(password))
    _write(path, people)


def _write(path: Path, people: Mapping[str, Person]) -> None:
    table = {name: {"role": person.role.value, "password": person.hashed} for name, person in people.items()}
    part = path.with_name(f".{path.name}.part")
    try:
        with os.fdopen(os.open(part, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o600), "w", encoding="utf-8") as file:
            file.write(toml_text({"people": table}))
            file.flush()
            os.fsync(file.fileno())
        part.replace(path)
    except OSError as error:
        raise InputError(text("{path}: cannot be written: {strerror}", path=path, strerror=reason_of(error))) from None
