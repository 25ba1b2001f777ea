"""Forwarding outlives every error of the station's own database and of its server, says what it waits for, and loses no record."""

import sqlite3
import threading
import uuid
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import psycopg
import pytest
from sqlalchemy import Engine, event, make_url

from bench.eol.record import MotorRecord
from bench.eol.store.database import open_database
from bench.eol.store.faults import StoreError
from bench.eol.store.forwarder import Forwarder
from bench.eol.store.forwarding import ForwardingRecords
from bench.eol.store.records import Records
from bench.eol.store.spool import Spool, SpooledFileError
from bench.eol.store.waiting import Waiting
from tests.bench.eol.store.test_records import record

PATIENCE = 30.0


@dataclass
class Station:
    """A station's own database, its spool, and the thread that forwards to a server."""

    folder: Path
    server: str
    reported: list[Waiting] = field(default_factory=list)

    def __post_init__(self) -> None:
        self.path = self.folder / "own.sqlite"
        self.own = open_database(str(self.path))
        self.spool = Spool(self.folder / "unstored", str(self.path))
        self.records = ForwardingRecords(self.own, lambda: open_database(self.server), self.spool)
        self.forwarder = Forwarder(self.records, first=0.02, longest=0.1)
        self.forwarder.listen(self.reported.append)

    def save(self, each: MotorRecord) -> None:
        self.records.save(each)
        self.forwarder.news()

    def wait(self, condition: Callable[[Waiting], object]) -> Waiting:
        pause = threading.Event()
        for _ in range(int(PATIENCE / 0.01)):
            if condition(state := self.forwarder.state):
                return state
            pause.wait(0.01)
        raise AssertionError(f"still {list(map(str, state.sentences()))}")

    def all_clear(self) -> None:
        self.wait(lambda state: not (state.anything or self.spool.names() or self.records.waiting()))

    def sentences(self, state: Waiting) -> str:
        return "\n".join(map(str, state.sentences()))

    def kept(self) -> list[int]:
        """The numbers of the server's records."""
        there = open_database(self.server)
        numbers = [result.number for result in Records(there).read()]
        there.dispose()
        return numbers

    def close(self) -> Waiting:
        left = self.forwarder.close(PATIENCE)
        self.records.close()
        self.spool.close()
        return left


@pytest.fixture
def station(tmp_path: Path, server: str, monkeypatch: pytest.MonkeyPatch) -> Iterator[Station]:
    monkeypatch.setattr("bench.eol.store.database._PATIENCE", 0.2)
    created = Station(tmp_path, server)
    yield created
    created.close()


@contextmanager
def locked(path: Path) -> Iterator[None]:
    with closing(sqlite3.connect(path, isolation_level=None)) as holder:
        holder.execute("BEGIN IMMEDIATE")
        yield
        holder.rollback()


@contextmanager
def pragma(engine: Engine, on: str, off: str) -> Iterator[None]:
    """Have every connection so for the length of the block."""
    now = on

    def apply(connection: Any, *_: Any) -> None:
        connection.execute(f"PRAGMA {now}")

    event.listen(engine, "checkout", apply)
    yield
    now = off


def pages(path: Path) -> int:
    with closing(sqlite3.connect(path)) as connection:
        return int(connection.execute("PRAGMA page_count").fetchone()[0])


def three_while_it_fails(station: Station, why: str) -> None:
    for number in (1, 2, 3):
        station.save(record(number))
    state = station.wait(lambda state: state.unstored == 3 and state.troubles and state.next_try)
    message = station.sentences(state)
    assert "records that are in no database yet, kept in files: 3" in message
    assert "the station's own database accepts no records" in message
    assert why in message
    assert "the next try is at" in message


