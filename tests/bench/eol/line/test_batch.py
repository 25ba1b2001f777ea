"""Whole batches on virtual benches, each socket a process of its own."""

import io
import json
import os
import signal
import sqlite3
import threading
from collections import Counter
from collections.abc import Callable
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest

from bench.eol.line.admission.next_motor import RefusedSerial
from bench.eol.line.batch import run_batch
from bench.eol.line.batch_log import FILE
from bench.eol.line.counts import CountingListener, Counts
from bench.eol.line.record_writer import own_records
from bench.eol.motor_yield import MotorYield
from bench.eol.plan_file import RetestSection
from bench.eol.store.database import open_database
from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError, UsageError
from bench.journal.events.safety import GuardianShutdownDone
from bench.journal.guardian_record import GuardianRecord
from bench.journal.run_folder import RunFolder
from bench.journal.verification import Integrity as Untouched
from bench.journal.verify import verify
from bench.plugins.records import RecordOutputs
from drivers.interfaces.text import text
from tests.bench.eol.motor_records import motor_record
from tests.command_line import Call

if TYPE_CHECKING:
    from bench.eol.record import MotorRecord


def kept(bench: Any) -> "list[MotorRecord]":
    with own_records(str(bench.folder / "records.sqlite")) as records:
        return sorted(records.read("small"), key=lambda record: record.number)


@pytest.mark.slow
def test_the_same_seed_gives_the_same_records_however_the_sockets_are_scheduled(
    make_bench: Callable[[str], Any], timeless: Callable[..., Any]
) -> None:
    one, other = make_bench("one"), make_bench("other")
    counts, stopped = one.run()
    assert (counts.motors, stopped) == (4, "")
    # The second time every record is kept with a delay, so that the sockets ask in another order.
    pause = threading.Event()
    other.listener.when_done = lambda record: pause.wait(0.4 if record.number % 2 else 0.0) and None
    other.run()
    first, second = kept(one), kept(other)
    assert [timeless(record) for record in first] == [timeless(record) for record in second]
    assert {record.socket for record in first} == {"1", "2"}
    assert [len(record.checks) for record in first] == [2, 1, 2, 1], "every second motor has its pole pairs counted"
    resistances = {m.value for record in first for m in record.measured if m.parameter == "stator_resistance"}
    assert len(resistances) == 4
    for record in first:
        assert verify(RunFolder(one.folder / record.run), noted=record.journal_sha256).verdict is Untouched.UNTOUCHED


def test_a_worker_that_is_killed_costs_its_own_motor_and_no_other(bench: Any) -> None:
    killed: list[int] = []

    def kill(motor: Any) -> None:
        if motor.number == 2:
            killed.append(max(bench.workers()))
            os.kill(killed[0], signal.SIGKILL)

    bench.listener.when_begun = kill
    counts, stopped = bench.run(motors=3)
    records = kept(bench)
    assert stopped == ""
    assert len(killed) == 1
    assert [record.number for record in records] == [1, 2, 3]
    assert counts.verdicts[Verdict.ERROR.value] == 1, [record.cause for record in records]
    lost = next(record for record in records if record.verdict is Verdict.ERROR)
    assert "was ended by SIGKILL" in lost.cause
    assert all(record.verdict is Verdict.PASS for record in records if record is not lost)
    assert any("SIGKILL" in words for words in bench.listener.troubles)
    assert counts.no_verdict == {lost.serial_number}
    bench.listener.when_begun = lambda _: None
    counts, _ = bench.run(motors=3)
    assert (counts.verdicts[Verdict.PASS.value], counts.motors, counts.no_verdict) == (1, 1, set())


@pytest.mark.slow
def test_workers_that_are_there_outlive_what_they_come_from_and_new_ones_come_all_the_same(bench: Any) -> None:
    counts, _ = bench.run(motors=1, sockets=1)
    first = bench.fork_server.pid
    status = Path(f"/proc/{first}/status").read_text(encoding="ascii")
    assert "Threads:\t1\n" in status, "a fork would cut the other threads off"

    bench.listener.when_begun = lambda _: os.kill(first, signal.SIGKILL)
    counts, stopped = bench.run(motors=2, batch="during", sockets=1, again=True, person="Wang")
    assert (counts.verdicts[Verdict.PASS.value], stopped, bench.listener.troubles) == (2, "", [])

    bench.listener.when_begun = lambda _: None
    counts, stopped = bench.run(motors=2, batch="after", again=True, person="Wang")
    assert (counts.verdicts[Verdict.PASS.value], stopped, bench.listener.troubles) == (2, "", [])
    assert bench.fork_server.pid != first


