"""Databases of older and newer versions, with records in them: refused by name, brought up by one command, nothing lost."""

import json
import os
import sqlite3
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from importlib import resources
from pathlib import Path
from typing import Any

import pytest
from alembic import command
from alembic.config import Config
from sqlalchemy import Engine, MetaData, Table, create_engine, insert, inspect, text

from bench.eol.store.database import database_url, migrate_database, open_database
from bench.eol.store.distribution import distribution
from bench.eol.store.insertion import settled
from bench.eol.store.records import Records
from bench.eol.store.schema import METADATA
from bench.eol.store.selection import choose
from bench.eol.verdict import Verdict
from bench.eol.yields import motor_yields
from bench.i18n.errors import FileError, InputError
from tests.bench.eol.motor_records import NOON, motor_record
from tests.command_line import called

OLDER = ("0001", "0002", "0003", "0004", "0005", "0006", "0007", "0008", "0009", "0010")
NEWEST = "0011"
MOTORS = 5


def rows(table: Table, number: int) -> list[dict[str, Any]]:
    """What a program of any version writes into a table for one motor."""
    record = motor_record(number)
    plain = {"verdict": "fail", "started": NOON, "ended": NOON}
    figure = {
        "unit": "Ω",
        "standard_uncertainty": 0.01,
        "expanded": 0.02,
        "low": 9.0,
        "high": 11.0,
        "verdict": "pass",
    }
    match table.name:
        case "motor":
            # The key is the database's own.
            return [{c.name: plain.get(c.name, getattr(record, c.name, None)) for c in table.columns if c.name != "id"}]
        case "figure":
            return [{"motor": number, "parameter": "r", "value": 10.0 + 0.1 * number, **figure}]
        case "fresh_figure":
            return [{"motor": number, "parameter": "l", "value": 10.0, **figure}]
        case "check_attempt":
            return [
                {"motor": number, "procedure": "p", "attempt": 1, "verdict": "error", "duration": 2.0, "cause": "why"}
            ]
        case "waveform":
            return [{"motor": number, "path": "waveforms/0001-a.h5", "sha256": "a" * 64}]
        case "outbox":
            return [{"identifier": record.identifier, "tries": number, "fault": ""}]
        case "summed_stretch" if number == 1:
            return [{"first": 1, "last": MOTORS}]
        case "summed_motors" if number == 1:
            common = {"batch": record.batch, "model": record.model, "verdict": "fail", "first_pass": False}
            return [{"first": 1, **common, "count": MOTORS, "least": 1, "greatest": MOTORS}]
        case "parameter_label" if number == 1:
            return [{"parameter": "r", "label": "R of mine"}]
    return []


def older(reference: str, version: str) -> None:
    """Make a database as a program of this version leaves it, with records of some motors."""
    config = Config()
    config.set_main_option("script_location", str(resources.files("bench.eol.store") / "migrations"))
    engine = create_engine(database_url(reference))
    with engine.begin() as connection:
        config.attributes["connection"] = connection
        command.upgrade(config, version)
        tables = MetaData()
        tables.reflect(connection)
        own_file = connection.dialect.name == "sqlite"
        for table in tables.sorted_tables:
            filled = [row for number in range(1, MOTORS + 1) for row in rows(table, number)]
            # A server's table of fresh figures stays empty.
            if filled and (own_file or table.name != "fresh_figure"):
                connection.execute(insert(METADATA.tables[table.name]), filled)
    if own_file:
        with engine.connect() as connection:
            connection.exec_driver_sql("PRAGMA journal_mode = WAL")
    engine.dispose()


def content(reference: str, columns: Mapping[str, Sequence[str]]) -> dict[str, list[Any]]:
    """All rows of some tables, in these columns."""
    engine = create_engine(database_url(reference))
    with engine.connect() as connection:
        all_rows = {
            name: sorted(map(repr, connection.execute(text(f"SELECT {', '.join(named)} FROM {name}")).all()))  # noqa: S608  our own names
            for name, named in columns.items()
        }
    engine.dispose()
    return all_rows


def tables_of(reference: str) -> dict[str, list[str]]:
    """The columns of each table."""
    engine = create_engine(database_url(reference))
    looked = inspect(engine)
    tables = {name: [column["name"] for column in looked.get_columns(name)] for name in looked.get_table_names()}
    engine.dispose()
    return {name: columns for name, columns in tables.items() if name != "alembic_version"}


