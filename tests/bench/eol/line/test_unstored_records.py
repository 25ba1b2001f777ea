"""Whole batches whose own database takes no records for a while."""

import errno
import json
import os
import resource
import sqlite3
from collections.abc import Mapping
from pathlib import Path
from threading import Event
from types import SimpleNamespace
from typing import Any

import pytest
from sqlalchemy import Connection, Engine, NullPool, create_engine, text
from sqlalchemy.exc import OperationalError

from bench.cli.main import main
from bench.eol.limits import GuardBand
from bench.eol.line.judging import MotorJudge
from bench.eol.line.motor_record import KeptWaveforms, UnitTest, record_of
from bench.eol.line.record_writer import open_record_writer, own_records
from bench.eol.line.workers.messages import Task
from bench.eol.record import MotorRecord
from bench.eol.store.database import open_database
from bench.eol.store.faults import StoreError
from bench.eol.store.insertion import insert_record
from bench.eol.store.spool import FOLDER
from bench.eol.store.waiting import Waiting
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from bench.i18n.language import translator
from bench.journal.disk import write_file
from bench.journal.errors import RecordError
from tests.bench.eol.loaded_workers import loaded_workers
from tests.bench.eol.motor_records import NOON


def test_a_full_disk_leaves_no_empty_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(file: int, offset: int, size: int) -> None:
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(os, "posix_fallocate", full)
    with pytest.raises(InputError, match="no room"):
        open_record_writer(str(tmp_path / "records.sqlite"), tmp_path / "runs")
    assert not (tmp_path / "runs" / FOLDER).exists()


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
    holders, released = [], Event()

    def begun(motor: Any) -> None:
        if motor.number == 2:
            holders.append(lock(own))
        elif motor.number == 4:
            # A batch that ends sooner than anybody was told ends with records that wait.
            released.wait(20.0)

    def waits(waiting: Waiting) -> None:
        # Released from the thread that says so: the batch goes on meanwhile.
        if waiting.unstored and holders:
            release(holders.pop())
            released.set()

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
    assert "the station's own database accepts no records: database is locked" in message
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
    assert "the server accepts no records" in content["waits_because"][0]
    assert "motorbench: records that wait for the server: 1\n" in err
    forwarded = "waiting records are forwarded with the next batch in this folder of runs, or by motorbench eol forward"
    assert f"motorbench: {forwarded}\n" in err


