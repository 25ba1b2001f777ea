"""Golden motors at the start of a shift and every few hours, limits from their history, warm-up."""

import math
import time
from contextlib import closing
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.eol.limits import ParameterLimits
from bench.eol.line.admission.golden_gate import GoldenGate
from bench.eol.line.preparation.line_file import load_line
from bench.eol.line.record_writer import open_record_writer, own_records
from bench.eol.line.warm_up import WarmUp
from bench.eol.plan import load_plan
from bench.eol.record import MeasuredFigure
from bench.eol.statistics.golden_limits import limits_of_history
from bench.eol.store.database import open_database
from bench.eol.store.golden_tests import GoldenTests, last_test_ended
from bench.eol.store.records import Records
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from tests.bench.eol.line.golden import NoGoldenTests, SetClock, gate_of, open_gate
from tests.bench.eol.motor_records import motor_record

MORNING = datetime(2026, 11, 24, 5, 30).astimezone()
TABLE = '\n[golden_test]\nserial_numbers = ["G-1", "G-2"]\nevery = 4.0\n'


def test_one_is_due_until_it_has_passed_and_again_after_some_hours(tmp_path: Path) -> None:
    now = MORNING
    gate = gate_of(tmp_path, TABLE, ["1", "2"], NoGoldenTests({"2": MORNING}), SetClock(lambda: now))
    assert "no golden motor has passed there" in str(gate.due("1"))
    assert gate.due("2") is None
    gate.done(motor_record(socket="1", golden=True, verdict=Verdict.PASS, ended=now))
    assert gate.due("1") is None
    now += timedelta(hours=4)
    assert "it is due every 4 h" in str(gate.due("1"))
    gate.done(motor_record(socket="1", golden=True, verdict=Verdict.PASS, ended=now))
    gate.done(motor_record(socket="1", golden=True, verdict=Verdict.FAIL, ended=now))
    assert gate.due("1") is not None, "the latest test counts"


def test_one_is_due_when_a_shift_begins(tmp_path: Path) -> None:
    now = MORNING
    table = f"{TABLE}shifts = [06:00:00, 22:00:00]\n"
    gate = gate_of(tmp_path, table, ["1"], NoGoldenTests({"1": MORNING - timedelta(minutes=5)}), SetClock(lambda: now))
    assert gate.due("1") is None
    now += timedelta(minutes=31)
    assert "the shift began at 06:00" in str(gate.due("1"))


def test_limits_from_history_hold_an_unchanged_station_and_find_a_change() -> None:
    random = np.random.default_rng(5)
    outside = 0
    for _ in range(2000):
        drawn = random.normal(10.0, 0.1, (4, 11))
        limits = limits_of_history({str(n): row[:10].tolist() for n, row in enumerate(drawn)})
        outside += any(not limits[str(n)].low <= row[10] <= limits[str(n)].high for n, row in enumerate(drawn))
        assert limits["0"].high < drawn[0, :10].mean() + 12.0 * drawn[0, :10].std(ddof=1)
    # One in a hundred by construction; binomial, six sigma.
    assert 2000 * 0.01 - 27 < outside < 2000 * 0.01 + 27
    counted = limits_of_history({"pole_pairs": [4.0] * 10})["pole_pairs"]
    assert math.isclose(counted.low, 4.0, rel_tol=1e-5)
    assert not counted.low <= 5.0 <= counted.high


def kept_golden(bench: Any, value: float) -> None:
    """Five passed golden tests at each socket, with a resistance about a value."""
    engine = open_database(bench.request.records)
    for socket in "12":
        for number in range(1, 6):
            figure = MeasuredFigure(
                "stator_resistance", value * (1.0 + 1e-4 * number), "Ω", 1e-4, 2e-4, 0.0, 1.0, Verdict.PASS
            )
            Records(engine).save(
                motor_record(
                    number,
                    identifier=f"golden {socket} {number}",
                    batch="before",
                    plan="small",
                    station="virtual line",
                    socket=socket,
                    serial_number="G-1",
                    verdict=Verdict.PASS,
                    golden=True,
                    measured=(figure,),
                )
            )
    engine.dispose()


def test_the_records_know_a_golden_motor_that_did_not_pass_since(tmp_path: Path) -> None:
    engine = open_database(str(tmp_path / "records.sqlite"))
    tests = GoldenTests(engine, "Pump", "S")
    passed: list[datetime | None] = []
    for number, verdict in enumerate((Verdict.PASS, Verdict.ABORTED, Verdict.ERROR, Verdict.PASS, Verdict.FAIL)):
        ended = MORNING + timedelta(minutes=number)
        Records(engine).save(motor_record(number, golden=True, verdict=verdict, started=MORNING, ended=ended))
        passed.append(tests.last_passed("1", MORNING + timedelta(hours=1)))
    engine.dispose()
    later = MORNING + timedelta(minutes=3)
    assert passed == [MORNING, MORNING, None, later, None]


