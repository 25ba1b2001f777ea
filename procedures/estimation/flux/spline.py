"""A smooth surface through values at scattered currents: a polyharmonic spline, even or odd in the q current where that is known."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: Smoothings to choose from, of which the first passes through the values; what the q current counts for beside the d current; and where,
#: in shares of the largest current, its axis begins to bend: bridges saturate at little i_q.
_SMOOTHINGS = (1e-9, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
_STRETCHES = (0.5, 1.0, 2.0)
_BENDS = (np.inf, 0.2, 0.05)
#: So many locations tell how rough the surface is about them.
_NEIGHBOURS = 4


class Parity(IntEnum):
    """Symmetry of a quantity when the q current changes its sign."""

    ODD = -1
    NONE = 0
    EVEN = 1


@dataclass(frozen=True)
class CurrentAxes:
    """Coordinates without unit: i_d over `span` (A), and i_q likewise but `stretch` times, and as its area sine from `bend` on."""

    span: float
    stretch: float
    bend: float

    def __call__(self, at: FloatArray) -> FloatArray:
        """Return the coordinates (k, 2) of currents (k, 2)."""
        d, q = at[:, 0] / self.span, at[:, 1] / self.span
        if np.isfinite(self.bend):
            q = np.arcsinh(q / self.bend) / np.arcsinh(1.0 / self.bend)
        return np.column_stack((d, self.stretch * q))

    def slopes(self, at: FloatArray) -> FloatArray:
        """Return the coordinates' derivatives (k, 2) by the currents, in 1/A."""
        result = np.full(at.shape, 1.0 / self.span)
        result[:, 1] *= self.stretch
        if np.isfinite(self.bend):
            q = at[:, 1] / self.span / self.bend
            result[:, 1] /= self.bend * np.arcsinh(1.0 / self.bend) * np.sqrt(1.0 + q**2)
        return result


