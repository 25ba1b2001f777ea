import numpy as np
import pytest

from bench.captures.capture import Capture, CaptureChannel

TIME = np.arange(170_000) * 1e-6
VOLTS = np.round(10.0 * np.exp(-TIME / 0.05)) / 10.0


def deep(values: np.ndarray, *, clipped: bool | None = None) -> Capture:
    return Capture((CaptureChannel("CH1", "V", values, 0.1, clipped),), TIME, "deep.csv", "table", first_line=2)


def test_a_deep_record_keeps_samples_as_they_were_read() -> None:
    thin = deep(VOLTS).thinned()
    assert thin.times() == pytest.approx(TIME[::3])
    assert np.array_equal(thin.channels[0].values, VOLTS[::3])
    assert thin.channels[0].resolution == 0.1
    assert [str(note) for note in thin.assumptions] == ["the record has 170000 samples; one of every 3 is evaluated"]
    # A sample no longer lies in the line that it would be counted to.
    assert thin.line_of(5) is None


def test_a_shorter_record_stays() -> None:
    short = Capture((CaptureChannel("CH1", "V", VOLTS[:99_999]),), TIME[:99_999], "short.csv", "table")
    assert short.thinned() is short


def test_an_end_that_no_sample_left_shows_is_not_taken_for_one() -> None:
    assert deep(VOLTS, clipped=True).thinned().channels[0].ends == (VOLTS.min(), VOLTS.max())
    once = VOLTS.copy()
    once[1] = 2.0
    assert deep(once, clipped=True).thinned().channels[0].ends is None
