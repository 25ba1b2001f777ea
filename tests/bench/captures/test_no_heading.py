"""Plain tables whose heading stands behind a comment mark, that have none, or that have results beside the first rows."""

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from bench.analysis.map_table import read_table
from bench.analysis.table_headings import KnownColumn
from bench.captures import Capture, CaptureError, CapturePart, read_capture

TIMES, SPEEDS = np.arange(40) * 0.01, 300.0 - np.arange(40)


def saved(header: str, delimiter: str = ",", *columns: np.ndarray) -> str:
    """As `numpy.savetxt` writes a table: its heading is a comment."""
    made = io.StringIO()
    np.savetxt(made, np.column_stack(columns or (TIMES, SPEEDS)), fmt="%.4f", delimiter=delimiter, header=header)
    return made.getvalue()


def read(folder: Path, content: str, **how: Any) -> Capture:
    (folder / "table.csv").write_text(content, encoding="utf-8")
    return read_capture(folder / "table.csv", **how)


@pytest.mark.parametrize(
    ("header", "delimiter"),
    [
        ("time (ms),speed (rpm)", ","),
        ("rotor 3, warm\ntime (ms),speed (rpm)", ","),
        ("time,speed\nms,rpm", ","),
        ("time_ms speed_rpm", " "),
        ("time (ms);speed (rpm)", ";"),
    ],
)
def test_a_heading_behind_a_comment_mark_is_the_heading(tmp_path: Path, header: str, delimiter: str) -> None:
    record = read(tmp_path, saved(header, delimiter))
    assert record.times() == pytest.approx(TIMES * 1e-3, abs=1e-9)
    assert [(each.name, each.unit) for each in record.channels] == [("speed", "rad/s")]
    assert record.channel("speed").values == pytest.approx(SPEEDS * np.pi / 30.0)


@pytest.mark.parametrize("header", ["run 7", "taken at 3,5 bar", "1,2", "a,b,c"])
def test_a_remark_is_no_heading(tmp_path: Path, header: str) -> None:
    record = read(tmp_path, saved(header))
    assert [each.name for each in record.channels] == ["column 2"]
    assert "no heading" in str(record.assumptions[0])


def test_a_heading_behind_a_comment_mark_heads_a_table_of_figures(tmp_path: Path) -> None:
    path = tmp_path / "map.csv"
    path.write_text(saved("id (A),psi_d (mVs)"), encoding="utf-8")
    known = {"id": KnownColumn("A", ("id",)), "psi": KnownColumn("V·s", ("psid",))}
    table = read_table(path, known, ("id", "psi"))
    assert table["id"] == pytest.approx(TIMES)
    assert table["psi"] == pytest.approx(SPEEDS * 1e-3)


def test_where_no_heading_calls_a_first_column_that_falls_a_time_the_one_that_rises_is_named(tmp_path: Path) -> None:
    rows = saved("", " ", 24.8 - TIMES, SPEEDS, 1e4 * TIMES).replace("#", "")
    with pytest.raises(
        CaptureError, match=r"line 2: .*24\.8 is followed by 24\.79.*--time-column 3 if that is the time"
    ):
        read(tmp_path, rows)
    record = read(tmp_path, rows, selection=CapturePart(time_column="3", time_unit="ms"))
    assert record.times() == pytest.approx(10.0 * TIMES)
    assert [each.name for each in record.channels] == ["column 1", "column 2"]
    assert not any("first column" in str(said) for said in record.assumptions)


def test_results_beside_the_first_rows_are_left_out_and_named(tmp_path: Path) -> None:
    rows = [f"{k},{5.0 + 0.1 * k},{',' if k else '7.5,2.5'}" for k in range(24)]
    table = read(tmp_path, "\n".join(["angle (deg),L (mH),Ld,Lq", *rows]), abscissa="angle")
    assert [each.name for each in table.channels] == ["angle", "L"]
    assert table.channel("L").values == pytest.approx((5.0 + 0.1 * np.arange(24)) * 1e-3)
    assert sum("has 1 numbers" in str(said) for said in table.assumptions) == 2


def test_readings_that_are_missing_in_some_rows_are_no_results(tmp_path: Path) -> None:
    rows = [f"{k},{5.0 + 0.1 * k},{'' if k % 3 else k}" for k in range(24)]
    with pytest.raises(CaptureError, match=r"line 3: .*is not a row of 3 numbers"):
        read(tmp_path, "\n".join(["angle (deg),L (mH),Lq (mH)", *rows]), abscissa="angle")
