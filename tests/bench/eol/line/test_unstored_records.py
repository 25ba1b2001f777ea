"""Whole batches whose own database takes no records for a while."""

import json
import sqlite3
from pathlib import Path
from typing import Any

import pytest
from sqlalchemy import NullPool, create_engine, text

from bench.cli.main import main
from bench.eol.line.record_writer import own_records
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.store.spool import FOLDER
from bench.eol.store.waiting import Waiting
from tests.bench.eol.loaded_workers import loaded_workers


def numbers(reference: Path, batch: str = "small") -> list[int]:
    with own_records(str(reference)) as records:
        return sorted(record.number for record in records.read(batch))


def lock(path: Path) -> sqlite3.Connection:
    holder = sqlite3.connect(path, isolation_level=None, check_same_thread=False)
    holder.execute("BEGIN IMMEDIATE")
    return holder


def release(holder: sqlite3.Connection) -> None:
    holder.rollback()
    holder.close()


@pytest.fixture(autouse=True)
def _short(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.store.database._PATIENCE", 0.2)
    monkeypatch.setattr("bench.eol.store.forwarder.FIRST", 0.1)


@pytest.mark.parametrize("to", ["file", "server"])
def test_a_database_that_is_locked_for_longer_than_a_writer_waits_costs_no_record(
    bench: Any, request: pytest.FixtureRequest, to: str
) -> None:
    own = bench.folder / "records.sqlite" if to == "file" else bench.folder / "runs" / "records.sqlite"
    records = str(own) if to == "file" else str(request.getfixturevalue("server"))
    own.parent.mkdir(exist_ok=True)
    open_database(str(own)).dispose()
    holders = []

    def begun(motor: Any) -> None:
        if motor.number == 2:
            holders.append(lock(own))

    def waits(waiting: Waiting) -> None:
        # Released from the thread that says so: the batch goes on meanwhile.
        if waiting.unstored and holders:
            release(holders.pop())

    bench.listener.when_begun = begun
    bench.listener.when_waits = waits
    counts, stopped = bench.run(records=records)
    assert (counts.motors, stopped, counts.waits.anything) == (4, "", False)
    assert any("database is locked" in str(t.why) for waiting in bench.listener.waitings for t in waiting.troubles)
    assert numbers(own) == [1, 2, 3, 4]
    if to == "server":
        there = open_database(records)
        with there.connect() as connection:
            assert connection.execute(text("SELECT count(*) FROM motor")).scalar_one() == 4
        there.dispose()
    assert not (bench.folder / "runs" / FOLDER).exists()


def test_a_batch_that_ends_with_records_in_no_database_says_so_and_the_next_one_stores_them(bench: Any) -> None:
    own = bench.folder / "records.sqlite"
    open_database(str(own)).dispose()
    holder = None

    def begun(motor: Any) -> None:
        nonlocal holder
        holder = holder or lock(own)

    bench.listener.when_begun = begun
    counts, stopped = bench.run()
    assert holder is not None
    assert (counts.motors, stopped, counts.waits.unstored) == (4, "", 4)
    message = "\n".join(map(str, counts.waits.sentences()))
    assert "records that are in no database yet, kept in files: 4" in message
    assert "the station's own database takes nothing: database is locked" in message
    release(holder)
    assert numbers(own) == []
    bench.listener.records.clear()
    bench.listener.when_begun = lambda _: None
    counts, stopped = bench.run(motors=5)
    assert [record.number for record in bench.listener.records] == [5], "no motor is measured again"
    assert (stopped, counts.waits.anything) == ("", False)
    assert numbers(own) == [1, 2, 3, 4, 5]


def test_the_command_tells_what_waits(bench: Any, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["--station", str(bench.folder / "line.toml"), "--runs", str(bench.folder / "runs"), "--motors", "1"]
    with loaded_workers(), pytest.raises(SystemExit):
        main(
            [
                "eol",
                "run",
                str(bench.folder / "plan.toml"),
                *words,
                "--json",
                "--records",
                "postgresql://nobody@127.0.0.1:9/none",
            ]
        )
    out, err = capsys.readouterr()
    content = json.loads(out)
    assert (content["waiting_for_server"], content["in_no_database"], content["refused_records"]) == (1, 0, [])
    assert "the server takes nothing" in content["waits_because"][0]
    assert "motorbench: records that wait for the server: 1\n" in err
    assert "motorbench: what waits is brought on with the next batch of these runs\n" in err


def test_records_that_cannot_be_read_do_not_stop_a_line(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = create_engine("sqlite://", poolclass=NullPool)

    def unreadable(_records: Records, _serial: str) -> None:
        with broken.connect() as connection:
            connection.execute(text("SELECT * FROM malformed"))

    monkeypatch.setattr(Records, "last_test", unreadable)
    counts, stopped = bench.run(motors=2)
    assert (counts.motors, stopped) == (2, "")
    assert any("cannot be looked up, so it is measured: the station's records" in t for t in bench.listener.troubles)
