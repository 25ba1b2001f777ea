"""Long records for a screen: of every stretch the least and the largest, so that no peak is lost."""

import numpy as np
from numpy.typing import NDArray


def envelope(values: NDArray[np.float64], points: int) -> NDArray[np.intp]:
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
