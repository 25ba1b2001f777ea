"""The uncertainty of a map's figures at a current that lies between its rows or beyond its edge."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import MapFigure, MeasuredFluxMap
from procedures.estimation.flux.inductances import MapInductances, inductances_at
from procedures.estimation.flux.surface import FluxSurface, fit_surface

#: Of a normal error 95 % lie within so many standard deviations.
_NORMAL = 1.96
#: A surface's slope at an edge, or where the iron bends, is off in proportion to the rows' distance: with twice that it changes by as
#: much as it is off. So many standard deviations that change is; 1.5 times it are 95 %.
_OF_CHANGE = 0.77
#: A thinned table with fewer rows carries no surface.
_LEAST = 8


class ThinnedMap:
    """A map and what its table says with rows left out: twice the distance between rows shows what that distance costs."""

    def __init__(self, measured: MeasuredFluxMap) -> None:
        """Fit the surfaces with rows left out."""
        self._measured = measured
        variances = measured.scatter**2 + (1e-6 * measured.full_scale) ** 2
        self._surfaces: list[tuple[FluxSurface, NDArray[np.intp], float]] = []
        for kept, growth in _thinnings(measured.points):
            try:
                made = fit_surface(
                    measured.points[kept],
                    measured.flux[kept],
                    symmetric=measured.symmetric,
                    variances=variances[kept],
                    like=measured.surface,
                )
            except (EstimationError, np.linalg.LinAlgError):
                continue
            self._surfaces.append((made, kept, 1.0 / (growth - 1.0)))

    def inductances(self, i_d: float, i_q: float) -> MapInductances:
        """Return the inductances at a current (A), the differential ones with what the rows' distance may do to them."""
        found, at = inductances_at(self._measured, i_d, i_q), np.array([[i_d, i_q]])
        whole = self._measured.surface
        excess = np.zeros((2, 2))
        for surface, kept, factor in self._surfaces:
            change = (surface.slopes(at) - whole.slopes(at))[0]
            weights = -whole.slope_weights(at)[0]
            weights[:, :, np.ravel(np.column_stack((2 * kept, 2 * kept + 1)))] += surface.slope_weights(at)[0]
            noise = np.einsum("abi,ij,abj->ab", weights, self._measured.covariance, weights)
            # What noise does to the change is in the interval already.
            excess += factor**2 * np.maximum(change**2 - noise, 0.0)
        wider = _OF_CHANGE * np.sqrt(excess)
        return replace(
            found,
            dd=widened(found.dd, wider[0, 0]),
            dq=widened(found.dq, wider[0, 1]),
            qd=widened(found.qd, wider[1, 0]),
            qq=widened(found.qq, wider[1, 1]),
        )


def _thinnings(points: FloatArray) -> Sequence[tuple[NDArray[np.intp], float]]:
    """Return which rows stay, always those nearest to zero, and by what their distance grows: of a grid along either axis."""
    scale = float(np.max(np.abs(points)))
    grid = [np.unique(np.round(points[:, k] / scale, 6), return_inverse=True) for k in (0, 1)]
    if grid[0][0].size * grid[1][0].size <= 2 * len(points):
        made = []
        for at, places in grid:
            nearest = int(np.argmin(np.abs(at)))
            kept = np.flatnonzero((places.ravel() - nearest) % 2 == 0)
            if _LEAST <= kept.size < len(points):
                made.append((kept, 2.0))
        return made
    # Scattered rows: a quarter of them, each as far from the others as can be.
    most = max(_LEAST, len(points) // 4)
    chosen = [int(np.argmin(np.hypot(*points.T)))]
    distance = np.hypot(*(points - points[chosen[0]]).T)
    while len(chosen) < most:
        chosen.append(int(np.argmax(distance)))
        distance = np.minimum(distance, np.hypot(*(points - points[chosen[-1]]).T))
    return [(np.array(sorted(chosen)), math.sqrt(len(points) / most))] if len(points) > 2 * most else []


def beyond_table(measured: MeasuredFluxMap) -> tuple[float, float, float]:
    """Return what carrying a map on to zero current may do to ψ_d (V·s), ∂ψ_d/∂i_d and ∂ψ_q/∂i_q (H); zeros where it reaches it."""
    low, high = np.min(measured.points, axis=0), np.max(measured.points, axis=0)
    edge = np.clip(np.zeros(2), low, high)
    if float(np.hypot(*edge)) <= 1e-6 * measured.largest_current:
        return 0.0, 0.0, 0.0
    # As much as the slopes change over the same way within the table they may change beyond it.
    outer, inner = measured.surface.slopes(np.stack((edge, np.clip(2.0 * edge, low, high))))
    change = np.abs(outer - inner)
    return float(change[0] @ np.abs(edge)), float(change[0, 0]), float(change[1, 1])


def widened(figure: MapFigure, standard: float) -> MapFigure:
    """Return a figure with a standard uncertainty more."""
    low, high = figure.coverage_interval
    half = math.hypot(0.5 * (high - low), _NORMAL * standard)
    together = math.hypot(figure.standard_uncertainty, standard)
    around = (figure.value - half, figure.value + half)
    return replace(figure, standard_uncertainty=together, coverage_interval=around)