@pytest.mark.parametrize("fault", ["locked", "read-only", "full"])
def test_records_that_the_own_database_does_not_take_are_kept_and_arrive_later(station: Station, fault: str) -> None:
    station.save(record(0))
    station.all_clear()
    hindered = {
        "locked": (lambda: locked(station.path), "database is locked"),
        "read-only": (lambda: pragma(station.own, "query_only = ON", "query_only = OFF"), "readonly database"),
        "full": (
            lambda: pragma(station.own, f"max_page_count = {pages(station.path)}", "max_page_count = 100000"),
            "full",
        ),
    }
    hinder, why = hindered[fault]
    with hinder():
        if fault == "full":
            # Fills what is left of the pages.
            station.save(record(9, cause="x" * 100_000))
            station.wait(lambda state: state.unstored == 1)
            for number in (1, 2):
                station.save(record(number))
            station.wait(lambda state: state.unstored == 3 and why in station.sentences(state))
        else:
            three_while_it_fails(station, why)
    station.all_clear()
    expected = {"full": [0, 1, 2, 9]}.get(fault, [0, 1, 2, 3])
    assert sorted(station.kept()) == expected
    assert sorted(result.number for result in Records(station.own).read()) == expected
    assert station.spool.names() == []


def test_a_corrupt_own_database_costs_no_record_and_a_new_one_takes_them(station: Station, tmp_path: Path) -> None:
    station.save(record(0))
    station.all_clear()
    with closing(sqlite3.connect(station.path)) as connection:
        connection.execute("PRAGMA wal_checkpoint(TRUNCATE)")
    station.own.dispose()
    # In place: the forwarder may be looking for more to do, and a file cut to nothing is not the fault that is meant.
    with station.path.open("r+b") as file:
        file.seek(4096)
        file.write(b"\xa5" * (station.path.stat().st_size - 4096))
    three_while_it_fails(station, "malformed")
    left = station.close()
    assert left.unstored == 3
    for file in tmp_path.glob("own.sqlite*"):
        file.rename(tmp_path / f"broken-{file.name}")
    again = Station(tmp_path, station.server)
    again.forwarder.news()
    again.all_clear()
    assert sorted(again.kept()) == [0, 1, 2, 3]
    again.close()


def test_a_server_that_is_away_is_told_with_count_reason_and_next_try(station: Station) -> None:
    there, station.server = station.server, "postgresql://nobody@127.0.0.1:9/none"
    for number in (1, 2):
        station.save(record(number))
    state = station.wait(lambda state: state.for_server == 2 and state.next_try)
    message = station.sentences(state)
    assert "records that wait for the server: 2" in message
    assert "the server accepts no records: postgresql://nobody@127.0.0.1:9/none" in message
    assert station.reported, "the listener hears it"
    station.server = there
    station.all_clear()
    assert not station.reported[-1].anything
    assert sorted(station.kept()) == [1, 2]


def test_a_record_that_the_server_refuses_for_its_content_is_named_and_holds_up_no_other(station: Station) -> None:
    station.save(record(1, cause="a\0b"))
    station.save(record(2, plan="x" * 300))
    station.save(record(3))
    state = station.wait(lambda state: len(state.refused) == 2 and state.for_server == 2)
    assert station.kept() == [3]
    assert not state.troubles, "it is the records' fault and not the server's"
    message = station.sentences(state)
    assert "the record of motor 1 (P-0001) of batch B1 is refused: the server: " in message
    assert "too long" in message
    station.save(record(4))
    station.wait(lambda state: station.kept() == [3, 4] and state.for_server == 2 and not state.troubles)


def test_a_record_that_the_own_database_refuses_stays_in_its_file_and_holds_up_no_other(station: Station) -> None:
    twice = record(1)
    twice = record(1, measured=twice.measured[:1] * 2)
    station.save(twice)
    station.save(record(2))
    state = station.wait(lambda state: state.refused and not station.records.waiting())
    assert (state.unstored, state.troubles) == (1, ())
    assert "motor 1" in str(state.refused[0].words)
    assert station.kept() == [2]
    kept = station.spool.read(twice.identifier)
    assert repr(kept) == repr(twice)


