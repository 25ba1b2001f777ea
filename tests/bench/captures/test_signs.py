"""Numbers with other signs than those of ASCII, in other encodings, with their unit behind each value."""

import codecs
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bench.analysis.published import read_published
from bench.captures import Capture, CaptureError, read_capture
from bench.captures.encoding import decoded
from bench.captures.signs import plain_signs, without_blanks


def capture_of(tmp_path: Path, table: str) -> Capture:
    """Return the capture that a table makes."""
    file = tmp_path / "record.csv"
    file.write_text(table, encoding="utf-8")
    return read_capture(file)


@pytest.mark.parametrize(
    ("cells", "values"),
    [
        (("−1.5", "−2e−3"), (-1.5, -2e-3)),
        (("–1.5", "‐2"), (-1.5, -2.0)),
        (("－１．５", "＋２"), (-1.5, 2.0)),
        (("1\u202f234.5", "-12\u00a0345\u00a0678"), (1234.5, -12345678.0)),
        (("1\u2009234", "1'234'567.25"), (1234.0, 1234567.25)),
        (("1 234.5", "-12 345"), (1234.5, -12345.0)),
    ],
)
def test_numbers_are_read_as_they_are_meant(
    tmp_path: Path, cells: tuple[str, str], values: tuple[float, float]
) -> None:
    capture = capture_of(tmp_path, f"t (s);u (V)\n0;{cells[0]}\n1;{cells[1]}\n2;1\n")
    assert capture.channels[0].values[:2] == pytest.approx(values)


@given(st.integers(-(10**9), 10**9), st.sampled_from("\u00a0\u2007\u2009\u202f'’"))
def test_grouped_thousands_are_the_number(value: int, mark: str) -> None:
    grouped = f"{value:,}".replace(",", mark)
    assert plain_signs(grouped) == str(value)
    assert without_blanks(f"{value:,}".replace(",", " ")) == str(value)


def test_a_blank_between_columns_is_none_between_thousands(tmp_path: Path) -> None:
    capture = capture_of(tmp_path, "0 100 200\n1 100 200\n2 100 300\n")
    assert [channel.values[-1] for channel in capture.channels] == [100.0, 300.0]


def test_values_with_their_unit_are_converted(tmp_path: Path) -> None:
    capture = capture_of(tmp_path, "Time,CH1,CH2 (V)\n-800.0us,20mV,1.5\n0,1.5V,1.6\n1.2ms,-20 mV,1.7\n")
    assert capture.times() == pytest.approx([-8e-4, 0.0, 1.2e-3])
    assert not capture.time_unit_open
    assert capture.channels[0].unit == "V"
    assert capture.channels[0].values == pytest.approx([0.02, 1.5, -0.02])


def test_a_decimal_comma_and_a_unit(tmp_path: Path) -> None:
    capture = capture_of(tmp_path, "Time;CH1\n-0,5us;20,5mV\n0,0us;1,5mV\n")
    assert capture.times() == pytest.approx([-5e-7, 0.0])
    assert capture.channels[0].values == pytest.approx([0.0205, 0.0015])


@pytest.mark.parametrize("cell", ["5", "5A", "5 kg"])
def test_a_value_in_another_unit_is_refused_with_line_and_column(tmp_path: Path, cell: str) -> None:
    with pytest.raises(CaptureError, match=r"line 3.*column 2") as refused:
        capture_of(tmp_path, f"Time,CH1\n-1us,20mV\n0us,{cell}\n1us,20mV\n")
    assert cell in str(refused.value)


def test_a_cell_that_is_no_number_is_named_by_its_column(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match=r"line 3.*column 2: '1\.2\.3'"):
        capture_of(tmp_path, "t (s),u (V)\n0,1\n1,1.2.3\n2,1\n")


def test_decimal_commas_between_commas_are_refused_in_powers_of_ten_too(tmp_path: Path) -> None:
    with pytest.raises(CaptureError, match="the comma is used as decimal mark and as separator"):
        capture_of(tmp_path, "t (s),u (V)\n-8,0e-04,1,5\n-7,9e-04,1,6\n")


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-le", "utf-16-be", "utf-32", "cp1252"])
def test_usual_encodings_are_read(encoding: str) -> None:
    content = "t (µs);u (V)\r\n" + "0;1\r\n" * 50
    read = decoded(content.encode(encoding))
    assert read is not None
    assert read.removeprefix("\ufeff") == content


@pytest.mark.parametrize("raw", [b"t,u\n0,1\n\0\0\0\0", b"\0" * 5000, codecs.BOM_UTF8 + b"a\0"])
def test_zero_bytes_are_no_text(tmp_path: Path, raw: bytes) -> None:
    assert decoded(raw) is None
    file = tmp_path / "record.csv"
    file.write_bytes(raw)
    with pytest.raises(CaptureError, match="zero bytes"):
        read_capture(file)


def test_published_figures_with_decimal_commas(tmp_path: Path) -> None:
    file = tmp_path / "ld.csv"
    file.write_text("id (A);Ld (µH)\n−10,5;95,25\n0;101\n", encoding="utf-16")
    first = read_published(file)[0]
    assert (first.current, first.value) == (-10.5, pytest.approx(95.25e-6))
