import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bench.journal.waveforms import StoredWaveform
from bench.panel.plots import POINTS, waveform_plot
from reports.plots.envelope import extremes

samples = arrays(np.float64, st.integers(0, 400), elements=st.floats(-1e6, 1e6))


@given(samples, st.integers(2, 60))
def test_no_peak_is_lost_and_no_point_made_up(values: np.ndarray, points: int) -> None:
    chosen = extremes(values, points)
    assert len(chosen) <= max(points, 2)
    assert np.all(np.diff(chosen) > 0)
    if len(values):
        drawn = values[chosen]
        assert (drawn.min(), drawn.max()) == (values.min(), values.max())


@given(st.integers(1000, 100_000), st.integers(0, 99_999))
def test_one_sample_that_sticks_out_is_drawn(count: int, place: int) -> None:
    values = np.zeros(count)
    values[place % count] = -5.0
    assert place % count in extremes(values, 500)


def test_missing_values_hide_nothing() -> None:
    values = np.full(10_000, np.nan)
    values[4321] = 1.0
    assert 4321 in extremes(values, 100)


def test_a_million_points_become_a_screen_full_and_zooming_shows_more() -> None:
    time = np.linspace(0.0, 1.0, 1_000_000)
    wave = StoredWaveform(time, np.sin(2000.0 * time), "V", 0.01, 1)
    current = StoredWaveform(time, np.cos(2000.0 * time), "A", 0.01, 4)
    whole = waveform_plot({"1": wave, "4": current})
    assert [len(series["data"]) <= POINTS for series in whole["series"]] == [True, True]
    assert [axis["name"] for axis in whole["yAxis"]] == ["V", "A"]
    assert [series["yAxisIndex"] for series in whole["series"]] == [0, 1]
    near = waveform_plot({"1": wave}, start=0.5, end=0.501)
    data = near["series"][0]["data"]
    assert 1000 <= len(data) <= 1004
    assert data[0][0] <= 0.5 <= data[1][0]
    assert data[-2][0] <= 0.501 <= data[-1][0]