def test_a_batch_that_was_stopped_goes_on_where_it_was(bench: Any) -> None:
    def stop(record: Any) -> None:
        if len(bench.listener.records) == 1:
            os.kill(os.getpid(), signal.SIGINT)

    bench.listener.when_done = stop
    counts, stopped = bench.run()
    assert stopped == "Ctrl-C"
    assert counts.motors < 4
    done = {record.number for record in kept(bench) if record.verdict is not Verdict.ABORTED}
    bench.listener.when_done = lambda _: None
    bench.listener.records.clear()
    bench.run()
    assert not done & {record.number for record in bench.listener.records}, "measured again"
    judged = [record.serial_number for record in kept(bench) if record.verdict is Verdict.PASS]
    assert sorted(judged) == [f"V{number:06d}" for number in range(1, 5)], "aborted motors are taken again by rule"
    again = {record.serial_number: record for record in kept(bench) if record.test_number > 1}
    aborted = {record.serial_number for record in kept(bench) if record.verdict is Verdict.ABORTED}
    assert again.keys() == aborted
    assert all(record.again_by == "" for record in again.values())
    bench.listener.records.clear()
    counts, _ = bench.run()
    assert (counts.motors, counts.refused, bench.listener.records) == (0, 0, []), "nothing is left to do"


def test_what_was_scanned_and_not_tested_when_a_batch_is_stopped_is_named(bench: Any) -> None:
    class Terminal(io.StringIO):
        def isatty(self) -> bool:
            return True

    bench.listener.when_begun = lambda _: os.kill(os.getpid(), signal.SIGINT)
    request = replace(bench.request, motors=None, sockets=1)
    _, stopped = run_batch(request, bench.listener, Terminal("A1\nA2\nA3\nA2\n"), bench.fork_server)
    assert stopped == "Ctrl-C"
    (told,) = [words for words in bench.listener.troubles if words.startswith("scanned and not tested")]
    assert "batch ended before: A2, A3. Scan them again" in told
    bench.listener.troubles.clear()
    bench.run("A2\nA3\n", motors=None, sockets=1)
    # Of a pipe whoever filled it knows what is in it.
    assert not any(words.startswith("scanned") for words in bench.listener.troubles)


def test_a_batch_whose_motors_were_tested_before_is_not_done(bench: Any, call: Call) -> None:
    """A script that hands over motors hears by the exit status that the batch has not tested them."""
    line = ("--station", str(bench.folder / "line.toml"), "--records", bench.request.records, "--json", "--runs")
    typed = ("eol", "run", str(bench.request.plan), *line, str(bench.request.runs), "--motors", "2")
    code, out, err = call(*typed)
    assert (code, json.loads(out)["untested"]) == (0, []), err
    assert call(*typed)[0] == 0, "the same batch again: nothing is left to test"
    code, out, _ = call(*typed, "--batch", "second")
    again = json.loads(out)
    assert (code, again["motors"], again["refused"]) == (1, 0, 2)
    assert again["untested"] == ["V000001", "V000002"]


def test_a_motor_that_was_refused_and_then_tested_is_not_missing() -> None:
    counts = Counts()
    listener = CountingListener(counts, RecordOutputs([], Path(), lambda _: None), RetestSection())
    listener.refused(RefusedSerial("A1", text("not now")))
    listener.refused(RefusedSerial("A2", text("not now")))
    listener.refused(RefusedSerial("A3", text("it is being measured"), taken=True))
    listener.done(motor_record(serial_number="A1", verdict=Verdict.PASS))
    assert (counts.refused, counts.untested) == (3, {"A2"})


def test_first_pass_is_of_motors_that_were_never_judged_before() -> None:
    yields = MotorYield()
    for serial, at_once in (("A1", True), ("A2", False), ("A3", True)):
        if serial == "A3":
            yields.judged_before(serial)
        # A person had A1 tested again after an error, which was no verdict.
        yields.add(motor_record(serial_number=serial, verdict=Verdict.PASS, first_pass=at_once, again_by="Wang"))
    yields.add(motor_record(serial_number="A1", verdict=Verdict.FAIL))
    assert (yields.motors, yields.new, yields.first_pass, yields.final) == (3, 2, 1, 2)


@pytest.mark.slow
def test_a_batch_of_motors_that_were_judged_before_gives_no_yield_at_the_first_test(bench: Any, call: Call) -> None:
    line = ("--station", str(bench.folder / "line.toml"), "--records", bench.request.records, "--runs")
    typed = ("eol", "run", str(bench.request.plan), *line, str(bench.request.runs), "--motors", "1", "--sockets", "1")
    assert "yield 100.0 % at the first test, 100.0 % at the last" in call(*typed)[1]
    again = call(*typed, "--batch", "second", "--again", "--person", "Wang")[1]
    assert "motors judged: 1, all judged before in earlier tests; yield 100.0 % at the last test" in again


