"""Motors in a row that did not pass stop a socket or the line, said in words and by the exit status."""

import json
import os
import signal
from collections.abc import Sequence
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.cli.main import main
from bench.eol.line.brakes import Brakes
from bench.eol.line.record_writer import own_records
from bench.eol.plan_file import BrakeSection
from bench.eol.record import MotorRecord
from bench.eol.verdict import Verdict
from tests.bench.eol.loaded_workers import loaded_workers
from tests.bench.eol.motor_records import motor_record

RULE = BrakeSection(socket_fails=3, socket_errors=2, line_fails=4, line_errors=3)


def stops(rule: BrakeSection, tests: Sequence[tuple[str, str]]) -> list[tuple[int, str]]:
    """After which of some tests (socket, verdict) which socket, or the line, was stopped."""
    brakes = Brakes(rule)
    return [
        (number, brake.socket)
        for number, (socket, verdict) in enumerate(tests, 1)
        for brake in brakes.observe(motor_record(number, socket=socket, verdict=Verdict(verdict)))
    ]


@pytest.mark.parametrize(
    ("verdicts", "stopped"),
    [
        ("fail fail fail", [(3, "1")]),
        ("fail fail pass fail fail", []),
        ("error error", [(2, "1")]),
        ("error fail error", [(3, "1")]),
        ("fail aborted fail aborted fail", [(5, "1")]),
        ("pass fail fail error", [(4, "1")]),
    ],
)
def test_a_row_at_one_socket(verdicts: str, stopped: list[tuple[int, str]]) -> None:
    assert stops(RULE, [("1", verdict) for verdict in verdicts.split()]) == stopped


def test_a_row_over_the_line_stops_it() -> None:
    assert stops(RULE, [(socket, "error") for socket in "123"]) == [(3, "")]
    assert stops(RULE, [(socket, "fail") for socket in "1234"]) == [(4, "")]
    assert stops(RULE, [("1", "fail"), ("2", "pass")] * 3) == [(5, "1")], "one bad socket among good ones"


@given(st.lists(st.tuples(st.sampled_from("12"), st.sampled_from(["pass", "fail", "error", "aborted"])), max_size=30))
def test_nothing_is_stopped_where_the_plan_has_it_so(tests: list[tuple[str, str]]) -> None:
    assert stops(BrakeSection(socket_fails=0, socket_errors=0, line_fails=0, line_errors=0), tests) == []


def run_command(bench: Any, *words: str) -> int | None:
    with loaded_workers(), pytest.raises(SystemExit) as ended:
        main(
            [
                *("eol", "run", str(bench.request.plan), "--station", bench.request.station),
                *("--runs", str(bench.folder / "runs"), "--records", bench.request.records, *words),
            ]
        )
    code = ended.value.code
    assert code is None or isinstance(code, int)
    return code


def test_ten_of_ten_that_cannot_be_measured_stop_the_line(bench: Any, capsys: pytest.CaptureFixture[str]) -> None:
    plan = bench.request.plan
    plan.write_text(
        plan.read_text(encoding="utf-8").replace("minimum_ratio = 0.0", "minimum_ratio = 900.0")
        + "\n[brakes]\nsocket_errors = 0\nline_errors = 3\n",
        encoding="utf-8",
    )
    assert run_command(bench, "--motors", "10", "--json") == 3
    out, err = capsys.readouterr()
    summary = json.loads(out)
    assert 3 <= summary["error"] <= 4, "what was under way came to its end"
    assert (summary["unfinished"], summary["stopped"]) == (True, "")
    (brake,) = summary["brakes"]
    assert brake["socket"] == ""
    assert "the line takes no more motors: 3 motors in a row could not be measured, the last one was V" in brake["why"]
    assert "its uncertainty is too large" in err
    assert err.count("the line takes no more motors") == 1
    assert "the plan's [brakes] ended the batch" in err


@pytest.mark.slow
def test_a_batch_that_is_done_says_what_goes_on(bench: Any, capsys: pytest.CaptureFixture[str]) -> None:
    assert run_command(bench, "--motors", "1") == 0
    assert "nothing is left" not in capsys.readouterr().err
    assert run_command(bench, "--motors", "1") == 0
    assert "nothing is left to test: all motors of this batch are on record" in capsys.readouterr().err


def kept(bench: Any) -> list[MotorRecord]:
    with own_records(bench.request.records) as records:
        return list(records.read("small"))


def test_a_socket_that_is_stopped_leaves_the_motors_to_the_others(bench: Any) -> None:
    plan = bench.request.plan
    plan.write_text(plan.read_text(encoding="utf-8") + "\n[brakes]\nsocket_errors = 1\n", encoding="utf-8")
    killed: list[str] = []

    def kill(motor: Any) -> None:
        if motor.number == 2:
            killed.append(motor.serial_number)
            os.kill(max(bench.workers()), signal.SIGKILL)

    bench.listener.when_begun = kill
    counts, stopped = bench.run(motors=5)
    assert (counts.motors, counts.unfinished, stopped) == (5, False, "")
    (brake,) = counts.brakes
    lost = next(record for record in kept(bench) if record.verdict is Verdict.ERROR)
    assert brake.socket == lost.socket
    later = [record for record in kept(bench) if record.verdict is Verdict.PASS]
    assert len(later) == 4
    assert sum(record.socket == lost.socket for record in later) == 0
