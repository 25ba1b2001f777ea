"""The part of the current plane that a map's points enclose: beyond it nothing was measured."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import MeasuredFluxMap

#: A polygon is larger by this share of the largest current: currents are not read exactly where they were asked for.
_SLACK = 0.005
#: Points this close to the largest current, in shares of it, are on the circle that was measured.
_ON_CIRCLE = 0.03


@dataclass(frozen=True)
class MeasuredRegion:
    """Convex polygon: inside are currents (A) with normals @ i ≤ `offsets`; normals (k, 2) are of length 1."""

    normals: FloatArray
    offsets: FloatArray

    def slack(self, at: FloatArray) -> FloatArray:
        """Return how far (A) currents (n, 2) are inside, shape (n,); negative outside."""
        return np.asarray(np.min(self.offsets - at @ self.normals.T, axis=1))

    def holds(self, at: FloatArray) -> NDArray[np.bool_]:
        """Tell which currents (n, 2) are inside."""
        return np.asarray(self.slack(at) >= 0.0)


def measured_region(measured: MeasuredFluxMap) -> MeasuredRegion:
    """Return the region of a map, its mirror image with it where it is symmetric. Raises EstimationError where it has no area."""
    from scipy.spatial import ConvexHull, QhullError

    points = measured.points
    if measured.symmetric:
        points = np.vstack((points, points * [1.0, -1.0]))
    try:
        hull = ConvexHull(points)
    except QhullError:
        raise EstimationError("all points of the map lie on one line; measure over d and q current") from None
    # Between two points on the circle the circle itself counts, not its chord.
    largest = measured.largest_current
    first, second = points[hull.simplices[:, 0]], points[hull.simplices[:, 1]]
    on_circle = np.minimum(np.hypot(*first.T), np.hypot(*second.T)) > (1.0 - _ON_CIRCLE) * largest
    chord = np.hypot(*(first - second).T)
    bulge = np.where(on_circle & (chord < largest), chord**2 / (8.0 * largest), 0.0)
    return MeasuredRegion(hull.equations[:, :2], bulge + 2.0 * _SLACK * largest - hull.equations[:, 2])
