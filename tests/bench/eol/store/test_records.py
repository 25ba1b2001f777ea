import math
import signal
import subprocess
import sys
import uuid
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import Engine, text

from bench.eol.record import CheckRecord, MeasuredFigure, MotorRecord
from bench.eol.store.database import open_database
from bench.eol.store.faults import RefusedError, StoreError
from bench.eol.store.forwarding import ForwardingRecords
from bench.eol.store.insertion import settle, settled
from bench.eol.store.records import Records
from bench.eol.store.spool import Spool
from bench.eol.store.tallies import parameters
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from tests.bench.eol.motor_records import motor_record


def record(number: int = 1, **changes: object) -> MotorRecord:
    created = motor_record(
        number,
        identifier=str(uuid.uuid4()),
        measured=(
            MeasuredFigure("flux_linkage", math.nan, "V·s/rad", math.nan, math.nan, -math.inf, math.inf, Verdict.ERROR),
            MeasuredFigure("stator_resistance", 0.016, "Ω", 1e-5, 2e-5, 0.014, 0.018, Verdict.PASS),
        ),
        checks=(
            CheckRecord("stator-resistance", 1, Verdict.ERROR, 2.5, "no reply"),
            CheckRecord("stator-resistance", 2, Verdict.PASS, 2.0),
        ),
        cause="flux_linkage",
        run="runs/x",
        journal_sha256="f" * 64,
        waveforms={"waveforms/0001-oscilloscope.h5": "a" * 64},
    )
    return replace(created, **changes)


def same(first: MotorRecord, second: MotorRecord) -> bool:
    return repr(first) == repr(second)


def test_a_record_comes_back_as_it_was(records: Records) -> None:
    kept = record()
    assert records.save(kept)
    (outcome,) = records.read()
    assert same(outcome, kept)
    assert records.serial_numbers("B1") == {"P-0001"}
    assert records.batches() == ["B1"]


def test_uncertainties_are_those_of_the_latest_test_that_gave_any(records: Records) -> None:
    assert records.save(record(1))
    assert records.save(record(2, verdict=Verdict.ERROR, measured=()))
    assert records.uncertainties("Pump", "S") == {"stator_resistance": 2e-5}
    assert records.uncertainties("Pump", "other") == {}


def test_a_record_is_kept_once(records: Records) -> None:
    kept = record()
    assert records.save(kept)
    assert not records.save(kept)
    assert records.count() == 1


def test_a_database_is_opened_again_with_what_it_holds(reference: str) -> None:
    for count in (1, 2):
        engine = open_database(reference)
        Records(engine).save(record(count))
        assert Records(engine).count("B1") == count
        engine.dispose()


def test_sqlite_commits_reach_the_disk(tmp_path: Path) -> None:
    engine = open_database(str(tmp_path / "records.sqlite"))
    with engine.connect() as connection:
        assert connection.execute(text("PRAGMA journal_mode")).scalar() == "wal"
        assert connection.execute(text("PRAGMA synchronous")).scalar() == 2
    engine.dispose()


@pytest.mark.parametrize(
    ("reference", "message"),
    [
        ("mysql://x@y/z", "SQLite .* or PostgreSQL"),
        ("postgresql://nobody:secret@127.0.0.1:1/none", "127.0.0.1"),
        ("/proc/none/records.sqlite", "unable to open"),
    ],
)
def test_what_cannot_be_opened_says_why_and_keeps_the_password_to_itself(reference: str, message: str) -> None:
    with pytest.raises(InputError, match=message) as refused:
        open_database(reference)
    assert "secret" not in str(refused.value)


def test_a_file_that_is_no_database(tmp_path: Path) -> None:
    (tmp_path / "records.sqlite").write_text("this is no database, but it is long enough to be looked at" * 20)
    with pytest.raises(InputError, match="not a database"):
        open_database(str(tmp_path / "records.sqlite"))


def test_a_server_that_is_away_costs_no_record_and_none_comes_twice(tmp_path: Path, server: str) -> None:
    there = False

    def connect():
        if not there:
            raise InputError("the server is away")
        return open_database(server)

    station = ForwardingRecords(open_database(str(tmp_path / "own.sqlite")), connect, Spool(tmp_path, "own"))
    kept = [record(number) for number in (1, 2, 3)]
    for each in kept:
        assert station.save(each)
    assert station.forward() == 0
    assert (station.waiting(), str(station.fault)) == (3, "the server is away")
    there = True
    # The server took it, and its answer was lost.
    lost = open_database(server)
    Records(lost).save(kept[0])
    assert station.forward() == 3
    assert (station.waiting(), station.fault) == (0, "")
    assert sorted(outcome.serial_number for outcome in Records(lost).read()) == ["P-0001", "P-0002", "P-0003"]
    assert station.forward() == 0
    lost.dispose()
    station.close()


KILLED = """
import sys, itertools
from bench.eol.store.database import open_database
from bench.eol.store import insertion
from bench.eol.store.records import Records
from bench.eol.store.spool import Spool
from tests.bench.eol.store.test_records import record
insertion._TOGETHER = 4
records = Records(open_database(sys.argv[1]))
for number in itertools.count(1):
    records.save(record(number))
    print(number, flush=True)
"""


