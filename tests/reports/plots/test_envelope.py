import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from reports.plots.envelope import envelope


@given(
    y=st.integers(1, 5000).flatmap(lambda n: arrays(np.float64, n, elements=st.floats(-1e6, 1e6))),
    points=st.integers(2, 400),
)
def test_no_peak_is_lost(y: np.ndarray, points: int) -> None:
    x = np.arange(y.size, dtype=np.float64)
    kept_x, kept_y = envelope(x, y, points)
    assert kept_x.size == kept_y.size
    assert kept_y.max() == y.max()
    assert kept_y.min() == y.min()
    assert (kept_x[0], kept_x[-1]) == (0.0, y.size - 1)
    assert np.all(np.diff(kept_x) > 0)
    assert np.array_equal(y[kept_x.astype(int)], kept_y)
    assert kept_x.size <= max(y.size if y.size <= points else points + 2, 2)
