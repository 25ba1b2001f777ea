"""The jump between two readings of a sweep that explains most of what a model leaves."""

from dataclasses import dataclass

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray

#: A jump leaves at least so many readings on either side.
_BESIDE = 2


@dataclass(frozen=True)
class Jump:
    """A jump before reading `place`, by `height`, in units of the readings; `column` (n, 1) lies between both levels.

    `squares` is what is left with it, `probability` how probable as much is by chance at the best of all places.
    """

    place: int
    height: float
    column: FloatArray
    squares: float
    probability: float


def clearest_jump(design: FloatArray, values: FloatArray) -> Jump:
    """Return the jump of readings (n,) that explains most beside a design (n, k); n is at least k + 4."""
    places = np.arange(_BESIDE, values.size - _BESIDE + 1)
    base = np.linalg.qr(design)[0]
    left = values - base @ (base.T @ values)
    # Between both levels, as it is not known which of them is right: ±½. At right angles to the design each loses its part along it.
    along = _from_each(base)[places] - 0.5 * np.sum(base, axis=0)
    sizes = np.maximum(0.25 * values.size - np.sum(along**2, axis=1), 1e-300)
    heights = (_from_each(left)[places] - 0.5 * np.sum(left)) / sizes
    best = int(np.argmax(heights**2 * sizes))
    explained, before = float(heights[best] ** 2 * sizes[best]), float(left @ left)
    squares, freedom = max(before - explained, 0.0), values.size - design.shape[1] - 1
    single = 1.0
    if before > 1e-20 * float(values @ values):
        single = float(special.fdtrc(1, freedom, explained / max(squares / freedom, 1e-300)))
    column = (np.arange(values.size)[:, None] >= places[best]) - 0.5
    return Jump(int(places[best]), float(heights[best]), column, squares, min(1.0, places.size * single))


def _from_each(rows: FloatArray) -> FloatArray:
    """Return the sums of the rows from each one on."""
    return np.asarray(np.cumsum(rows[::-1], axis=0)[::-1], dtype=np.float64)
