from pathlib import Path

import numpy as np
import pytest

from bench.captures import CaptureError, CapturePart, read_capture
from bench.i18n.errors import UsageError


@pytest.fixture
def table(tmp_path: Path) -> Path:
    path = tmp_path / "record.csv"
    time = np.arange(100) * 1e-3
    np.savetxt(
        path, np.column_stack((np.cos(time), time)), delimiter=",", header="CH1 (V),clock (s)", comments="", fmt="%.9g"
    )
    return path


@pytest.mark.parametrize("column", ["clock", "Clock", "clock (s)", "2"])
def test_a_part_of_a_record_by_its_own_time(table: Path, column: str) -> None:
    capture = read_capture(table, selection=CapturePart(0.0105, 0.05, column))
    assert (capture.times()[0], capture.times()[-1]) == pytest.approx((0.011, 0.05))
    assert [c.name for c in capture.channels] == ["CH1"]
    assert capture.channels[0].values == pytest.approx(np.cos(capture.times()))
    assert capture.line_of(0) == 13
    assert any("cut: 40 of 100 samples" in note for note in map(str, capture.assumptions))


@pytest.mark.parametrize(
    ("column", "said"),
    [("3", r"allowed are CH1, clock, or a number from 1 to 2"), ("1", "it is in V; allowed is a column in s")],
)
def test_a_column_that_is_no_time_is_refused(table: Path, column: str, said: str) -> None:
    with pytest.raises(CaptureError, match=said):
        read_capture(table, selection=CapturePart(time_column=column))


def test_instants_outside_the_record_are_refused_with_where_it_lies(table: Path) -> None:
    with pytest.raises(CaptureError, match=r"select only 0 samples; the record lies between 0 s and 0\.099 s"):
        read_capture(table, selection=CapturePart(begin=1.0, time_column="clock"))


@pytest.mark.parametrize(("begin", "end"), [(0.2, 0.1), (0.1, 0.1)])
def test_a_begin_that_is_not_before_the_end_is_refused(begin: float, end: float) -> None:
    with pytest.raises(UsageError, match=rf"--from {begin:g} is not before --to 0\.1"):
        CapturePart(begin, end)


@pytest.mark.parametrize("bad", [float("nan"), float("inf")])
def test_instants_are_numbers(bad: float) -> None:
    with pytest.raises(UsageError, match=r"--from .*: allowed is a number of seconds"):
        CapturePart(begin=bad)


def test_a_format_with_a_time_of_its_own_takes_no_other(tmp_path: Path) -> None:
    path = tmp_path / "rs.csv"
    path.write_text("in s,C1 in V\n0,1\n1,2\n2,1\n", encoding="utf-8")
    with pytest.raises(CaptureError, match="states its time itself"):
        read_capture(path, selection=CapturePart(time_column="C1"))


@pytest.mark.parametrize(("said", "coupling"), [("DC", "dc"), ("AC", "ac"), ("", "")])
def test_a_file_that_says_its_coupling_counts(tmp_path: Path, said: str, coupling: str) -> None:
    path = tmp_path / "tek.csv"
    rows = [f"{k},{k % 2}" for k in range(4)]
    first = [f"Record Length,4,,{rows[0]}", f"Source,CH1,,{rows[1]}", f"Vertical Coupling,{said},,{rows[2]}"]
    path.write_text("\n".join([*first, f",,,{rows[3]}"]) + "\n", encoding="utf-8")
    assert read_capture(path).channels[0].coupling == coupling


def test_a_record_without_a_time_says_how_to_name_it(tmp_path: Path) -> None:
    path = tmp_path / "record.csv"
    path.write_text("n,u,i\n0,1,2\n1,1,2\n", encoding="utf-8")
    with pytest.raises(CaptureError, match="say which one it is with --time-column"):
        read_capture(path).times()


def test_the_column_that_is_named_time_is_taken_wherever_it_stands(table: Path) -> None:
    capture = read_capture(table)
    assert capture.times()[-1] == pytest.approx(0.099)
    assert [c.name for c in capture.channels] == ["CH1"]
    assert "time is column 'clock'" in map(str, capture.assumptions)


def test_a_unit_of_time_is_for_tables_that_say_none(tmp_path: Path) -> None:
    path = tmp_path / "rs.csv"
    path.write_text("in s,C1 in V\n0,1\n1,2\n2,1\n", encoding="utf-8")
    with pytest.raises(CaptureError, match="--time-unit ms: this format states its time itself"):
        read_capture(path, selection=CapturePart(time_unit="ms"))