def test_a_station_whose_file_began_anew_has_its_golden_history_from_the_server(tmp_path: Path, server: str) -> None:
    """Its own file has the latest two of six tests; the server has all but the very last, which waits there."""
    address, figure = str(tmp_path / "records.sqlite"), MeasuredFigure("r", 1.0, "Ω", 0.1, 0.2, 0.0, 9.0, Verdict.PASS)
    for reference, numbers in ((server, range(1, 6)), (address, (5, 6))):
        engine = open_database(reference)
        for number in numbers:
            began = MORNING + timedelta(hours=number)
            golden = motor_record(
                number, serial_number="G-1", golden=True, verdict=Verdict.PASS, started=began, ended=began,
                measured=(replace(figure, value=float(number)),),
            )  # fmt: skip
            Records(engine).save(golden)
            other = replace(golden, identifier=f"other {number}", station="T", measured=(replace(figure, value=100.0),))
            Records(engine).save(other)
        engine.dispose()
    with closing(open_record_writer(server, tmp_path)) as writer:
        tests = writer.golden_tests("Pump", "S")
        assert tests.history("1", "G-1", 6, None) == {"r": [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]}
        assert tests.history("1", "G-1", 2, None) == {"r": [5.0, 6.0]}, "enough of its own"
        assert tests.history("1", "G-1", 7, None) == {}
    with closing(open_record_writer("postgresql://nobody@127.0.0.1:9/none", tmp_path)) as away:
        assert away.golden_tests("Pump", "S").history("1", "G-1", 6, None) == {}


def test_a_figure_without_a_history_keeps_the_plan_s_limits(tmp_path: Path) -> None:
    plan = {"pole_pairs": ParameterLimits(4, 4), "stator_resistance": ParameterLimits(0.0, 1.0)}
    history = NoGoldenTests(figures={"stator_resistance": [0.01, 0.0101, 0.0102]})
    open_gate(tmp_path)
    gate = GoldenGate(load_plan(tmp_path / "gate.toml"), plan, ["1"], history)
    limits = gate.limits("G-1", "1")
    assert limits["pole_pairs"] == plan["pole_pairs"]
    assert 0.0 < limits["stator_resistance"].low < 0.0101 < limits["stator_resistance"].high < 1.0


@pytest.mark.slow
def test_a_golden_motor_outside_its_own_history_stops_its_sockets(bench: Any) -> None:
    table = '\n[golden_test]\nserial_numbers = ["G-1"]\nevery = 1.0\ntests = 5\n'
    plan = bench.request.plan
    plan.write_text(plan.read_text(encoding="utf-8") + table, encoding="utf-8")
    kept_golden(bench, 0.010)
    counts, stopped = bench.run()
    assert (counts.motors, counts.unfinished, stopped) == (0, True, "")
    assert counts.golden["fail"] == 4, "each socket tests it twice"
    assert {brake.socket for brake in counts.brakes} == {"1", "2"}
    assert all("no golden motor passed there in 2 tests" in str(brake.why) for brake in counts.brakes)
    with own_records(bench.request.records) as records:
        (figure,) = [m for m in next(iter(records.read("small"))).measured if m.parameter == "stator_resistance"]
    assert 0.0099 < figure.low < 0.0100 < figure.high < 0.0102


@pytest.mark.slow
def test_golden_motors_come_first_and_count_in_no_yield(bench: Any) -> None:
    table = '\n[golden_test]\nserial_numbers = ["G-1", "G-2"]\nevery = 1.0\n'
    plan = bench.request.plan
    plan.write_text(plan.read_text(encoding="utf-8") + table, encoding="utf-8")
    counts, _ = bench.run(motors=2)
    assert (counts.motors, counts.by_motor.motors, counts.golden["pass"]) == (2, 2, 2)
    for socket in "12":
        golden = [record.golden for record in bench.listener.records if record.socket == socket]
        # A slow socket may leave both motors to the other; none tests one before its golden motor.
        assert golden[0]
        assert not any(golden[1:])
    bench.listener.records.clear()
    counts, _ = bench.run("A1\n", motors=None, batch="next")
    assert [record.serial_number for record in bench.listener.records] == ["A1"], "they passed a moment ago"
    plan.write_text(plan.read_text(encoding="utf-8").replace('"G-1", "G-2"', '"G-9"').replace('"small"', '"other"'))
    bench.listener.records.clear()
    counts, _ = bench.run("B1\nG-9\ng-9\nB2\n", motors=None, sockets=1)
    assert [record.serial_number for record in bench.listener.records] == ["G-9", "G-9", "B2"]
    assert "a golden motor (G-9) is due at socket 1" in str(bench.listener.refusals[0].why)


