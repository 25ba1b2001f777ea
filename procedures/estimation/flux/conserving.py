"""The map's second product: a smooth surface that conserves energy, ∂ψ_d/∂i_q = ∂ψ_q/∂i_d, and how far the map is from it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import MeasuredFluxMap
from procedures.estimation.flux.spline import CurrentAxes

_SMOOTHINGS = (1e-8, 1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
_STRETCHES, _BENDS = (0.7, 1.0, 1.5), (np.inf, 0.2)
_MIRROR = np.array([1.0, -1.0])


@dataclass(frozen=True)
class ConservingSurface:
    """Flux linkages as the gradient of one coenergy Σ c·∂|x − x_j|⁵ and a quadratic form; no map can be had from it that makes energy.

    `residuals` (m, 2) in V·s are the map's flux linkages less this surface's, point by point; `left_out` (m, 2) what the surface errs
    where a location is left out. Its smoothness is the one with which that is least.
    """

    points: FloatArray
    axes: CurrentAxes
    functionals: NDArray[np.bool_]
    factors: FloatArray
    symmetric: bool
    residuals: FloatArray
    left_out: FloatArray

    def __call__(self, at: FloatArray) -> FloatArray:
        """Return the flux linkages (k, 2) in V·s at currents (k, 2) in A."""
        rows = _rows(at, self.points, self.axes, self.symmetric)
        chosen = np.concatenate((self.functionals.ravel(), np.ones(rows.shape[2] - self.functionals.size, dtype=bool)))
        return np.asarray(rows[:, :, chosen] @ self.factors)


def fit_conserving(measured: MeasuredFluxMap) -> ConservingSurface:
    """Return the surface of a map that conserves energy. Raises EstimationError where the locations do not carry one."""
    points, flux = measured.points, measured.flux
    n = len(points)
    functionals = np.ones((n, 2), dtype=bool)
    if measured.symmetric:
        # By symmetry there is no ψ_q on the d axis, which says nothing.
        functionals[points[:, 1] == 0.0, 1] = False
    spread = measured.scatter**2 + (1e-4 * measured.full_scale) ** 2
    weights = (spread / np.mean(spread))[functionals]
    values = flux[functionals]
    place = np.full((n, 2), -1)
    place[functionals] = np.arange(values.size)
    groups = [row[row >= 0] for row in place]
    span = measured.largest_current
    best: tuple[float, CurrentAxes, FloatArray, FloatArray] | None = None
    for axes in (CurrentAxes(span, stretch, bend) for stretch in _STRETCHES for bend in _BENDS):
        rows = _rows(points, points, axes, measured.symmetric)
        whole = rows[functionals]
        kernel, plane = whole[:, : 2 * n][:, functionals.ravel()], whole[:, 2 * n :]
        m = plane.shape[1]
        # As many sizes as functionals, or smoothing would mean another thing on every axis.
        size = float(np.mean(np.abs(kernel)))
        for smoothing in _SMOOTHINGS:
            system = np.zeros((values.size + m, values.size + m))
            system[: values.size, : values.size] = kernel + smoothing * size * np.diag(weights)
            system[: values.size, values.size :], system[values.size :, : values.size] = plane, plane.T
            try:
                inverse = np.linalg.inv(system)
            except np.linalg.LinAlgError:
                continue
            errors = _left_out(inverse[: values.size, : values.size], values, groups)
            error = float(np.mean(errors**2))
            if np.isfinite(error) and (best is None or error < best[0]):
                best = error, axes, inverse[:, : values.size] @ values, errors
    if best is None:
        raise EstimationError(f"{n} locations do not carry a surface that conserves energy; measure more of them")
    _, axes, factors, errors = best
    left_out = np.zeros((n, 2))
    left_out[functionals] = errors
    empty = ConservingSurface(points, axes, functionals, factors, measured.symmetric, flux, left_out)
    return ConservingSurface(points, axes, functionals, factors, measured.symmetric, flux - empty(points), left_out)


def _left_out(inverse: FloatArray, values: FloatArray, groups: Sequence[NDArray[np.intp]]) -> FloatArray:
    """Return by how much both flux linkages of each location differ from what the others say of it."""
    result = np.empty(values.size)
    pulled = inverse @ values
    for group in groups:
        try:
            result[group] = np.linalg.solve(inverse[np.ix_(group, group)], pulled[group])
        except np.linalg.LinAlgError:
            result[group] = np.inf
    return result


def _rows(at: FloatArray, points: FloatArray, axes: CurrentAxes, symmetric: bool) -> FloatArray:
    """Return ψ at currents (k, 2) for a factor of one of each functional, and of the quadratic form's terms: (k, 2, 2n + m)."""
    x, centres = axes(at), axes(points)
    own, theirs = axes.slopes(at), axes.slopes(points)
    hessian = _hessian(x[:, None, :] - centres[None, :, :])
    if symmetric:
        hessian = hessian + _hessian(x[:, None, :] - (centres * _MIRROR)[None, :, :]) * _MIRROR
    # [k, a, j, b]: ψ_a at k for ψ_b's functional at j.
    whole = hessian.transpose(0, 2, 1, 3) * own[:, :, None, None] * theirs[None, None, :, :]
    zero, one = np.zeros(len(at)), np.ones(len(at))
    terms = [(one, zero), (2.0 * x[:, 0], zero), (zero, 2.0 * x[:, 1])]
    if not symmetric:
        terms += [(zero, one), (x[:, 1], x[:, 0])]
    plane = np.stack([np.column_stack(term) for term in terms], axis=2) * own[:, :, None]
    return np.concatenate((whole.reshape(len(at), 2, -1), plane), axis=2)


def _hessian(between: FloatArray) -> FloatArray:
    """Return the second derivatives (k, n, 2, 2) of |x|⁵."""
    distance = np.sqrt(np.einsum("knc,knc->kn", between, between))[:, :, None, None]
    outer = between[:, :, :, None] * between[:, :, None, :]
    return np.asarray(5.0 * distance**3 * np.eye(2) + 15.0 * distance * outer)
