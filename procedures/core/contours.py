"""Contour lines over a plane, for plots."""

import numpy as np
from contourpy import contour_generator

from procedures.core.axes import FloatArray

#: Fewer points are a speck and no line.
_LEAST = 3


def contours(x: FloatArray, y: FloatArray, values: FloatArray, level: float) -> list[tuple[FloatArray, FloatArray]]:
    """Return the lines (x, y) on which values (n, m) over x (n,) and y (m,) have a level; nothing beyond values that are NaN."""
    made = contour_generator(x, y, np.ma.masked_invalid(values.T)).lines(level)
    lines = [np.asarray(line, dtype=np.float64) for line in made]
    return [(line[:, 0], line[:, 1]) for line in lines if len(line) >= _LEAST]