def test_a_killed_writer_loses_nothing_it_acknowledged(reference: str) -> None:
    process = subprocess.Popen([sys.executable, "-c", KILLED, reference], stdout=subprocess.PIPE, text=True)
    assert process.stdout is not None
    last = 0
    for line in process.stdout:
        last = int(line)
        if last == 20:
            process.send_signal(signal.SIGKILL)
            break
    last = max([last, *(int(line) for line in process.stdout if line.strip().isdigit())])
    process.wait()
    process.stdout.close()
    engine = open_database(reference)
    outcome = list(Records(engine).read())
    engine.dispose()
    assert [r.number for r in outcome] == list(range(1, len(outcome) + 1))
    assert len(outcome) in (last, last + 1)
    assert all(len(r.measured) == 2 and len(r.checks) == 2 for r in outcome)


@pytest.fixture
def four_together(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures go into their table with every fourth record."""
    monkeypatch.setattr("bench.eol.store.insertion._TOGETHER", 4)


def in_place(engine: Engine) -> int:
    with engine.connect() as connection:
        return connection.execute(text("SELECT count(*) FROM figure")).scalar_one()


@pytest.mark.usefixtures("four_together")
def test_figures_are_read_wherever_they_are(tmp_path: Path) -> None:
    engine = open_database(str(tmp_path / "records.sqlite"))
    kept = [record(number) for number in range(1, 7)]
    for each, placed in zip(kept, (0, 0, 0, 8, 8, 8), strict=True):
        assert Records(engine).save(each)
        assert not Records(engine).save(each)
        assert in_place(engine) == placed
    assert [repr(outcome) for outcome in Records(engine).read()] == [repr(each) for each in kept]
    assert repr(Records(engine).find(kept[5].identifier)) == repr(kept[5])
    with settled(engine) as connection:
        assert parameters(connection) == ["flux_linkage", "stator_resistance"]
    assert in_place(engine) == 12
    assert [repr(outcome) for outcome in Records(engine).read()] == [repr(each) for each in kept]
    engine.dispose()


@pytest.mark.usefixtures("four_together")
def test_readers_that_settle_while_records_come_in_lose_none_and_see_all(tmp_path: Path) -> None:
    reference = str(tmp_path / "records.sqlite")
    engine, other = open_database(reference), open_database(reference)
    kept = [record(number) for number in range(1, 101)]
    with ThreadPoolExecutor(1) as pool:
        writing = pool.submit(lambda: [Records(engine).save(each) for each in kept])
        while not writing.done():
            with settled(other):
                pass
            assert all(len(outcome.measured) == 2 for outcome in Records(other).read())
        assert all(writing.result())
    assert [repr(outcome) for outcome in Records(other).read()] == [repr(each) for each in kept]
    engine.dispose()
    other.dispose()


@pytest.mark.parametrize("spare", [3, 6, 9])
@pytest.mark.usefixtures("four_together")
def test_a_full_disk_keeps_what_was_acknowledged_and_takes_the_rest_later(tmp_path: Path, spare: int) -> None:
    engine = open_database(str(tmp_path / "records.sqlite"))
    with engine.connect() as connection:
        pages = connection.execute(text("PRAGMA page_count")).scalar_one()
        connection.execute(text(f"PRAGMA max_page_count = {pages + spare}"))
    kept = [record(number, cause="x" * 900) for number in range(1, 41)]
    acknowledged = []

    def save_all() -> None:
        for each in kept:
            Records(engine).save(each)
            acknowledged.append(each)

    with pytest.raises(StoreError, match="full"):
        save_all()
    assert acknowledged
    assert [repr(outcome) for outcome in Records(engine).read()] == [repr(each) for each in acknowledged]
    engine.dispose()
    again = open_database(str(tmp_path / "records.sqlite"))
    for each in kept[len(acknowledged) :]:
        assert Records(again).save(each)
    settle(again)
    assert in_place(again) == 80
    assert [repr(outcome) for outcome in Records(again).read()] == [repr(each) for each in kept]
    again.dispose()


def test_statistics_of_a_file_that_cannot_be_written_say_so(tmp_path: Path) -> None:
    engine = open_database(str(tmp_path / "records.sqlite"))
    kept = record()
    Records(engine).save(kept)
    with engine.connect() as connection:
        connection.execute(text("PRAGMA query_only = ON"))
    with pytest.raises(
        InputError, match="latest motors' figures cannot be written to their table: attempt to write"
    ) as told:
        settle(engine)
    assert str(told.value).startswith(f"{tmp_path / 'records.sqlite'}: the latest")
    assert [repr(outcome) for outcome in Records(engine).read()] == [repr(kept)]
    engine.dispose()


def test_another_motor_s_record_of_the_same_identifier_is_not_taken_for_known(
    records: Records, engine: Engine, tmp_path: Path
) -> None:
    first = record()
    assert records.save(first)
    assert not records.save(first), "sent twice"
    for other in (replace(first, serial_number="P-0002"), replace(first, verdict=Verdict.ERROR)):
        with pytest.raises(RefusedError, match="another test has its identifier: P-0001, fail"):
            records.save(other)
    assert records.count() == 1
    station = ForwardingRecords(open_database(str(tmp_path / "own.sqlite")), None, Spool(tmp_path / "unstored", "own"))
    station.save(first)
    station.save(replace(first, serial_number="P-0002"))
    assert [str(each.named) for each in station.refused] == ["the record of motor 1 (P-0002) of batch B1"]
    assert station.spooled() == 1, "it is kept"
    station.close()


def test_a_record_that_names_a_figure_twice_is_refused_whole(records: Records) -> None:
    twice = record().measured[:1] * 2
    with pytest.raises(StoreError, match=r"(?i)unique"):
        records.save(record(measured=twice))
    assert records.count() == 0
    assert records.save(record())


def test_a_server_has_figures_in_place_at_once(server: str) -> None:
    engine = open_database(server)
    assert Records(engine).save(record())
    assert in_place(engine) == 2
    engine.dispose()
