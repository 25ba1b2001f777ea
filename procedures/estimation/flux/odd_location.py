"""A location of a flux map, read once, that lies off what all others say: no residual shows it, for its flux linkages are free."""

from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.map_fit import MapFit
from procedures.estimation.flux.surface import fit_surface

#: So many locations are looked at, of at least so many, which leaving out moves by so many times the median of all.
_SUSPECTS, _LEAST, _STANDS_OUT = 3, 18, 5.0
#: By so many standard uncertainties of what the others foresee a location lies off: in 216 undisturbed maps of nine motors at most 4.7.
_ODD = 6.0
#: Half-width of the location's interval, in shares of what it lies off, as a normal one of two standard uncertainties.
_WITHIN = 1.25


@dataclass(frozen=True)
class OddLocation:
    """A location by its place in the map and its only reading's; `away` (2,) in V·s by how much it lies off, `score` in standard
    uncertainties of what the others foresee there.
    """

    place: int
    reading: int
    score: float
    away: FloatArray

    def widened(self, covariance: FloatArray) -> FloatArray:
        """Return a map's covariance (2n, 2n) with an interval at the location that holds what the others say of it."""
        result = covariance.copy()
        here = np.array([2 * self.place, 2 * self.place + 1])
        result[here, here] += (0.5 * _WITHIN * self.away) ** 2
        return result


def least_foreseen(fit: MapFit, least: float = 0.0) -> list[int]:
    """Return the locations that were read once, the one first that leaving out moves most; by `least` times the median of all at least."""
    points = fit.map.points
    if len(points) < _LEAST:
        return []
    surface, once = fit.surface, np.bincount(fit.locations.of, minlength=len(points)) == 1
    away = np.zeros(len(points))
    for spline, places in ((surface.d, surface.d_places), (surface.q, surface.q_places)):
        # How far a location may lie off grows with its distance from the others.
        size = np.abs(spline.left_out) * np.sqrt(np.diag(spline.roughness))
        away[places // 2] = np.maximum(away[places // 2], size / max(float(np.median(size)), 1e-300))
    return [k for k in np.argsort(-away).tolist() if once[k] and away[k] > least]


def odd_location(fit: MapFit) -> OddLocation | None:
    """Return the location that lies farthest off the surface through the others, if it was read once and they do not foresee it; None
    if there is none.
    """
    suspects = least_foreseen(fit, _STANDS_OUT)[:_SUSPECTS]
    found = max((without(fit, k) for k in suspects), key=lambda each: each.score, default=None)
    return found if found is not None and found.score > _ODD else None


def without(fit: MapFit, place: int) -> OddLocation:
    """Return how a location lies to a surface whose coordinates are chosen without it, for with it they follow it."""
    others = np.arange(len(fit.map.points)) != place
    points, flux, own = fit.map.points, fit.map.flux, fit.map.uncertainty
    through = fit_surface(points[others], flux[others], symmetric=fit.map.symmetric, variances=own[others] ** 2)
    at = points[[place]]
    away = (flux[[place]] - through(at))[0]
    one, nil = np.ones(1), np.zeros((1, 2))
    foreseen = np.array([float(each.spread(at, one, nil)[0]) for each in (through.d, through.q)])
    score = float(np.max(np.abs(away) / np.maximum(np.hypot(foreseen, own[place]), 1e-300)))
    return OddLocation(place, int(np.flatnonzero(fit.locations.of == place)[0]), score, away)