def test_records_that_cannot_be_read_do_not_stop_a_line(bench: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    broken = create_engine("sqlite://", poolclass=NullPool)

    def unreadable(_engine: Engine, _serial: str) -> None:
        with broken.connect() as connection:
            connection.execute(text("SELECT * FROM malformed"))

    monkeypatch.setattr("bench.eol.line.admission.serial_register.earlier_tests", unreadable)
    counts, stopped = bench.run(motors=2)
    assert (counts.motors, stopped) == (2, "")
    (words,) = (words for words in bench.listener.troubles if "cannot be read" in words)
    assert "and those after it are measured, although " in words
    assert "no such table: malformed" in words


@pytest.mark.parametrize("room", [0, 1], ids=["no room", "room for one record more"])
def test_a_disk_that_fills_up_at_a_motor_stops_there_and_the_batch_goes_on_where_it_was(
    bench: Any, monkeypatch: pytest.MonkeyPatch, room: int
) -> None:
    disk = {"full": False, "room": room}
    write = write_file

    def insert(connection: Connection, record: MotorRecord) -> bool:
        if disk["full"]:
            raise OperationalError("INSERT", {}, sqlite3.OperationalError("database or disk is full"))
        return insert_record(connection, record)

    def spool(path: Path, content: bytes) -> None:
        if disk["full"] and not disk["room"]:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        disk["room"] -= disk["full"]
        write(path, content)

    def done(record: MotorRecord) -> None:
        disk["full"] = disk["full"] or len(bench.listener.records) == 2

    monkeypatch.setattr("bench.eol.store.forwarding.insert_record", insert)
    monkeypatch.setattr("bench.eol.store.spool.write_file", spool)
    monkeypatch.setattr("bench.eol.line.record_writer._RETRY_TIME", 0.0)
    bench.listener.when_done = done
    with pytest.raises(StoreError) as stopped:
        bench.run(motors=6, sockets=1)
    kept = [record.number for record in bench.listener.records]
    assert kept == [1, 2, 3][: 2 + room], "a motor is called done when its record is on the disk"
    lost = 3 + room
    words = str(stopped.value)
    assert f"the record of motor {lost} (V00000{lost}) could not be stored" in words
    assert "no space is left on the disk" in words
    assert "Remove the cause, then give the same command again" in words
    assert any(
        f"motor {lost} (V00000{lost}) is not stored yet. It is tried again for" in each
        for each in bench.listener.troubles
    )
    # The run of the motor that was told is there to be read.
    run = words.partition("Its run is in ")[2].partition(". Remove")[0]
    assert (bench.folder / "runs" / "small" / run).is_dir() or Path(run).is_dir()
    before = {record.number: record.identifier for record in bench.listener.records}
    disk["full"] = False
    bench.listener.when_done = lambda _: None
    bench.listener.records.clear()
    _, reason = bench.run(motors=6, sockets=1)
    assert (reason, numbers(bench.folder / "records.sqlite")) == ("", [1, 2, 3, 4, 5, 6])
    assert [record.number for record in bench.listener.records] == list(range(lost, 7))
    with own_records(str(bench.folder / "records.sqlite")) as records:
        found = {record.number: record.identifier for record in records.read("small")}
    assert {number: found[number] for number in before} == before
    assert not (bench.folder / "runs" / FOLDER).exists()


def test_a_server_that_is_away_keeps_nothing_from_being_kept(bench: Any) -> None:
    counts, _ = bench.run(motors=1, records="postgresql://nobody@127.0.0.1:9/none")
    assert counts.motors == 1
    assert (counts.waits.for_server, counts.waits.unstored, counts.waits.refused) == (1, 0, ())
    (trouble,) = counts.waits.troubles
    assert "the server accepts no records" in str(trouble.why)
    with own_records(str(bench.folder / "runs" / "records.sqlite")) as kept:
        assert kept.count("small") == 1


def test_of_runs_that_could_not_be_written_the_line_says_once_what_to_do(bench: Any) -> None:
    limits = resource.prlimit(bench.fork_server.pid, resource.RLIMIT_FSIZE)
    resource.prlimit(bench.fork_server.pid, resource.RLIMIT_FSIZE, (5000, limits[1]))
    try:
        counts, _ = bench.run(motors=4, sockets=1)
    finally:
        resource.prlimit(bench.fork_server.pid, resource.RLIMIT_FSIZE, limits)
    causes = [record.cause for record in bench.listener.records]
    assert len(causes) == counts.verdicts["error"] == 3
    assert all(
        cause.endswith("journal.jsonl cannot be written: the file is larger than allowed") for cause in causes
    ), causes
    assert counts.brakes
    said = [*causes, *bench.listener.troubles, *(str(brake.why) for brake in counts.brakes)]
    assert sum("Raise the limit of a file's size" in each for each in said) == 1, said
    assert not any("--resume" in each for each in said)


@pytest.mark.parametrize("language", ["en", "zh"])
def test_what_a_full_disk_keeps_out_of_a_record_is_named_and_what_to_do_left_to_the_line(
    tmp_path: Path, language: str
) -> None:
    full = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    journal, waveform = RecordError(tmp_path / "journal.jsonl", full), RecordError(tmp_path / "0001.h5", full)
    translate = translator(language)

    class Full(KeptWaveforms):
        def files(self, verdict: Verdict) -> Mapping[str, str]:
            raise waveform

    judge = MotorJudge((), {}, GuardBand.STRICT, 1.0, translate)
    batch = SimpleNamespace(
        name="B",
        uid="0" * 32,
        line="L",
        plan=SimpleNamespace(name="p", sha256=""),
        request=SimpleNamespace(language=language, person=""),
        motor=SimpleNamespace(nameplate=SimpleNamespace(name="m")),
    )
    test = UnitTest(Task(1, "A1", (), 0.0), judge, Full("all"), NOON, cause=journal.text, unwritten=journal)
    cause = record_of(test, batch, "1").cause  # type: ignore[arg-type]
    assert (cause.count("journal.jsonl"), cause.count("0001.h5")) == (1, 1)
    assert journal.remedy.render(translate) not in cause