@dataclass(frozen=True)
class ScatteredSpline:
    """Spline of a quantity over (i_d, i_q): `points` (n, 2) in A, `values` (n,), its coordinates, and its system's inverse.

    Σ c_j·|x − x_j|³ and a plane. In its own terms it is a random field with that as its generalised covariance, the square of `amplitude`
    being its size as leaving out points shows it; that gives the uncertainty between points.
    Source: Wahba, Spline Models for Observational Data; Rippa 1999 for leaving out.
    """

    points: FloatArray
    values: FloatArray
    parity: Parity
    axes: CurrentAxes
    inverse: FloatArray
    left_out: FloatArray
    amplitude: float

    @property
    def roughness(self) -> FloatArray:
        """The form (n, n) that makes of values at the points the square of the field's size; planes have none."""
        n = self.values.size
        return 0.5 * (self.inverse[:n, :n] + self.inverse[:n, :n].T)

    def weights(self, at: FloatArray, order: int = 0) -> FloatArray:
        """Return what each value counts at currents (k, 2): (k, n), or with `order` 1 for the slopes (k, 2, n) in 1/A."""
        rows = self._rows(at) if order == 0 else self._slope_rows(at)
        n = self.values.size
        return np.asarray((rows.reshape(-1, rows.shape[-1]) @ self.inverse[:, :n]).reshape(*rows.shape[:-1], n))

    def __call__(self, at: FloatArray) -> FloatArray:
        """Return the quantity at currents (k, 2)."""
        return np.asarray(self._rows(at) @ (self.inverse[:, : self.values.size] @ self.values))

    def slopes(self, at: FloatArray) -> FloatArray:
        """Return its derivatives by i_d and i_q at currents (k, 2), shape (k, 2), per A."""
        return np.asarray(self._slope_rows(at) @ (self.inverse[:, : self.values.size] @ self.values))

    def spread(self, at: FloatArray, value: FloatArray, slope: FloatArray) -> FloatArray:
        """Return the standard uncertainty that values between points leave in value·f + slope·∇f at currents (k, 2).

        `value` (k,) and `slope` (k, 2) are the functional's factors.
        """
        rows = value[:, None] * self._rows(at) + np.einsum("kc,kcn->kn", slope, self._slope_rows(at))
        own = np.zeros(len(at))
        if self.parity:
            across = np.column_stack((np.zeros(len(at)), 2.0 * self.axes(at)[:, 1]))
            s = slope * self.axes.slopes(at)
            mirror = np.array([-1.0, 1.0])
            distance = np.hypot(across[:, 0], across[:, 1])
            gradient = 3.0 * distance[:, None] * across
            own = value**2 * distance**3 + value * np.einsum("kc,kc->k", gradient, s * (1.0 + mirror))
            safe = np.where(distance > 0.0, distance, 1.0)
            along = np.einsum("kc,kc->k", s, across) * np.einsum("kc,kc->k", s * mirror, across) / safe
            own = self.parity * (own + 3.0 * (distance * np.einsum("kc,kc->k", s, s * mirror) + along))
        variance = own - np.einsum("kn,nm,km->k", rows, self.inverse, rows)
        return np.asarray(self._amplitude_near(at) * np.sqrt(np.maximum(variance, 0.0)))

    def _amplitude_near(self, at: FloatArray) -> FloatArray:
        """Return the field's size about currents (k, 2): what the nearest locations show where that is more than all show."""
        x, centres = self.axes(at), self.axes(self.points)
        distance = np.hypot(*(x[:, None, :] - centres[None, :, :]).transpose(2, 0, 1))
        nearest = np.argsort(distance, axis=1)[:, :_NEIGHBOURS]
        own = self.left_out**2 * np.diag(self.inverse)[: self.values.size]
        return np.asarray(np.sqrt(np.maximum(np.mean(own[nearest], axis=1), self.amplitude**2)))

    def _rows(self, at: FloatArray) -> FloatArray:
        x, centres = self.axes(at), self.axes(self.points)
        rows = _cubed(x, centres)
        if self.parity:
            rows += self.parity * _cubed(x, centres * [1.0, -1.0])
        return np.hstack((rows, _plane(x, self.parity)))

    def _slope_rows(self, at: FloatArray) -> FloatArray:
        x, centres = self.axes(at), self.axes(self.points)
        rows = _cubed_slopes(x, centres)
        if self.parity:
            rows += self.parity * _cubed_slopes(x, centres * [1.0, -1.0])
        plane = {
            Parity.NONE: ((0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
            Parity.EVEN: ((0.0, 1.0), (0.0, 0.0)),
            Parity.ODD: ((0.0,), (1.0,)),
        }[self.parity]
        whole = np.concatenate((rows, np.broadcast_to(plane, (len(at), 2, len(plane[0])))), axis=2)
        return np.asarray(whole * self.axes.slopes(at)[:, :, None])


def fit_spline(
    points: FloatArray,
    values: FloatArray,
    parity: Parity = Parity.NONE,
    *,
    variances: FloatArray | None = None,
    candidates: Sequence[CurrentAxes] = (),
) -> ScatteredSpline:
    """Return the spline whose smoothing and coordinates leave the smallest errors where points are left out.

    Points (n, 2) are different locations; with a parity they lie on one side, and their mirror images go without saying.
    `variances` (n,) weigh the values against each other; `candidates` are coordinates to choose from.
    Raises EstimationError where the points are too few or on one line.
    """
    span = float(np.max(np.hypot(points[:, 0], points[:, 1])))
    weight = np.ones(len(points)) if variances is None else variances / float(np.mean(variances))
    best: tuple[float, CurrentAxes, float, FloatArray, float] | None = None
    for axes in candidates or [CurrentAxes(span, stretch, bend) for stretch in _STRETCHES for bend in _BENDS]:
        x = axes(points)
        plane = _plane(x, parity)
        n, m = plane.shape
        kernel = _cubed(x, x)
        if parity:
            kernel += parity * _cubed(x, x * [1.0, -1.0])
        if n <= m + 1:
            continue
        # Across the plane, all smoothings share their modes.
        root = np.sqrt(weight)
        across = np.linalg.qr(plane / root[:, None], mode="complete")[0][:, m:]
        sizes, modes = np.linalg.eigh(across.T @ (kernel / np.outer(root, root)) @ across)
        modes = across @ modes
        pattern = modes.T @ (values / root)
        for smoothing in _SMOOTHINGS:
            share = 1.0 / np.maximum(sizes + smoothing, 1e-15)
            diagonal = (modes**2 @ share) / weight
            left_out = (modes @ (share * pattern)) / root / diagonal
            error = float(np.mean(left_out**2))
            if best is None or error < best[0]:
                best = error, axes, smoothing, left_out, float(np.sqrt(np.mean(left_out**2 * diagonal)))
    if best is None:
        raise EstimationError(
            f"{len(points)} locations do not carry a surface over d and q current; measure more, and not on one line"
        )
    _, axes, smoothing, left_out, amplitude = best
    x = axes(points)
    plane = _plane(x, parity)
    n, m = plane.shape
    system = np.zeros((n + m, n + m))
    system[:n, :n] = _cubed(x, x) + np.diag(smoothing * weight)
    if parity:
        system[:n, :n] += parity * _cubed(x, x * [1.0, -1.0])
    system[:n, n:], system[n:, :n] = plane, plane.T
    return ScatteredSpline(points, values, parity, axes, np.linalg.inv(system), left_out, amplitude)


def _cubed(x: FloatArray, centres: FloatArray) -> FloatArray:
    square = (x[:, None, 0] - centres[:, 0]) ** 2 + (x[:, None, 1] - centres[:, 1]) ** 2
    # Three times faster than a power of 1.5.
    return np.asarray(square * np.sqrt(square))


def _cubed_slopes(x: FloatArray, centres: FloatArray) -> FloatArray:
    between = x[:, None, :] - centres[None, :, :]
    distance = np.sqrt(np.einsum("knc,knc->kn", between, between))
    return np.asarray(3.0 * distance[:, None, :] * between.transpose(0, 2, 1))


def _plane(x: FloatArray, parity: Parity) -> FloatArray:
    one = np.ones(len(x))
    columns = {Parity.NONE: (one, x[:, 0], x[:, 1]), Parity.EVEN: (one, x[:, 0]), Parity.ODD: (x[:, 1],)}[parity]
    return np.column_stack(columns)
