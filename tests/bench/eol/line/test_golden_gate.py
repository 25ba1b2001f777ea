"""Golden motors at the start of a shift and every few hours, limits from their history, warm-up."""

import math
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
from tests.bench.eol.line.golden import NoGoldenTests, gate_of, open_gate
from tests.bench.eol.motor_records import motor_record

MORNING = datetime(2026, 11, 24, 5, 30).astimezone()
TABLE = '\n[golden_test]\nserial_numbers = ["G-1", "G-2"]\nevery = 4.0\n'


def test_one_is_due_until_it_has_passed_and_again_after_some_hours(tmp_path: Path) -> None:
    now = MORNING
    gate = gate_of(tmp_path, TABLE, ["1", "2"], NoGoldenTests({"2": MORNING}), lambda: now)
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
    gate = gate_of(tmp_path, table, ["1"], NoGoldenTests({"1": MORNING - timedelta(minutes=5)}), lambda: now)
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
    counts, _ = bench.run("B1\nG-9\nG-9\nB2\n", motors=None, sockets=1)
    assert [record.serial_number for record in bench.listener.records] == ["G-9", "G-9", "B2"]
    assert "a golden motor (G-9) is due at socket 1" in str(bench.listener.refusals[0].why)


def test_a_line_that_was_idle_warms_up_and_a_virtual_one_is_warm(bench: Any) -> None:
    now = datetime(2026, 11, 24, 6, tzinfo=UTC)
    virtual = load_line("virtual", 1)
    line = replace(virtual, warm_up=1200.0, cold_after=4.0)
    assert WarmUp(line, None, lambda: now).until is None
    station = bench.folder / "station.toml"
    station.write_text(
        '[station]\nname = "s"\n[line]\nwarm_up = 1200.0\n[instruments.lcr_meter]\ndriver = "keysight-e4980a"\n'
        'address = "TCPIP0::10.0.0.9::inst0::INSTR"\n',
        encoding="utf-8",
    )
    real = load_line(str(station), None)
    assert WarmUp(real, now - timedelta(hours=3), lambda: now).until is None
    cold = WarmUp(real, now - timedelta(hours=5), lambda: now)
    assert cold.waits
    assert "--warm --person NAME" in str(cold.words)
    now += timedelta(seconds=1200)
    assert not cold.waits
    ahead = WarmUp(real, now + timedelta(days=400), lambda: now)
    assert ahead.waits, "the clock was put back: nobody knows when that was"


def test_a_clock_that_was_put_back_leaves_no_gate_open(tmp_path: Path) -> None:
    now = MORNING
    gate = gate_of(tmp_path, TABLE, ["1"], NoGoldenTests({"1": MORNING}), lambda: now)
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


def test_a_golden_motor_is_the_same_however_its_letters_are_sent(tmp_path: Path) -> None:
    gate = gate_of(tmp_path, TABLE.replace("G-1", "Gu\u0308-1"), ["1"])
    assert gate.is_golden("G\u00fc-1")
    with pytest.raises(InputError, match="stands there once"):
        gate_of(tmp_path, TABLE.replace("G-1", "Gu\u0308-1").replace("G-2", "G\u00fc-1"), ["1"])