@contextmanager
def another_role(station: Station) -> Iterator[tuple[psycopg.Connection, str]]:
    """Have the station be a role at its server that may read, for the length of the block; the server's owner, and the role's name."""
    role = f"station_{uuid.uuid4().hex[:12]}"
    open_database(station.server).dispose()
    as_owner, database = station.server, make_url(station.server).database
    with psycopg.connect(as_owner, autocommit=True) as owner:
        # A server may ask for a password, as the packaged one does.
        owner.execute(f"CREATE ROLE \"{role}\" LOGIN PASSWORD '{role}'")
        try:
            owner.execute(f'GRANT SELECT ON ALL TABLES IN SCHEMA public TO "{role}"')
            station.server = make_url(as_owner).set(username=role, password=role).render_as_string(hide_password=False)
            yield owner, role
        finally:
            station.server = as_owner
            owner.execute(
                "SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = %s AND datname = %s",
                (role, database),
            )
            owner.execute(f'DROP OWNED BY "{role}"')
            owner.execute(f'DROP ROLE "{role}"')


def permit(owner: psycopg.Connection, role: str) -> None:
    owner.execute(f'GRANT ALL ON ALL TABLES IN SCHEMA public TO "{role}"')
    owner.execute(f'GRANT ALL ON ALL SEQUENCES IN SCHEMA public TO "{role}"')


def test_a_server_that_refuses_by_permission_is_waited_for(station: Station) -> None:
    with another_role(station) as (owner, role):
        for number in (1, 2, 3):
            station.save(record(number))
        state = station.wait(lambda state: state.troubles and state.for_server == 3)
        assert "permission denied" in station.sentences(state)
        assert state.refused == (), "a server that refuses all refuses none for its content"
        permit(owner, role)
        station.all_clear()
    assert sorted(station.kept()) == [1, 2, 3]


def test_a_server_without_a_connection_to_spare_is_waited_for(station: Station) -> None:
    with another_role(station) as (owner, role):
        permit(owner, role)
        station.save(record(1))
        station.all_clear()
        owner.execute(f'ALTER ROLE "{role}" CONNECTION LIMIT 0')
        owner.execute("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE usename = %s", (role,))
        for number in (2, 3):
            station.save(record(number))
        state = station.wait(lambda state: state.troubles and state.for_server == 2)
        assert "too many connections" in station.sentences(state)
        assert state.refused == (), "nothing is wrong with the records"
        owner.execute(f'ALTER ROLE "{role}" CONNECTION LIMIT -1')
        station.all_clear()
    assert sorted(station.kept()) == [1, 2, 3]


def test_one_that_alone_is_not_permitted_does_not_hold_up_the_others(station: Station) -> None:
    open_database(station.server).dispose()
    with psycopg.connect(station.server, autocommit=True) as owner:
        owner.execute(
            "CREATE FUNCTION picky() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN IF NEW.number = 1 THEN "
            "RAISE EXCEPTION 'not number one' USING ERRCODE = '42501'; END IF; RETURN NEW; END $$"
        )
        owner.execute("CREATE TRIGGER picky BEFORE INSERT ON motor FOR EACH ROW EXECUTE FUNCTION picky()")
    for number in (1, 2, 3):
        station.save(record(number))
    state = station.wait(lambda state: state.refused and state.for_server == 1)
    assert "motor 1 (P-0001) of batch B1 is refused: the server: not number one" in station.sentences(state)
    assert station.kept() == [2, 3]


def test_a_server_of_a_newer_version_is_told_and_left_alone(station: Station) -> None:
    open_database(station.server).dispose()
    with psycopg.connect(station.server, autocommit=True) as owner:
        known = owner.execute("SELECT version_num FROM alembic_version").fetchone()
        owner.execute("UPDATE alembic_version SET version_num = '9999'")
        owner.execute("UPDATE compatibility SET least = '9999'")
        station.save(record(1))
        state = station.wait(lambda state: state.troubles)
        assert "version 9999, which this program does not know" in station.sentences(state)
        owner.execute("UPDATE alembic_version SET version_num = %s", known)
    station.all_clear()
    assert station.kept() == [1]


