"""What is summed up as motors end: statistics say the same with it and without, whoever else writes or removes."""

import math
import sqlite3
import threading
from collections.abc import Sequence
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from sqlalchemy import Engine, delete, func, insert, select, update
from sqlalchemy.exc import DBAPIError

from bench.eol.line.record_writer import RecordWriter
from bench.eol.line_statistics import StatisticsRequest, line_statistics
from bench.eol.record import CheckRecord, MeasuredFigure, MotorRecord
from bench.eol.serial_number import spellings
from bench.eol.store.database import open_database
from bench.eol.store.insertion import insert_record
from bench.eol.store.records import Records
from bench.eol.store.respelling import respell
from bench.eol.store.schema import MOTOR
from bench.eol.store.spool import Spool
from bench.eol.store.summed_tables import REPEATED_SERIAL, REPEATED_TEST, SUMMED_PLACES, SUMMED_STRETCH, SUMMED_TIMES
from bench.eol.store.summing import sum_up
from bench.eol.verdict import Verdict
from bench.eol.yields import GROUPINGS
from bench.i18n.errors import InputError
from tests.bench.eol.motor_records import NOON, motor_record

LIMITS = (9.0, 11.0)
JUDGED = (Verdict.PASS, Verdict.FAIL)


@pytest.fixture(autouse=True)
def short_stretches(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.store.summing.STRETCH", 5)
    monkeypatch.setattr("bench.eol.store.summing.GROWTH", 2)


def record_of(
    number: int, serial: int, batch: str, verdict: Verdict, value: float, high: float, hours: int = 1
) -> MotorRecord:
    """A record; the clock goes on by so many hours with each number, or is put back, and it is its motor's test of that number."""
    passed = Verdict.PASS if value <= 10.0 else Verdict.FAIL
    return motor_record(
        number,
        batch=batch,
        model="small" if batch == "S" else "big",
        serial_number=f"P-{serial}",
        station=f"line {number % 2}",
        socket=str(number % 3),
        golden=serial == 0,
        test_number=number,
        verdict=verdict,
        first_pass=verdict is Verdict.PASS and passed is Verdict.PASS,
        started=NOON + timedelta(hours=hours * number),
        ended=NOON + timedelta(hours=hours * number),
        measured=(
            MeasuredFigure("r", value, "Ω", 0.01, 0.02, LIMITS[0], high, Verdict.PASS),
            MeasuredFigure("open", 2.0 * value, "Ω", 0.01, 0.02, -math.inf, math.inf, Verdict.PASS),
        ),
        checks=(CheckRecord("r", 1, passed, 1.0), CheckRecord("r", 2, Verdict.PASS, 1.0)),
    )


def stretches(engine: Engine) -> list[tuple[int, int]]:
    with engine.connect() as connection:
        rows = connection.execute(select(SUMMED_STRETCH).order_by(SUMMED_STRETCH.c.first))
        return [(row.first, row.last) for row in rows]


def statistics(engine: Engine, batches: Sequence[str], model: str) -> dict[str, Any] | str:
    """What is summed up, of all that statistics say."""
    try:
        found = line_statistics(engine, StatisticsRequest(batches=batches, model=model, by=GROUPINGS))
    except InputError as error:
        return str(error)
    chosen, yields = found.selection, found.yields
    figures = {name: each.distribution for name, each in found.parameters.items()}
    return {
        "batches": chosen.batches,
        "verdicts": chosen.verdicts,
        "first pass": chosen.first_pass,
        "keys": (chosen.stretches, chosen.exact, chosen.everything),
        "yields": [(each.hits, each.count) for each in (yields.motors.first_pass, yields.motors.final)],
        "rolled": {name: (each.hits, each.count) for name, each in yields.motors.rolled.procedures.items()},
        # In words: a share of nothing is NaN, which is equal to nothing.
        "groups": repr(yields.motors.groups),
        "retested": yields.motors.retested,
        "count": {name: each.count for name, each in figures.items()},
        "moments": {
            name: (each.mean, each.standard_deviation, each.least, each.most) for name, each in figures.items()
        },
        # Without limits the spread at the time tells where bins lie.
        "bins": {name: each.bins.counts for name, each in figures.items() if name == "r"},
    }


def assert_same(found: dict[str, Any] | str, expected: dict[str, Any] | str) -> None:
    """Sums of floating-point numbers depend on their order, all else does not."""
    if isinstance(found, str) or isinstance(expected, str):
        assert found == expected
        return
    assert {**found, "moments": 0} == {**expected, "moments": 0}
    for name, moments in expected["moments"].items():
        assert found["moments"][name] == pytest.approx(moments, rel=1e-9, abs=1e-9, nan_ok=True)


def computed(records: Sequence[MotorRecord], batches: Sequence[str], model: str) -> dict[str, Any]:
    """The same of records that are here, one after the other."""
    plain = [each for each in records if not each.golden]
    chosen = [each for each in plain if each.model == model and (not batches or each.batch in batches)]
    judged = [each for each in chosen if each.verdict in JUDGED]
    ever = {each.serial_number: each for each in reversed(plain) if each.verdict in JUDGED}
    firsts = [each for each in judged if ever[each.serial_number] is each]
    values = np.array([each.measured[0].value for each in chosen])
    return {
        "verdicts": {verdict: sum(each.verdict is verdict for each in chosen) for verdict in Verdict.of_motors()},
        "rolled": (sum(each.checks[0].verdict is Verdict.PASS for each in firsts), len(firsts)),
        "count": len(chosen),
        "moments": (np.mean(values), np.std(values, ddof=1) if len(values) > 1 else math.nan),
    }


STEPS = st.lists(
    st.one_of(
        st.tuples(
            st.integers(0, 5),
            st.sampled_from(["A", "B", "S"]),
            st.sampled_from([Verdict.PASS, Verdict.FAIL, Verdict.ERROR, Verdict.ABORTED]),
            st.sampled_from([8.5, 9.0, 9.7, 10.0, 10.4, 11.0, 12.5]),
            st.sampled_from([11.0, 11.0, 11.0, 12.0]),
        ),
        st.sampled_from(["sum", "remove A", "remove B"]),
    ),
    min_size=1,
    max_size=24,
)


@settings(max_examples=6, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(STEPS, st.sampled_from([1, -1]))
def test_statistics_are_those_of_the_records(engine: Engine, records: Records, steps: list[Any], hours: int) -> None:
    with engine.begin() as connection:
        connection.execute(delete(MOTOR))
        connection.execute(delete(REPEATED_SERIAL))
        assert connection.execute(select(func.count()).select_from(REPEATED_TEST)).scalar() == 0
    assert stretches(engine) == [], "what is removed is forgotten"
    kept: list[MotorRecord] = []
    for number, step in enumerate(steps, 1):
        if step == "sum":
            sum_up(engine)
        elif isinstance(step, str):
            records.remove(step[-1])
            kept = [each for each in kept if each.batch != step[-1]]
        else:
            kept.append(record_of(number, *step, hours))
            records.save(kept[-1])
    asked = [((), "big"), (("A",), "big"), (("A", "B"), ""), ((), "")]
    before = [statistics(engine, *each) for each in asked]
    sum_up(engine)
    summed = [statistics(engine, *each) for each in asked]
    with engine.begin() as connection:
        connection.execute(delete(SUMMED_STRETCH))
        connection.execute(delete(REPEATED_SERIAL))
        connection.execute(delete(REPEATED_TEST))
    direct = [statistics(engine, *each) for each in asked]
    for some in (before, summed):
        for found, expected in zip(some, direct, strict=True):
            assert_same(found, expected)
    for found, (batches, model) in zip(summed[:2], asked[:2], strict=True):
        if isinstance(found, dict) and found["count"]:
            expected = computed(kept, batches, model)
            assert found["verdicts"] == expected["verdicts"]
            assert found["rolled"].get("r", (0, 0)) == expected["rolled"]
            assert found["count"]["r"] == expected["count"]
            assert found["moments"]["r"][:2] == pytest.approx(expected["moments"], rel=1e-9, abs=1e-9, nan_ok=True)


def test_stretches_grow_and_each_is_summed_up_once(engine: Engine, records: Records) -> None:
    seen = []
    for number in range(1, 14):
        records.save(record_of(number, number, "A", Verdict.PASS, 10.0, 11.0))
        seen.append(sum_up(engine))
    assert stretches(engine) == [(1, 5), (6, 10), (11, 12)]
    # A fifth motor fills a stretch, and fewer than two are not worth it.
    assert seen == [0, 1, 0, 1, 1, 0, 1, 0, 1, 1, 0, 1, 0]


def test_an_older_station_that_sums_nothing_up_is_counted(engine: Engine, records: Records) -> None:
    for number in range(1, 8):
        records.save(record_of(number, number, "A", Verdict.PASS, 10.0, 11.0))
    sum_up(engine)
    for number in range(8, 12):
        with engine.begin() as connection:
            insert_record(connection, record_of(number, number, "B", Verdict.FAIL, 10.4, 11.0))
    found = line_statistics(engine, StatisticsRequest())
    assert found.selection.verdicts[Verdict.FAIL] == 4
    assert found.parameters["r"].distribution.count == 11
    assert {name: each.count for name, each in found.yields.motors.rolled.procedures.items()} == {"r": 11}


@pytest.mark.parametrize("version", ["0008", "0009"])
def test_stretches_of_an_older_station_are_brought_up(engine: Engine, records: Records, version: str) -> None:
    for number in range(1, 13):
        records.save(record_of(number, number % 7, "A", Verdict.PASS, 10.0, 11.0))
    sum_up(engine)
    summed = statistics(engine, (), "")
    # What such a program leaves where it has summed up: nothing by place or time before 0009, no tests before 0010.
    with engine.begin() as connection:
        connection.execute(delete(REPEATED_TEST))
        connection.execute(update(SUMMED_STRETCH).values(by_occasion=version == "0009", by_test=False))
        if version == "0008":
            for table in (SUMMED_PLACES, SUMMED_TIMES):
                connection.execute(delete(table))
    assert_same(statistics(engine, (), ""), summed)
    assert sum_up(engine) == 3
    assert_same(statistics(engine, (), ""), summed)
    with engine.connect() as connection:
        assert connection.execute(select(func.sum(SUMMED_TIMES.c.count))).scalar() == 12
        # Of serial 0, a golden motor, and of 1 to 5: each was tested twice.
        assert connection.execute(select(func.count()).select_from(REPEATED_TEST)).scalar() == 12 - 2


def test_a_station_of_0009_goes_on_beside(engine: Engine, records: Records) -> None:
    """It sums up its own way, and what it has summed up anew is counted before and after this program has done its part."""
    for number in range(1, 8):
        records.save(record_of(number, number % 3, "A", Verdict.PASS, 10.0, 11.0))
    sum_up(engine)
    for number in range(8, 12):
        records.save(record_of(number, number % 3, "B", Verdict.FAIL, 10.4, 11.0))
    with engine.begin() as connection:
        # Its growing stretch is begun anew without the mark, as by `insert(...).values(first, last, by_occasion)`.
        connection.execute(delete(SUMMED_STRETCH).where(SUMMED_STRETCH.c.first == 6))
        connection.execute(insert(SUMMED_STRETCH).values(first=6, last=7, by_occasion=True))
    before = statistics(engine, (), "")
    assert sum_up(engine) == 1
    after = statistics(engine, (), "")
    assert_same(before, after)
    with engine.begin() as connection:
        connection.execute(delete(SUMMED_STRETCH))
        connection.execute(delete(REPEATED_TEST))
    assert_same(after, statistics(engine, (), ""))


def test_who_removes_by_other_means_has_the_sums_forgotten(tmp_path: Path) -> None:
    reference = str(tmp_path / "records.sqlite")
    engine = open_database(reference)
    for number in range(1, 13):
        Records(engine).save(record_of(number, number, "A" if number < 7 else "B", Verdict.PASS, 10.0, 11.0))
    sum_up(engine)
    assert stretches(engine) == [(1, 5), (6, 10), (11, 12)]
    # Without references switched on, and with tables of its own mind.
    with closing(sqlite3.connect(reference)) as connection, connection:
        for table in ("figure", "check_attempt"):
            connection.execute(f"DELETE FROM {table} WHERE motor IN (SELECT id FROM motor WHERE batch = 'A')")  # noqa: S608
        connection.execute("DELETE FROM motor WHERE batch = 'A'")
        for table in ("motors", "places", "times", "attempts", "figures"):
            assert connection.execute(f"SELECT min(first) FROM summed_{table}").fetchone() == (11,)  # noqa: S608
    assert stretches(engine) == [(11, 12)]
    assert line_statistics(engine, StatisticsRequest()).parameters["r"].distribution.count == 6
    engine.dispose()


def test_who_is_still_writing_on_a_server_is_waited_for(server: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.store.summing._PATIENCE", "200ms")
    engine = open_database(server)
    records = Records(engine)
    with engine.connect() as slow:
        # It has the lowest key, and commits last.
        insert_record(slow, record_of(1, 1, "A", Verdict.FAIL, 10.4, 11.0))
        for number in range(2, 9):
            records.save(record_of(number, number, "A", Verdict.PASS, 10.0, 11.0))
        with pytest.raises(DBAPIError, match="lock timeout"):
            sum_up(engine)
        assert stretches(engine) == []
        slow.commit()
    assert sum_up(engine) == 2
    found = line_statistics(engine, StatisticsRequest())
    assert (found.selection.count, found.selection.verdicts[Verdict.FAIL]) == (8, 1)
    engine.dispose()


def test_stations_that_sum_up_at_once_do_it_once(server: str) -> None:
    engine = open_database(server)
    for number in range(1, 41):
        Records(engine).save(record_of(number, number, "A", Verdict.PASS, 10.0, 11.0))
    done: list[int] = []
    stations = [threading.Thread(target=lambda: done.append(sum_up(engine))) for _ in range(3)]
    for station in stations:
        station.start()
    for station in stations:
        station.join()
    assert (sum(done), len(stretches(engine))) == (8, 8)
    assert line_statistics(engine, StatisticsRequest()).parameters["r"].distribution.count == 40
    engine.dispose()


def test_a_batch_s_end_sums_up_here_and_on_the_server(server: str, tmp_path: Path) -> None:
    own = open_database(str(tmp_path / "records.sqlite"))
    writer = RecordWriter(own, Spool(tmp_path / "unstored", "records.sqlite"), server)
    for number in range(1, 8):
        writer.save(record_of(number, number, "A", Verdict.PASS, 10.0, 11.0))
    writer.close()
    assert writer.left.for_server == 0
    for reference in (str(tmp_path / "records.sqlite"), server):
        engine = open_database(reference)
        assert stretches(engine) == [(1, 5), (6, 7)]
        engine.dispose()


def test_a_long_batch_sums_up_before_its_end(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("bench.eol.store.forwarding._SUM_AFTER", 5)
    own = open_database(str(tmp_path / "records.sqlite"))
    writer = RecordWriter(own, Spool(tmp_path / "unstored", "records.sqlite"))
    for number in range(1, 6):
        writer.save(record_of(number, number, "A", Verdict.PASS, 10.0, 11.0))
    until = threading.Event()
    for _ in range(600):
        if stretches(own):
            break
        until.wait(0.05)
    assert stretches(own) == [(1, 5)]
    writer.close()


@pytest.mark.parametrize("by_command", [False, True])
@pytest.mark.parametrize(("serial", "second"), [("Gr\u00fcn-1", 2), ("Gr\u00fcn-1", 1), ("P-1", 1)])
def test_a_motor_whose_earlier_tests_have_another_spelling_counts_once(
    engine: Engine, records: Records, serial: str, second: int, by_command: bool
) -> None:
    for number, verdict in enumerate([Verdict.FAIL, Verdict.FAIL, *[Verdict.PASS] * 4], 1):
        of_it = number if number > 2 else 1
        records.save(replace(record_of(number, of_it, "B", verdict, 10.0, 11.0), test_number=1 + (number == 2)))
    # As programs before have kept it.
    with engine.begin() as connection:
        for number, spelling in ((1, 1), (2, second)):
            other = spellings(serial)[spelling]
            connection.execute(update(MOTOR).where(MOTOR.c.number == number).values(serial_number=other))
    sum_up(engine)
    if by_command:
        # Half of it full-width: no look-up knows that.
        with engine.begin() as connection:
            connection.execute(update(MOTOR).where(MOTOR.c.number == 1).values(serial_number=f"{serial[:-1]}１"))
        assert respell(engine) == 2
        assert respell(engine) == 0
        respelled = statistics(engine, ["B"], "big")
        assert isinstance(respelled, dict)
        assert (respelled["yields"], respelled["retested"]) == ([(4, 5), (4, 5)], 1)
    again = replace(record_of(7, 9, "B", Verdict.PASS, 10.0, 11.0), serial_number=spellings(serial)[1], test_number=3)
    assert records.save(again)
    assert not records.save(again), "forwarded twice"
    unsummed = statistics(engine, ["B"], "big")
    records.save(record_of(8, 8, "B", Verdict.PASS, 10.0, 11.0))
    assert isinstance(unsummed, dict)
    assert (unsummed["yields"], unsummed["retested"]) == ([(4, 5), (5, 5)], 1)
    sum_up(engine)
    summed = statistics(engine, ["B"], "big")
    assert isinstance(summed, dict)
    assert (summed["yields"], summed["retested"]) == ([(5, 6), (6, 6)], 1)
