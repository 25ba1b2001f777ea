"""What loggers write in place of plain numbers: readings over range, and the time of day."""

from pathlib import Path

import numpy as np
import pytest

from bench.captures import Capture, CaptureError, ProbeFactor, read_capture


def capture_of(tmp_path: Path, table: str) -> Capture:
    """Return the capture that a table makes."""
    file = tmp_path / "record.csv"
    file.write_text(table, encoding="utf-8")
    return read_capture(file)


@pytest.mark.parametrize("mark", ["∞", "inf", "OL", "OVLD", "Overload", "+inf"])
def test_readings_over_range_count_as_clipped_at_the_column_s_end(tmp_path: Path, mark: str) -> None:
    capture = capture_of(tmp_path, f"t (s),u (V),i (A)\n0,1,0.0\n1,1,2.5\n2,1,{mark}\n3,1,2.0\n")
    voltage, current = capture.channels
    assert current.values == pytest.approx([0.0, 2.5, 2.5, 2.0])
    assert (current.clipped, current.ends) == (True, (0.0, 2.5))
    assert voltage.clipped is None
    assert "1 readings are marked as over range" in " ".join(map(str, capture.assumptions))


def test_a_reading_below_range_stands_at_the_lower_end(tmp_path: Path) -> None:
    capture = capture_of(tmp_path, "t (s),u (V),i (A)\n0,1,0.5\n1,1,-1.5\n2,1,-∞\n")
    assert capture.channels[1].values == pytest.approx([0.5, -1.5, -1.5])


@pytest.mark.parametrize("table", ["t (s),u (V)\n0,1\n∞,1\n2,1\n", "t (s),u (V)\n0,OL\n1,OL\n2,OL\n"])
def test_a_time_over_range_and_a_column_without_a_reading_are_refused(tmp_path: Path, table: str) -> None:
    with pytest.raises(CaptureError):
        capture_of(tmp_path, table)


@pytest.mark.parametrize(
    "stamps",
    [
        ("2026-11-26 23:59:59.999998", "2026-11-26 23:59:59.999999", "2026-11-27 00:00:00.000000"),
        ("2026-11-26T10:00:00.000001Z", "2026-11-26T10:00:00.000002Z", "2026-11-26T10:00:00.000003Z"),
        ("23:59:59.999998", "23:59:59.999999", "00:00:00.000000"),
        ("10:00:00,000001", "10:00:00,000002", "10:00:00,000003"),
    ],
)
def test_the_time_of_day_is_counted_from_the_first_sample(tmp_path: Path, stamps: tuple[str, str, str]) -> None:
    rows = "".join(f"{stamp};{value}\n" for stamp, value in zip(stamps, ("1", "2", "3"), strict=True))
    capture = capture_of(tmp_path, f"Timestamp;u (V)\n{rows}")
    assert capture.times() == pytest.approx([0.0, 1e-6, 2e-6], abs=1e-12)
    assert not capture.time_unit_open
    assert "time by the clock" in " ".join(map(str, capture.assumptions))


def test_a_probe_s_factor_makes_a_current_of_volts(tmp_path: Path) -> None:
    capture = capture_of(tmp_path, "t (s),CH1 (V),CH2 (V)\n0,1,0.1\n1,1,0.2\n2,1,0.3\n")
    current = capture.scaled({"CH2": ProbeFactor(10.0, "A")}).channel("CH2")
    assert current.unit == "A"
    assert current.values == pytest.approx(np.array([1.0, 2.0, 3.0]))
    in_amperes = capture.scaled({"CH2": ProbeFactor(10.0, "A")})
    with pytest.raises(CaptureError, match="converts volts to amperes"):
        in_amperes.scaled({"CH2": ProbeFactor(10.0, "A")})
