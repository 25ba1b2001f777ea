import asyncio
from pathlib import Path

import pytest

from bench.i18n.errors import InputError, UsageError
from bench.panel.server.access import Access, TooManyTriesError, add_person
from bench.panel.server.sessions import AccessRight
from bench.panel.server.throttle import LoginThrottle
from tests.bench.panel.conftest import QUICK

HERE = "192.0.2.1"
THERE = "198.51.100.7"


@pytest.fixture
def people(tmp_path: Path) -> Path:
    path = tmp_path / "people.toml"
    add_person(path, "anna", "operator", "correct horse", QUICK)
    add_person(path, "bo", "viewer", "battery staple", QUICK)
    return path


def test_who_has_name_and_password_is_let_in_with_the_role(people: Path) -> None:
    async def ask() -> list[object]:
        access = Access(people)
        result = [await access.check("anna", "correct horse", HERE), await access.check("bo", "battery staple", HERE)]
        return [person and person.role for person in result]

    assert asyncio.run(ask()) == [AccessRight.OPERATOR, AccessRight.VIEWER]


@pytest.mark.parametrize(("name", "password"), [("anna", "battery staple"), ("nobody", "correct horse"), ("", "")])
def test_anything_else_is_not(people: Path, name: str, password: str) -> None:
    assert asyncio.run(Access(people).check(name, password, HERE)) is None


def test_no_password_stands_in_the_file_and_only_its_owner_reads_it(people: Path) -> None:
    content = people.read_text()
    assert "horse" not in content
    assert "$argon2id$" in content
    assert people.stat().st_mode & 0o777 == 0o600


def test_a_new_password_takes_the_old_ones_place(people: Path) -> None:
    add_person(people, "anna", "engineer", "another one!")
    access = Access(people)
    assert asyncio.run(access.check("anna", "correct horse", HERE)) is None
    changed = asyncio.run(Access(people).check("anna", "another one!", HERE))
    assert changed is not None
    assert changed.role is AccessRight.ENGINEER


@pytest.mark.parametrize(
    ("name", "role", "password", "message"),
    [
        ("a b", "operator", "correct horse", "letters, digits"),
        ("anna", "boss", "correct horse", "viewer, operator, engineer"),
        ("anna", "operator", "short", "at least 10"),
    ],
)
def test_what_is_refused(tmp_path: Path, name: str, role: str, password: str, message: str) -> None:
    with pytest.raises(UsageError, match=message):
        add_person(tmp_path / "people.toml", name, role, password)
    assert not (tmp_path / "people.toml").exists()


def test_a_file_that_is_not_right(tmp_path: Path) -> None:
    path = tmp_path / "people.toml"
    path.write_text('[people.anna]\nrole = "operator"\npassword = "horse"\n')
    with pytest.raises(InputError, match=r"people\.anna\.password"):
        Access(path)
    path.write_text("")
    with pytest.raises(InputError, match="nobody may log in"):
        Access(path)


async def guess(access: Access, name: str, count: int, address: str = HERE) -> list[object]:
    """Try wrong passwords, all at once."""
    tries = (access.check(name, f"wrong {number}", address) for number in range(count))
    return list(await asyncio.gather(*tries, return_exceptions=True))


def test_who_guesses_delays_nobody_else(people: Path) -> None:
    async def attack() -> None:
        # The clock stands: whoever is let in did not wait.
        access = Access(people, LoginThrottle(lambda: 0.0))
        result = [answer for _ in range(5) for answer in await guess(access, "anna", 5)]
        assert not [answer for answer in result if answer is not None and not isinstance(answer, TooManyTriesError)]
        assert sum(answer is None for answer in result) <= 6
        with pytest.raises(TooManyTriesError):
            await access.check("anna", "correct horse", HERE)
        assert await access.check("bo", "battery staple", HERE) is not None
        assert await access.check("anna", "correct horse", THERE) is not None

    asyncio.run(attack())


def test_a_thousand_tries_at_once_are_not_computed_at_once(people: Path) -> None:
    async def attack() -> tuple[int, bool]:
        access = Access(people, LoginThrottle(lambda: 0.0))
        others = [
            access.check(f"nobody-{number}", "wrong", f"10.0.{number // 250}.{number % 250}") for number in range(1000)
        ]
        result = await asyncio.gather(*others, return_exceptions=True)
        return sum(answer is None for answer in result), await access.check("bo", "battery staple", HERE) is not None

    computed, let_in = asyncio.run(attack())
    assert computed <= 64
    assert let_in