def test_who_gave_a_batch_with_a_motor_in_error_hears_that_the_same_command_tests_it_again(
    bench: Any, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    def with_an_error(*_: object) -> tuple[Counts, str]:
        return Counts(Counter({"pass": 1, "error": 2}), no_verdict={"A2", "A3"}), ""

    monkeypatch.setattr("bench.cli.eol.run.run_batch", with_an_error)
    code, out, err = call("eol", "run", str(bench.request.plan), "--station", "virtual", "--json")
    assert (code, json.loads(out)["no_verdict"]) == (1, ["A2", "A3"])
    assert "motors without a verdict: 2. The same command tests them again" in err


def test_serial_numbers_that_may_not_be_measured_do_not_stop_the_line(bench: Any) -> None:
    counts, _ = bench.run("A1\nA 2\nA\x073\nA1\nA4\n", motors=None)
    assert sorted(record.serial_number for record in kept(bench)) == ["A1", "A4"]
    assert counts.refused == 3
    assert counts.untested == {"A 2", "A\x073"}, "A1 has its test"
    why = [str(refusal.why) for refusal in bench.listener.refusals]
    assert any("pattern" in words for words in why)
    assert any("printable" in words for words in why)
    assert any("A1" in words for words in why)


def test_a_serial_number_is_one_motor_s_however_its_letters_are_sent(bench: Any) -> None:
    counts, _ = bench.run("M\u00e9\nMe\u0301\n", motors=None)
    assert [record.serial_number for record in kept(bench)] == ["M\u00e9"]
    assert counts.refused == 1


def test_wrong_names_and_numbers_are_usage_errors(bench: Any) -> None:
    for wrong in (
        {"batch": "../x"},
        {"motors": 0},
        {"motors": 2, "serials": "file.txt"},
        {"sockets": 0},
        {"operator": "terminal"},
    ):
        with pytest.raises(UsageError):
            bench.run(**wrong)
    with pytest.raises(InputError, match="cannot be read"):
        bench.run(motors=None, serials=str(bench.folder / "none.txt"))


def test_a_database_of_a_newer_schema_is_refused_and_left_alone(bench: Any) -> None:
    path = bench.folder / "records.sqlite"
    open_database(str(path)).dispose()
    with closing(sqlite3.connect(path)) as connection, connection:
        connection.execute("UPDATE alembic_version SET version_num = '9999'")
        connection.execute("UPDATE compatibility SET least = '9999'")
    with pytest.raises(InputError, match="9999"):
        bench.run()
    assert not (bench.folder / "runs" / "small" / FILE).exists(), "nothing was begun"


def test_motors_whose_line_of_the_log_is_lost_give_their_numbers_to_no_others(bench: Any) -> None:
    """Records are on the disk before the log is: a power cut takes the log's last lines alone."""
    bench.run(motors=2)
    log = bench.request.runs / "small" / FILE
    log.write_bytes(b"".join(log.read_bytes().splitlines(keepends=True)[:1]))
    counts, _ = bench.run(motors=3)
    assert (counts.motors, counts.waits.anything) == (1, False)
    assert [(each.number, each.serial_number[-1]) for each in kept(bench)][2:] == [(3, "3")]


def test_a_motor_that_was_cut_off_comes_again_though_another_station_s_batch_of_the_name_has_its_number(
    make_bench: Callable[[str], Any],
) -> None:
    """Two stations of one plan, that keep their records in one file and each its runs in its own folder."""
    one, other = make_bench("one"), make_bench("other")
    one.run("A1\n", motors=None, sockets=1)
    log = one.request.runs / "small" / FILE
    with log.open("a", encoding="utf-8") as file:
        file.write('{"number": 2, "serial_number": "A2", "socket": "1"}\n')
    other.run("B1\nB2\n", motors=None, sockets=1, records=one.request.records)
    one.listener.records.clear()
    folder = one.request.runs / "small" / "000" / "000002-A2"
    folder.mkdir()
    guardian = GuardianRecord(folder)
    guardian.record(GuardianShutdownDone(seconds=1.0, failed=["supply could not be made safe (output_off): no reply"]))
    assert guardian.close()
    one.run("", motors=None, sockets=1)
    assert [(record.number, record.serial_number) for record in one.listener.records] == [(2, "A2")]
    said = "when this batch was cut off at A2, supply could not be made safe (output_off): no reply. It may still be on"
    assert [words.startswith(said) for words in one.listener.troubles].count(True) == 1


def test_what_another_batch_of_the_name_tested_is_not_tested_in_this_one(make_bench: Callable[[str], Any]) -> None:
    """A list that goes on, and a motor that is scanned: both are refused with the reason, and the exit status tells of them."""
    one, other = make_bench("one"), make_bench("other")
    one.run("A1\n", motors=None, sockets=1)
    shared = {"motors": None, "sockets": 1, "records": one.request.records}
    other.run("B1\n", **shared)
    serials = other.folder / "serials.txt"
    serials.write_text("B1\nA1\n", encoding="utf-8")
    counts, _ = other.run(serials=str(serials), **shared)
    assert (counts.motors, counts.untested) == (0, {"A1"}), "B1 is passed over: this batch has it"
    counts, _ = other.run("A1\nB1\n", **shared)
    assert (counts.refused, counts.untested) == (2, {"A1"})
    assert ["batch small is another one of the same name" in str(each.why) for each in other.listener.refusals] == [
        True,
        True,
        False,
    ]
