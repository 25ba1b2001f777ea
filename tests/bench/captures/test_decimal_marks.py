"""Numbers that may be thousands or decimals are refused with their cell; others are read."""

from pathlib import Path

import pytest

from bench.captures import CaptureError, read_capture
from bench.captures.decimal_marks import doubtful_number


@pytest.mark.parametrize(
    ("cells", "comma_between", "place"),
    [
        (["1,0", "500", "1.000"], False, 2),
        (["0.5", "1,000"], False, 1),
        (["1.000", "2,000"], False, 0),
        (["1,000", "2"], True, 0),
        (["1,5e-3", "1.000"], False, 1),
        (["1.000", "2.000"], False, None),
        (["1,000", "2,000"], False, None),
        (["0,5", "0.125", "12.5"], False, None),
        (["1.000", "500,x"], False, None),
    ],
)
def test_a_number_with_the_other_mark_is_doubtful(cells: list[str], comma_between: bool, place: int | None) -> None:
    found = doubtful_number(cells, comma_between=comma_between)
    assert (found and found[0]) == place


def test_a_record_with_both_marks_names_the_cell(tmp_path: Path) -> None:
    path = tmp_path / "coast.csv"
    path.write_text("time (s);speed (rpm)\n0,0;2.865\n0,1;2.856\n0,2;2.848\n", encoding="utf-8")
    with pytest.raises(CaptureError, match=r"line 2: '2\.865' may mean 2865 or 2\.865"):
        read_capture(path)


def test_commas_for_both_are_named(tmp_path: Path) -> None:
    path = tmp_path / "coast.csv"
    path.write_text("time (s),speed (rpm)\n0,2864,8\n0,002,2855,9\n0,004,2848,2\n", encoding="utf-8")
    with pytest.raises(
        CaptureError, match="line 2: rows have up to 4 numbers under 2 headings, and no number has a dot: the comma"
    ):
        read_capture(path)