@pytest.mark.parametrize("version", OLDER)
def test_an_older_database_with_records_is_refused_until_the_command_brings_it_up(
    reference: str, version: str, capsys: pytest.CaptureFixture[str]
) -> None:
    older(reference, version)
    names = tables_of(reference)
    before = content(reference, names)
    assert len(before["motor"]) == MOTORS
    for arguments in (("stats",), ("export", "--format", "csv")):
        code, out, err = called(capsys, "eol", *arguments, "--records", reference)
        assert (code, out) == (1, "")
        assert f"its tables have version {version}, but this program works with {NEWEST}" in err
        assert "motorbench eol migrate --records" in err
    assert tables_of(reference) == names, "who looks changes nothing"
    assert content(reference, names) == before
    code, out, _ = called(capsys, "eol", "migrate", "--records", reference, "--json")
    assert code == 0
    assert json.loads(out) == {"before": version, "after": NEWEST, "stretches_summed_up": 0, "respelled": 0}
    assert set(METADATA.tables) == set(tables_of(reference))
    unsettled = {name: columns for name, columns in names.items() if name not in ("figure", "fresh_figure")}
    assert content(reference, unsettled) == {name: before[name] for name in unsettled}
    engine = open_database(reference)
    kept = list(Records(engine).read())
    assert [record.number for record in kept] == list(range(1, MOTORS + 1))
    assert [record.serial_number for record in kept] == [f"P-{n:04d}" for n in range(1, MOTORS + 1)]
    figures = {figure.parameter: figure for figure in kept[2].measured}
    assert figures["r"].value == pytest.approx(10.3)
    assert figures["r"].label == ("R of mine" if version >= "0004" else "")
    assert ("l" in figures) == ("fresh_figure" in before and len(before["fresh_figure"]) > 0)
    assert (kept[0].checks[0].verdict, kept[0].checks[0].cause) == (Verdict.ERROR, "why")
    assert kept[0].waveforms == {"waveforms/0001-a.h5": "a" * 64}
    assert Records(engine).save(motor_record(MOTORS + 1))
    with settled(engine) as connection:
        found = distribution(connection, "r", choose(connection, ()))
        yields = motor_yields(connection, choose(connection, ()), ("socket",)).groups["socket"]
    assert [(each.name, each.final.count) for each in yields] == [("S · 1", MOTORS + 1)]
    assert found is not None
    assert (found.count, found.mean) == (MOTORS, pytest.approx(10.3))
    engine.dispose()
    assert called(capsys, "eol", "migrate", "--records", reference, "--language", "en")[1] == (
        f"the tables already have version {NEWEST}\n"
    )


@pytest.mark.parametrize("version", OLDER)
def test_a_line_refuses_an_older_database_before_the_first_motor(
    reference: str, version: str, capsys: pytest.CaptureFixture[str], tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    older(reference, version)
    runs = tmp_path / "runs"
    if "://" in reference:
        # There the station's own file is what has to be of this version before the batch.
        reference_of_own = str(runs / "records.sqlite")
        runs.mkdir()
        older(reference_of_own, version)
    code, out, err = called(
        capsys, "eol", "run", "docs/examples/eol/plan.toml", "--station", "docs/examples/eol/line.toml",
        "--motors", "1", "--runs", str(runs), "--records", reference,
    )  # fmt: skip
    assert (code, out) == (1, "")
    assert "motorbench eol migrate --records" in err
    assert not list(runs.glob("*/batch.jsonl"))


def newer(engine: Engine, least: str) -> None:
    """Have a database look as one of a version that is not known here."""
    with engine.begin() as connection:
        connection.execute(text("UPDATE alembic_version SET version_num = '9999'"))
        connection.execute(text("ALTER TABLE motor ADD COLUMN of_a_later_version INTEGER"))
        connection.execute(text("UPDATE compatibility SET least = :least"), {"least": least})


def test_a_newer_database_is_refused_and_left_alone(reference: str) -> None:
    engine = open_database(reference)
    newer(engine, "9999")
    for attempt in (open_database, migrate_database):
        with pytest.raises(InputError, match="version 9999, which this program does not know"):
            attempt(reference)
    with engine.connect() as connection:
        assert connection.execute(text("SELECT version_num FROM alembic_version")).scalar() == "9999"
    engine.dispose()


def test_a_newer_database_that_allows_this_version_is_read_and_written(
    engine: Engine, reference: str, put: Callable[..., None]
) -> None:
    put(r=10.0)
    newer(engine, NEWEST)
    other = open_database(reference)
    put(r=10.0)
    assert Records(other).save(motor_record(3))
    assert Records(other).count() == 3
    other.dispose()


def test_tables_that_others_use_are_left_alone(
    reference: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    older(reference, "0010")
    monkeypatch.setattr("bench.eol.store.table_versions._UPGRADE", 1)
    monkeypatch.setattr("bench.eol.store.lock_holders._LOOK", 0.02)
    monkeypatch.setattr("bench.eol.store.lock_holders.getpid", lambda: -1)
    engine = create_engine(database_url(reference))
    with engine.connect() as holder:
        if engine.dialect.name == "sqlite":
            holder.exec_driver_sql("PRAGMA journal_mode = WAL")
            holder.exec_driver_sql("BEGIN IMMEDIATE")
        else:
            holder.exec_driver_sql("LOCK TABLE motor IN ACCESS SHARE MODE")
        code, _, said = called(capsys, "eol", "migrate", "--records", reference)
    engine.dispose()
    assert code == 1
    assert "waited for, 1 s at most: " in said
    holder_named = f"process {os.getpid()}: " if engine.dialect.name == "sqlite" else "of postgres at 127.0.0.1, in a"
    assert holder_named in said
    assert "other programs use its tables" in said
    assert "Nothing was changed; give the command again" in said
    assert called(capsys, "eol", "migrate", "--records", reference)[0] == 0


def test_a_database_without_records_is_none(reference: str, capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    if "://" not in reference:
        create_engine(database_url(reference)).connect().close()
    code, _, err = called(capsys, "eol", "migrate", "--records", reference)
    assert code == 2
    assert "there are no records here" in err
    assert called(capsys, "eol", "stats", "--records", reference)[0] == 2
    assert tables_of(reference) == {}
    empty, another = tmp_path / "empty.sqlite", tmp_path / "another.sqlite"
    empty.touch()
    with closing(sqlite3.connect(another)) as connection:
        connection.execute("CREATE TABLE bought (what TEXT)")
    for file in (empty, another):
        before = file.read_bytes()
        for name in ("migrate", "stats", "motors"):
            code, _, err = called(capsys, "eol", name, "--records", str(file))
            assert (code, file.read_bytes()) == (2, before)
            assert "there are no records here" in err
    with pytest.raises(FileError, match=r"SQLite writes beside the file: give a file in a folder"):
        open_database("/nowhere/records.sqlite")
