"""Stations that start together on one new store, and one that is killed while it makes the tables."""

import os
import signal
import sqlite3
import sys
from collections.abc import Iterable, Iterator
from contextlib import ExitStack, closing, contextmanager
from pathlib import Path

import pytest
from sqlalchemy import Engine, event, inspect

from bench.eol.store import database
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.store.schema import METADATA
from tests.bench.eol.motor_records import motor_record
from tests.studies.forked import Forked

#: How often stations start together on each database; MOTORBENCH_EXAMPLES=1000 does it longer.
TIMES = max(1, int(os.environ.get("MOTORBENCH_EXAMPLES", "40")) // 40)

#: How long (s) a writer waits here for another one.
PATIENCE = 1


def save(reference: str, number: int) -> None:
    """Keep one record, once told to."""
    database._PATIENCE = PATIENCE
    print("ready", flush=True)
    sys.stdin.readline()
    engine = open_database(reference)
    Records(engine).save(motor_record(number))
    engine.dispose()


def die(reference: str, tables: int) -> None:
    """Be killed once so many tables are made."""
    created = 0

    def count(connection: object, cursor: object, statement: str, *rest: object) -> None:
        nonlocal created
        created += statement.lstrip().startswith("CREATE TABLE")
        if created == tables:
            os.kill(os.getpid(), signal.SIGKILL)

    event.listen(Engine, "after_cursor_execute", count)
    open_database(reference)


@contextmanager
def saving(reference: str, numbers: Iterable[int]) -> Iterator[list[Forked]]:
    """Stations in processes of their own, which wait to be told to go on."""
    with ExitStack() as stack:
        processes = [stack.enter_context(closing(Forked(save, reference, number))) for number in numbers]
        for process in processes:
            assert process.stdout.readline() == "ready\n"
        yield processes


def go_on(process: Forked) -> None:
    process.stdin.write("\n")
    process.stdin.flush()


@pytest.mark.parametrize("stations", [2, 8])
@pytest.mark.parametrize("attempt", range(TIMES))
def test_stations_that_start_together_make_the_tables_once(reference: str, stations: int, attempt: int) -> None:
    with saving(reference, range(1, stations + 1)) as processes:
        for process in processes:
            go_on(process)
        ends = [(process.communicate(timeout=120)[1], process.returncode) for process in processes]
    assert ends == [("", 0)] * stations
    engine = open_database(reference)
    assert sorted(record.number for record in Records(engine).read()) == list(range(1, stations + 1))
    engine.dispose()


@pytest.mark.parametrize("tables", [1, 2, 4])
def test_one_that_is_killed_while_it_makes_the_tables_leaves_none(reference: str, tables: int) -> None:
    with closing(Forked(die, reference, tables)) as process:
        assert process.communicate(timeout=120)[1] == ""
        assert process.returncode == -signal.SIGKILL
    engine = open_database(reference)
    assert set(METADATA.tables) <= set(inspect(engine).get_table_names())
    assert Records(engine).count() == 0
    engine.dispose()


def test_who_finds_the_tables_being_made_waits_for_them(tmp_path: Path) -> None:
    reference = str(tmp_path / "records.sqlite")
    with closing(sqlite3.connect(reference, isolation_level=None)) as holder, saving(reference, [1]) as (other,):
        holder.execute("PRAGMA journal_mode = WAL")
        holder.execute("BEGIN IMMEDIATE")
        go_on(other)
        # Longer than a writer waits for another one.
        other.join(1.5 * PATIENCE)
        assert other.returncode is None
        holder.rollback()
        assert other.communicate(timeout=60)[1] == ""
        assert other.returncode == 0
    engine = open_database(reference)
    assert Records(engine).count() == 1
    engine.dispose()