def test_a_line_that_was_idle_warms_up_and_a_virtual_one_is_warm(bench: Any) -> None:
    now = datetime(2026, 11, 24, 6, tzinfo=UTC)
    virtual = load_line("virtual", 1)
    line = replace(virtual, warm_up=1200.0, cold_after=4.0)
    assert WarmUp(line, None, SetClock(lambda: now)).until is None
    station = bench.folder / "station.toml"
    station.write_text(
        '[station]\nname = "s"\n[line]\nwarm_up = 1200.0\n[instruments.lcr_meter]\ndriver = "keysight-e4980a"\n'
        'address = "TCPIP0::10.0.0.9::inst0::INSTR"\n',
        encoding="utf-8",
    )
    real = load_line(str(station), None)
    assert WarmUp(real, now - timedelta(hours=3), SetClock(lambda: now)).until is None
    cold = WarmUp(real, now - timedelta(hours=5), SetClock(lambda: now))
    assert cold.waits
    assert "--warm --person NAME" in str(cold.words)
    now += timedelta(seconds=1200)
    assert not cold.waits
    running = timedelta(hours=1)
    set_meanwhile = WarmUp(real, None, SetClock(lambda: now, lambda: running))
    now -= timedelta(days=300)
    running += timedelta(seconds=1199)
    assert set_meanwhile.waits
    running += timedelta(seconds=1)
    assert not set_meanwhile.waits, "a clock that is put back meanwhile keeps no line waiting for a year"
    now += timedelta(days=600)
    assert WarmUp(real, None, SetClock(lambda: now, lambda: running)).waits
    ahead = WarmUp(real, now + timedelta(days=400), SetClock(lambda: now))
    assert ahead.waits, "the clock was put back: nobody knows when that was"


def test_a_clock_that_was_put_back_leaves_no_gate_open(tmp_path: Path) -> None:
    now = MORNING
    gate = gate_of(tmp_path, TABLE, ["1"], NoGoldenTests({"1": MORNING}), SetClock(lambda: now))
    now = MORNING - timedelta(minutes=2)
    assert gate.due("1") is None, "a clock that is kept right steps a little"
    now = MORNING - timedelta(hours=1)
    assert "which is still to come: the clock was put back" in str(gate.due("1"))
    engine = open_database(str(tmp_path / "records.sqlite"))
    tests = GoldenTests(engine, "Pump", "S")

    def last_passed(number: int, ended: datetime, verdict: Verdict) -> datetime | None:
        Records(engine).save(motor_record(number, golden=True, verdict=verdict, started=MORNING, ended=ended))
        return tests.last_passed("1", MORNING + timedelta(hours=1))

    assert last_passed(1, MORNING, Verdict.PASS) == MORNING
    ahead = MORNING + timedelta(days=400)
    assert last_passed(2, ahead, Verdict.PASS) is None
    assert last_passed(3, MORNING, Verdict.PASS) == MORNING, "and it is over with the next one"
    assert last_passed(4, ahead, Verdict.FAIL) is None, "a failure counts, whatever time it bears"
    assert last_test_ended(engine, "S") == ahead
    assert last_passed(5, MORNING, Verdict.PASS) == MORNING
    assert last_test_ended(engine, "S") == MORNING, "no line is cold for a year by one test of the time to come"
    later = MORNING + timedelta(minutes=20)
    assert last_passed(6, later, Verdict.FAIL) is None
    assert last_passed(7, MORNING, Verdict.PASS) is None, "an archive put it back, behind the failure after it"
    assert last_passed(8, later + timedelta(minutes=5), Verdict.PASS) == later + timedelta(minutes=5)
    engine.dispose()


@pytest.mark.parametrize(("step", "said"), [(-3, "put back by 176 min"), (3, "set forward by 184 min")])
def test_a_clock_that_is_set_during_a_batch_has_a_golden_motor_come(tmp_path: Path, step: int, said: str) -> None:
    """The pass is not to come by either clock, and the shift and the hours are those of the wrong one."""
    now, running = MORNING + timedelta(hours=7), timedelta(days=3)
    table = f"{TABLE.replace('4.0', '24.0')}shifts = [06:00:00]\n"
    clock = SetClock(lambda: now, lambda: running)
    gate = gate_of(tmp_path, table, ["1", "2"], NoGoldenTests(dict.fromkeys("12", now - timedelta(hours=5))), clock)
    assert gate.due("1") is None
    now, running = now + timedelta(minutes=10), running + timedelta(minutes=6)
    assert gate.due("1") is None, "a clock that is kept right steps a little"
    now += timedelta(hours=step)
    assert said in str(gate.due("1"))
    gate.done(motor_record(socket="1", golden=True, verdict=Verdict.PASS, ended=now))
    assert gate.due("1") is None, "one that passes by the clock as it is now opens the line"
    assert gate.due("2") is not None
    now -= timedelta(hours=step)
    assert gate.due("1") is not None
    assert gate.due("2") is None, "as it stood when one passed there"