def test_a_server_that_ends_all_connections_again_and_again_gets_every_record_once(station: Station) -> None:
    database = make_url(station.server).database
    with psycopg.connect(station.server.rpartition("/")[0] + "/postgres", autocommit=True) as owner:
        for number in range(1, 41):
            station.save(record(number))
            if number % 5 == 0:
                owner.execute("SELECT pg_terminate_backend(pid) FROM pg_stat_activity WHERE datname = %s", (database,))
    station.all_clear()
    assert sorted(station.kept()) == list(range(1, 41))


def test_a_fault_of_the_program_is_shown_and_forwarding_goes_on(
    station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(_records: ForwardingRecords) -> int:
        raise KeyError("nobody foresaw this")

    with monkeypatch.context() as broken:
        broken.setattr(ForwardingRecords, "forward", fail)
        station.save(record(1))
        state = station.wait(lambda state: state.troubles and state.next_try)
        assert "a fault of the program, KeyError: 'nobody foresaw this'" in station.sentences(state)
    station.all_clear()
    assert station.kept() == [1]


def test_a_listener_that_fails_does_not_end_forwarding(station: Station) -> None:
    heard = []

    def fail(state: Waiting) -> None:
        heard.append(state)
        raise RuntimeError("the terminal is gone")

    station.forwarder.listen(fail)
    there, station.server = station.server, "postgresql://nobody@127.0.0.1:9/none"
    for number in (1, 2, 3):
        station.save(record(number))
    station.wait(lambda state: state.troubles)
    station.server = there
    station.wait(lambda _: station.records.waiting() == 0)
    assert heard
    assert sorted(station.kept()) == [1, 2, 3]


def test_pauses_grow_up_to_their_bound(station: Station) -> None:
    forwarder = Forwarder(station.records)
    pauses = []
    for failures in range(1, 40):
        forwarder._failures = failures
        pauses.append(forwarder._pause())
    assert pauses[:7] == [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 60.0]
    assert set(pauses[7:]) == {60.0}
    forwarder.close(PATIENCE)


def test_a_database_that_does_not_answer_is_told(station: Station, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.store.forwarder._SILENT", 0.1)
    monkeypatch.setattr("bench.eol.store.forwarder._LOOK", 0.05)
    answers = threading.Event()

    def silent(_records: ForwardingRecords) -> int:
        answers.wait(PATIENCE)
        return 0

    watched = Forwarder(station.records, first=0.02, longest=0.1)
    with monkeypatch.context() as held:
        held.setattr(ForwardingRecords, "forward", silent)
        watched.news()
        pause = threading.Event()
        for _ in range(1000):
            if watched.state.troubles:
                break
            pause.wait(0.01)
        assert "does not answer" in station.sentences(watched.state)
        answers.set()
    assert watched.close(PATIENCE).troubles == ()


def test_what_waits_is_counted_in_the_end_although_a_request_has_not_ended(
    station: Station, monkeypatch: pytest.MonkeyPatch
) -> None:
    answers = threading.Event()
    monkeypatch.setattr(ForwardingRecords, "forward", lambda _: answers.wait(PATIENCE) and 0)
    station.save(record(1))
    assert station.forwarder.close(0.2).for_server == 1
    answers.set()


def test_where_neither_database_nor_disk_takes_a_record_it_is_said(station: Station, tmp_path: Path) -> None:
    (tmp_path / "unstored").write_text("a file where the folder should be")
    with locked(station.path), pytest.raises(StoreError, match=r"unstored/.* cannot be written"):
        station.records.save(record(1))
    (tmp_path / "unstored").unlink()
    station.all_clear()


def test_a_spooled_file_that_was_changed_is_named_and_stays(station: Station) -> None:
    good, bad = record(1), record(2)
    for each in (good, bad):
        station.spool.keep(each)
    (file,) = station.spool.folder.glob(f"{bad.identifier}.json")
    file.write_bytes(file.read_bytes().replace(b'"number":2', b'"number":5'))
    with pytest.raises(SpooledFileError):
        station.spool.read(bad.identifier)
    station.forwarder.news()
    state = station.wait(lambda state: state.refused and not station.records.waiting())
    assert f"{bad.identifier}.json is refused: the record is not as it was written" in station.sentences(state)
    assert station.kept() == [1]
    assert file.exists()
