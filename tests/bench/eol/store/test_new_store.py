"""Stations that start together on one new store, and one that is killed while it makes the tables."""

import os
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from sqlalchemy import inspect, text

from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from bench.eol.store.schema import METADATA

#: How often stations start together on each database; MOTORBENCH_EXAMPLES=1000 does it longer.
TIMES = max(1, int(os.environ.get("MOTORBENCH_EXAMPLES", "40")) // 40)

STATION = """
import sys
from bench.eol.store.database import open_database
from bench.eol.store.records import Records
from tests.bench.eol.motor_records import motor_record
print("ready", flush=True)
sys.stdin.readline()
engine = open_database(sys.argv[1])
Records(engine).save(motor_record(int(sys.argv[2])))
engine.dispose()
"""

KILLED = """
import os, signal, sys
import sqlalchemy
from sqlalchemy import event
from bench.eol.store.database import open_database

made = 0

def count(connection, cursor, statement, *rest):
    global made
    made += statement.lstrip().startswith("CREATE TABLE")
    if made == int(sys.argv[2]):
        os.kill(os.getpid(), signal.SIGKILL)

event.listen(sqlalchemy.Engine, "after_cursor_execute", count)
open_database(sys.argv[1])
"""


def started(code: str, *arguments: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


@pytest.mark.parametrize("stations", [2, 8])
@pytest.mark.parametrize("attempt", range(TIMES))
def test_stations_that_start_together_make_the_tables_once(reference: str, stations: int, attempt: int) -> None:
    processes = [started(STATION, reference, str(number)) for number in range(1, stations + 1)]
    for process in processes:
        assert process.stdout is not None
        assert process.stdout.readline() == "ready\n"
    for process in processes:
        assert process.stdin is not None
        process.stdin.write("\n")
        process.stdin.flush()
    ends = [(process.communicate(timeout=120)[1], process.returncode) for process in processes]
    assert ends == [("", 0)] * stations
    engine = open_database(reference)
    assert sorted(record.number for record in Records(engine).read()) == list(range(1, stations + 1))
    engine.dispose()


@pytest.mark.parametrize("tables", [1, 2, 4])
def test_one_that_is_killed_while_it_makes_the_tables_leaves_none(reference: str, tables: int) -> None:
    process = started(KILLED, reference, str(tables))
    assert process.communicate(timeout=120)[1] == ""
    assert process.returncode == -signal.SIGKILL
    engine = open_database(reference)
    assert set(METADATA.tables) <= set(inspect(engine).get_table_names())
    assert Records(engine).count() == 0
    engine.dispose()


def test_who_finds_the_tables_being_made_waits_for_them(tmp_path: Path) -> None:
    reference = str(tmp_path / "records.sqlite")
    holder = open_database(reference)
    with holder.connect() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '0002'"))
        connection.execute(text("DROP TABLE fresh_figure"))
        connection.commit()
        connection.exec_driver_sql("BEGIN IMMEDIATE")
        other = started(STATION, reference, "1")
        assert other.stdout is not None
        other.stdout.readline()
        assert other.stdin is not None
        other.stdin.write("\n")
        other.stdin.flush()
        with pytest.raises(subprocess.TimeoutExpired):
            # Longer than a writer waits for another one.
            other.wait(6.0)
        connection.rollback()
    assert other.communicate(timeout=60)[1] == ""
    assert other.returncode == 0
    assert Records(holder).count() == 1
    holder.dispose()
