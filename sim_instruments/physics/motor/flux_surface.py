"""Smooth surfaces through the points of a flux map, and what they become beyond its edges."""

from bisect import bisect_right
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

#: Slopes along the first axis of values at given places.
Slopes = Callable[[FloatArray, FloatArray], FloatArray]


def spline_slopes(places: FloatArray, values: FloatArray) -> FloatArray:
    """Return the slopes of the cubic spline through the values; the surface is smooth to its second derivatives."""
    from scipy.interpolate import CubicSpline

    return np.asarray(CubicSpline(places, values, axis=0)(places, 1), dtype=np.float64)


def monotone_slopes(places: FloatArray, values: FloatArray) -> FloatArray:
    """Return the slopes of Fritsch and Carlson's curve, which nowhere turns back between two points."""
    from scipy.interpolate import PchipInterpolator

    return np.asarray(PchipInterpolator(places, values, axis=0).derivative()(places), dtype=np.float64)


def mean_slopes(places: FloatArray, values: FloatArray) -> FloatArray:
    """Return the mean slopes of both sides of each place: of coarse tables the quietest."""
    return np.asarray(np.gradient(values, places, axis=0), dtype=np.float64)


class SoftEdge:
    """One coordinate of the table: as it is within low … high, then ever less of it until it stays where it is.

    Over the `margin` beyond an edge its slope falls evenly from one to zero.
    """

    def __init__(self, low: float, high: float, margin: float) -> None:
        self.low, self.high, self.margin = low, high, margin

    def at(self, value: float) -> tuple[float, float]:
        """Return the coordinate for one value, and its slope."""
        if self.low <= value <= self.high:
            return value, 1.0
        edge = self.low if value < self.low else self.high
        beyond = abs(value - edge)
        way = -1.0 if value < edge else 1.0
        if beyond >= self.margin:
            return edge + 0.5 * way * self.margin, 0.0
        share = beyond / self.margin
        return edge + way * beyond * (1.0 - 0.5 * share), 1.0 - share

    def at_each(self, values: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the coordinates for values of any shape, and their slopes."""
        inside = np.clip(values, self.low, self.high)
        beyond = values - inside
        share = np.minimum(np.abs(beyond) / self.margin, 1.0)
        within = np.sign(beyond) * self.margin * share * (1.0 - 0.5 * share)
        return inside + within, 1.0 - share


class Surfaces:
    """ψd and ψq over id and iq as bicubic pieces; beyond the outermost points they go on straight.

    `d_currents` (n,) and `q_currents` (m,) rise; the fluxes have the shape (n, m).
    """

    def __init__(
        self,
        d_currents: FloatArray,
        q_currents: FloatArray,
        d_flux: FloatArray,
        q_flux: FloatArray,
        slopes: Slopes,
    ) -> None:
        self._d_knots: list[float] = d_currents.tolist()
        self._q_knots: list[float] = q_currents.tolist()
        self._knots = d_currents, q_currents
        self._origins = tuple(np.concatenate([knots[:1], knots]) for knots in self._knots)
        pieces = [_pieces(d_currents, q_currents, flux, slopes) for flux in (d_flux, q_flux)]
        #: Coefficients by cell along d, cell along q, flux, power of d and power of q.
        self._coefficients: FloatArray = np.ascontiguousarray(np.stack(pieces, axis=2))
        self._lists: list[list[list[list[list[float]]]]] = self._coefficients.tolist()
        self._d_origins: list[float] = self._origins[0].tolist()
        self._q_origins: list[float] = self._origins[1].tolist()

    def at(self, d: float, q: float) -> tuple[float, float, float, float, float, float]:
        """Return ψd, ψq and ∂ψd/∂id, ∂ψd/∂iq, ∂ψq/∂id, ∂ψq/∂iq at one pair of coordinates."""
        row, column = bisect_right(self._d_knots, d), bisect_right(self._q_knots, q)
        x, y = d - self._d_origins[row], q - self._q_origins[column]
        result = []
        for (p00, p01, p02, p03), (p10, p11, p12, p13), (p20, p21, p22, p23), (p30, p31, p32, p33) in self._lists[row][
            column
        ]:
            f0 = ((p03 * y + p02) * y + p01) * y + p00
            f1 = ((p13 * y + p12) * y + p11) * y + p10
            f2 = ((p23 * y + p22) * y + p21) * y + p20
            f3 = ((p33 * y + p32) * y + p31) * y + p30
            g0 = (3.0 * p03 * y + 2.0 * p02) * y + p01
            g1 = (3.0 * p13 * y + 2.0 * p12) * y + p11
            g2 = (3.0 * p23 * y + 2.0 * p22) * y + p21
            g3 = (3.0 * p33 * y + 2.0 * p32) * y + p31
            result.append(((f3 * x + f2) * x + f1) * x + f0)
            result.append((3.0 * f3 * x + 2.0 * f2) * x + f1)
            result.append(((g3 * x + g2) * x + g1) * x + g0)
        d_flux, dd, dq, q_flux, qd, qq = result
        return d_flux, q_flux, dd, dq, qd, qq

    def at_each(self, d: FloatArray, q: FloatArray, *, slopes: bool) -> FloatArray:
        """Return ψd and ψq (2, n) at coordinates (n,), or with `slopes` what `at` returns (6, n)."""
        (d_knots, q_knots), (d_origins, q_origins) = self._knots, self._origins
        row, column = np.searchsorted(d_knots, d, side="right"), np.searchsorted(q_knots, q, side="right")
        x, y = d - d_origins[row], q - q_origins[column]
        cells = self._coefficients[row, column]
        x, y = x[:, np.newaxis], y[:, np.newaxis, np.newaxis]
        along = ((cells[..., 3] * y + cells[..., 2]) * y + cells[..., 1]) * y + cells[..., 0]
        flux = ((along[..., 3] * x + along[..., 2]) * x + along[..., 1]) * x + along[..., 0]
        if not slopes:
            return np.array([flux[:, 0], flux[:, 1]])
        across = (3.0 * cells[..., 3] * y + 2.0 * cells[..., 2]) * y + cells[..., 1]
        by_d = (3.0 * along[..., 3] * x + 2.0 * along[..., 2]) * x + along[..., 1]
        by_q = ((across[..., 3] * x + across[..., 2]) * x + across[..., 1]) * x + across[..., 0]
        return np.array([flux[:, 0], flux[:, 1], by_d[:, 0], by_q[:, 0], by_d[:, 1], by_q[:, 1]])


def _pieces(d_currents: FloatArray, q_currents: FloatArray, flux: FloatArray, slopes: Slopes) -> FloatArray:
    """Return the coefficients (n + 1, m + 1, 4, 4) of one flux, its outermost cells straight along their own axis."""
    by_d = slopes(d_currents, flux)
    by_q = slopes(q_currents, flux.T).T
    twist = slopes(q_currents, by_d.T).T
    along_d, along_d_by_q = _hermite(d_currents, flux, by_d), _hermite(d_currents, by_q, twist)
    # (powers of d, cells along d, m): q comes first now.
    both = _hermite(q_currents, np.moveaxis(along_d, -1, 0), np.moveaxis(along_d_by_q, -1, 0))
    return np.transpose(both, (3, 1, 2, 0))


def _hermite(places: FloatArray, values: FloatArray, slopes: FloatArray) -> FloatArray:
    """Return coefficients (4, n + 1, …) of cubics along the first axis, rising powers from each cell's lower end.

    The first cell lies before all places and counts from the first of them; it and the last are straight.
    """
    steps = np.diff(places).reshape((-1,) + (1,) * (values.ndim - 1))
    rise = np.diff(values, axis=0) / steps
    bend = (3.0 * rise - 2.0 * slopes[:-1] - slopes[1:]) / steps
    twist = (slopes[:-1] + slopes[1:] - 2.0 * rise) / steps**2
    straight = np.zeros_like(values[:1])
    return np.array(
        [
            np.concatenate([values[:1], values]),
            np.concatenate([slopes[:1], slopes]),
            np.concatenate([straight, bend, straight]),
            np.concatenate([straight, twist, straight]),
        ]
    )
