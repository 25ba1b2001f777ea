"""The readings of several sessions as one set: each session has temperatures of its own, and repeated currents tie them together."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.readings import Locations

#: Between knots (s) of the magnet's flux over time, and readings that a knot of anything over time takes at least.
MAGNET_KNOTS, _READINGS_A_KNOT = 200.0, 6


def in_blocks(session: NDArray[np.intp], blocks: Sequence[FloatArray]) -> FloatArray:
    """Return columns (n, k) of all sessions, each nil outside of its own."""
    made = np.zeros((session.size, sum(block.shape[1] for block in blocks)))
    column = 0
    for number, block in enumerate(blocks):
        made[session == number, column : column + block.shape[1]] = block
        column += block.shape[1]
    return made


def repeated(session: NDArray[np.intp], locations: Locations) -> Sequence[NDArray[np.bool_]]:
    """Return the readings of each later session at each current but none that was read in an earlier session too."""
    made = []
    for number in range(1, int(np.max(session)) + 1):
        for place in np.intersect1d(locations.of[session == number], locations.of[session < number]):
            if np.any(locations.points[place]):
                made.append((session == number) & (locations.of == place))
    return made


def slow_change(time: FloatArray) -> FloatArray:
    """Return what a magnet's change over times (n,) is made of: a straight line as long as a knot would be farther away than its end."""
    length = float(np.ptp(time))
    if length > MAGNET_KNOTS:
        return splines(time, MAGNET_KNOTS, time.size)
    share = (time - np.min(time)) / max(length, 1e-9)
    return np.column_stack((1.0 - share, share))


def splines(time: FloatArray, between: float, readings: int) -> FloatArray:
    """Return cubic B-splines at times (n, k) with knots so far apart, as many as readings carry."""
    first, last = float(np.min(time)), float(np.max(time))
    length = max(last - first, 1e-9)
    pieces = int(np.clip(round(length / between), 1, max(readings // _READINGS_A_KNOT - 3, 1)))
    inner = np.linspace(first, first + length, pieces + 1)
    knots = np.concatenate((np.full(3, inner[0]), inner, np.full(3, inner[-1])))
    from scipy.interpolate import BSpline

    return np.asarray(BSpline.design_matrix(np.clip(time, inner[0], inner[-1]), knots, 3).toarray())