def test_a_gate_that_a_shift_has_closed_is_not_opened_by_putting_the_clock_back(tmp_path: Path) -> None:
    now, running = MORNING, timedelta(days=3)
    clock = SetClock(lambda: now, lambda: running)
    table = f"{TABLE}shifts = [06:00:00, 22:00:00]\n"
    gate = gate_of(tmp_path, table, ["1"], NoGoldenTests({"1": MORNING - timedelta(minutes=5)}), clock)
    now, running = now + timedelta(minutes=31), running + timedelta(minutes=31)
    assert "the shift began at 06:00" in str(gate.due("1"))
    now -= timedelta(minutes=9)
    assert "the clock was put back by 9 min" in str(gate.due("1"))


@pytest.mark.parametrize(
    ("zone", "passed", "open_until", "due_from"),
    [
        # Over midnight, in a night shift; and the nights on which the hour from 2 is left out, or comes twice.
        ("Europe/Berlin", "2026-11-24T20:59:00Z", "2026-11-24T20:59:30Z", "2026-11-24T21:00:00Z"),
        ("Europe/Berlin", "2026-11-24T21:00:01Z", "2026-11-25T04:59:59Z", "2026-11-25T05:00:00Z"),
        ("Europe/Berlin", "2026-03-28T21:00:00Z", "2026-03-29T03:59:59Z", "2026-03-29T04:00:00Z"),
        ("Europe/Berlin", "2026-10-24T20:00:00Z", "2026-10-25T04:59:59Z", "2026-10-25T05:00:00Z"),
        ("America/New_York", "2026-11-01T02:00:00Z", "2026-11-01T10:59:59Z", "2026-11-01T11:00:00Z"),
    ],
)
def test_a_night_shift_over_midnight_and_the_nights_the_clock_is_changed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, zone: str, passed: str, open_until: str, due_from: str
) -> None:
    with monkeypatch.context() as here:
        here.setenv("TZ", zone)
        time.tzset()
        now = datetime.fromisoformat(passed)
        table = f"{TABLE.replace('4.0', '24.0')}shifts = [06:00:00, 14:00:00, 22:00:00]\n"
        gate = gate_of(tmp_path, table, ["1"], NoGoldenTests({"1": now}), SetClock(lambda: now))
        now = datetime.fromisoformat(open_until)
        assert gate.due("1") is None
        now = datetime.fromisoformat(due_from)
        assert "the shift began at" in str(gate.due("1"))
    time.tzset()


def test_a_pass_before_the_clock_was_put_back_does_not_open_the_next_batch(tmp_path: Path) -> None:
    engine = open_database(str(tmp_path / "records.sqlite"))
    tests, records = GoldenTests(engine, "Pump", "S"), Records(engine)
    records.save(motor_record(1, golden=True, verdict=Verdict.PASS, started=MORNING, ended=MORNING))
    noon = MORNING + timedelta(hours=6)
    records.save(motor_record(2, verdict=Verdict.PASS, started=noon, ended=noon))
    assert tests.last_passed("1", noon) == MORNING
    assert tests.last_passed("1", noon - timedelta(hours=1)) is None, "five hours by a clock that was put back"
    other = motor_record(3, verdict=Verdict.PASS, station="T", started=noon, ended=noon + timedelta(days=1))
    records.save(other)
    assert tests.last_passed("1", noon) == MORNING, "another station's clock"
    records.save(motor_record(4, golden=True, verdict=Verdict.PASS, started=MORNING, ended=MORNING))
    assert tests.last_passed("1", noon - timedelta(hours=1)) == MORNING, "and it is over with the next one"
    engine.dispose()


def test_a_golden_motor_is_the_same_however_its_letters_are_sent(tmp_path: Path) -> None:
    gate = gate_of(tmp_path, TABLE.replace("G-1", "Gu\u0308-1"), ["1"])
    assert gate.is_golden("G\u00fc-1")
    with pytest.raises(InputError, match="stands there once"):
        gate_of(tmp_path, TABLE.replace("G-1", "Gu\u0308-1").replace("G-2", "G\u00fc-1"), ["1"])
