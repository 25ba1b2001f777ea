"""Many samples as few points whose line looks the same: the smallest and the largest of each stretch, never dropping a peak."""

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def extremes(values: FloatArray, points: int) -> NDArray[np.intp]:
    """Return the indices of at most `points` samples to draw, rising: each stretch's least and largest.

    `values` has one dimension; up to `points` samples are all drawn. NaN is drawn only where a stretch holds nothing else.
    """
    count = len(values)
    if count <= points:
        return np.arange(count)
    stretches = max(points // 2, 1)
    size = -(-count // stretches)
    rows = -(-count // size)
    table = np.pad(values, (0, rows * size - count), mode="edge").reshape(rows, size)
    starts = np.arange(rows) * size
    low = starts + np.argmin(np.where(np.isnan(table), np.inf, table), axis=1)
    high = starts + np.argmax(np.where(np.isnan(table), -np.inf, table), axis=1)
    return np.unique(np.minimum(np.concatenate([low, high]), count - 1))


def envelope(x: FloatArray, y: FloatArray, points: int = 1200) -> tuple[FloatArray, FloatArray]:
    """Return x and y (n,) themselves where they are few, else the extremes of at most `points` of them, and both ends."""
    kept = np.union1d(extremes(y, points), [0, y.size - 1]) if y.size else slice(None)
    return x[kept], y[kept]
