"""Many samples as few points whose line looks the same: the smallest and the largest of each stretch, never dropping a peak."""

from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def envelope(x: FloatArray, y: FloatArray, points: int = 1200) -> tuple[FloatArray, FloatArray]:
    """Return x and y (n,) themselves where they are few, else at most `points` of them: each stretch's extremes in order."""
    stretches = points // 2
    if y.size <= points or stretches < 1:
        return x, y
    edges = np.linspace(0, y.size, stretches + 1).astype(int)
    low = np.array([a + int(np.argmin(y[a:b])) for a, b in pairwise(edges)])
    high = np.array([a + int(np.argmax(y[a:b])) for a, b in pairwise(edges)])
    kept = np.unique(np.concatenate((low, high, [0, y.size - 1])))
    return x[kept], y[kept]
