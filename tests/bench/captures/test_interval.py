from pathlib import Path

import pytest

from bench.captures import CaptureError, read_capture

_ROWS = "0,1\n0.004,2\n0.008,4\n"


@pytest.mark.parametrize(
    "heading",
    [
        "Sample Interval,4e-6\n",
        "# sampling interval: 4 µs\n",
        "Sampling Period (us);4\n",
        "Sample rate: 250 kSa/s\n",
        "sampling frequency [Hz] = 250000\n",
        "X Increment,4.0E-06,s\n",
    ],
)
def test_a_time_in_another_unit_than_the_heading_states_is_refused(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"{heading}time (s),u (V)\n{_ROWS}", encoding="utf-8")
    with pytest.raises(
        CaptureError, match=r"line 1: the heading states a sampling interval of 4e-06 s.*steps of 0\.004 s"
    ):
        read_capture(path)
    path.write_text(f"{heading}time (ms),u (V)\n{_ROWS}", encoding="utf-8")
    assert read_capture(path).times()[-1] == pytest.approx(8e-6)


@pytest.mark.parametrize(
    "heading", ["Sample rate: 1 GSa/s\n", "Sample Interval,0\n", "Sampling mode,7\n", "time step 3\n"]
)
def test_an_interval_of_another_record_is_left_alone(tmp_path: Path, heading: str) -> None:
    path = tmp_path / "record.csv"
    path.write_text(f"{heading}time (s),u (V)\n{_ROWS}", encoding="utf-8")
    assert read_capture(path).times()[-1] == pytest.approx(0.008)
