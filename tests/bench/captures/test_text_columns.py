"""Tables with remarks, blank rows and columns that a spreadsheet left empty."""

from pathlib import Path

import pytest

from bench.captures import Capture, CaptureError, read_capture


def read(folder: Path, content: str, abscissa: str = "current") -> Capture:
    file = folder / "table.csv"
    file.write_text(content, encoding="utf-8")
    return read_capture(file, abscissa=abscissa)


@pytest.mark.parametrize(
    ("content", "left_out"),
    [
        ("No;I (mA);U (V);Remark\n1;-100,5;-0,2;\n2;100,5;0,2;ok\n", "Remark"),
        ("No,I,U,Remark\n,mA,V,\n1,-100.5,-0.2,\n2,100.5,0.2,ok\n", "Remark"),
        ("No\tI (mA)\tby\tU (V)\n1\t-100.5\tme\t-0.2\n2\t100.5\tme\t0.2\n", "by"),
        ("No;I (mA);;U (V)\n1;-100.5;;-0.2\n2;100.5;;0.2\n", "3"),
    ],
)
def test_a_column_without_a_number_is_left_out_and_the_heading_still_counts(
    tmp_path: Path, content: str, left_out: str
) -> None:
    table = read(tmp_path, content)
    assert [channel.name for channel in table.channels] == ["No", "I", "U"]
    assert table.channel("I").values == pytest.approx([-0.1005, 0.1005])
    assert table.channel("U").values == pytest.approx([-0.2, 0.2])
    assert any(f"column '{left_out}' holds no number" in str(said) for said in table.assumptions)


def test_times_keep_their_unit_beside_a_column_of_remarks(tmp_path: Path) -> None:
    record = read(tmp_path, "time (ms),U (V),Remark\n0,1,\n1,2,start\n2,1,\n", "time")
    assert record.times() == pytest.approx([0.0, 1e-3, 2e-3])


def test_blank_rows_of_a_table_are_passed_over_and_lines_keep_their_numbers(tmp_path: Path) -> None:
    head = "I (A),U (V)\n1,2\n2,4\n\n-1,-2\n,,\n-2,-4\n-3,-6\n"
    table = read(tmp_path, head)
    assert table.channel("I").values == pytest.approx([1, 2, -1, -2, -3])
    with pytest.raises(CaptureError, match=r"table\.csv, line 9: '3,x' is not a row of 2 numbers"):
        read(tmp_path, head + "3,x\n")


def test_a_broken_value_is_no_text_column(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="line 3: '2,x' is not a row of 2 numbers"):
        read(tmp_path, "I (A),U (V)\n1,2\n2,x\n")
    with pytest.raises(CaptureError, match="column 2 has no reading but over range"):
        read(tmp_path, "I (A),U (V)\n1,OL\n2,OL\n")


def test_a_row_of_units_counts_beside_a_unit_that_no_record_has(tmp_path: Path) -> None:
    table = read(tmp_path, "Angle,Torque,Temp\ndeg,mN·m,°C\n0,5,25.1\n180,6,25.2\n", "angle")
    assert [(channel.name, channel.unit) for channel in table.channels[:2]] == [("Angle", "rad"), ("Torque", "N·m")]
    assert table.channel("Torque").values == pytest.approx([5e-3, 6e-3])
    assert table.channel("Temp").values == pytest.approx([25.1, 25.2])
