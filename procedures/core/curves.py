"""Curves in a result's findings, so that a plot of a fit need not calculate it again."""

import numpy as np
from numpy.typing import ArrayLike

#: As many points as a plot the width of a page can show.
_POINTS = 300


def curve(points: int = _POINTS, **columns: ArrayLike) -> dict[str, list[float]]:
    """Return columns of equal length (n,) by name as lists, thinned alike to about `points` with the first and the last kept."""
    arrays = {name: np.asarray(values, dtype=np.float64) for name, values in columns.items()}
    size = max((array.size for array in arrays.values()), default=0)
    kept = (
        np.unique(np.linspace(0, size - 1, min(size, points)).round().astype(int)) if size else np.zeros(0, dtype=int)
    )
    return {name: array[kept].tolist() for name, array in arrays.items()}
