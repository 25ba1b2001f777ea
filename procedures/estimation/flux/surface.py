"""Both flux linkages as smooth surfaces over the currents."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.spline import Parity, ScatteredSpline, fit_spline


@dataclass(frozen=True)
class FluxSurface:
    """ψ_d and ψ_q (V·s, peak) over (i_d, i_q), each a spline of its own: it follows the values, and conserves energy only as they do.

    The splines' values are `size` numbers in a row: `d_places` and `q_places` say which is whose.
    """

    d: ScatteredSpline
    q: ScatteredSpline
    d_places: NDArray[np.intp]
    q_places: NDArray[np.intp]
    size: int

    def __call__(self, at: FloatArray) -> FloatArray:
        """Return the flux linkages at currents (k, 2), shape (k, 2)."""
        return np.column_stack((self.d(at), self.q(at)))

    def slopes(self, at: FloatArray) -> FloatArray:
        """Return the differential inductances (H) at currents (k, 2): (k, 2, 2), [[∂ψ_d/∂i_d, ∂ψ_d/∂i_q], [∂ψ_q/∂i_d, ∂ψ_q/∂i_q]]."""
        return np.stack((self.d.slopes(at), self.q.slopes(at)), axis=1)

    def weights(self, at: FloatArray) -> FloatArray:
        """Return what each measured value counts for the flux linkages at currents (k, 2): (k, 2, size)."""
        result = np.zeros((len(at), 2, self.size))
        result[:, 0, self.d_places] = self.d.weights(at)
        result[:, 1, self.q_places] = self.q.weights(at)
        return result

    def slope_weights(self, at: FloatArray) -> FloatArray:
        """Return what each measured value counts for the differential inductances: (k, 2, 2, size), in 1/A."""
        result = np.zeros((len(at), 2, 2, self.size))
        result[:, 0][:, :, self.d_places] = self.d.weights(at, 1)
        result[:, 1][:, :, self.q_places] = self.q.weights(at, 1)
        return result

    def spread(self, at: FloatArray, value: FloatArray, slope: FloatArray) -> FloatArray:
        """Return the standard uncertainty of Σ value·ψ + Σ slope·∂ψ/∂i at currents (k, 2) for what lies between the points.

        `value` (k, 2), `slope` (k, 2, 2) as `slopes` has them.
        """
        return np.hypot(self.d.spread(at, value[:, 0], slope[:, 0]), self.q.spread(at, value[:, 1], slope[:, 1]))

    @property
    def left_out(self) -> FloatArray:
        """By how much ψ_d at each of its points differs from what the other locations say (V·s), and ψ_q after it."""
        return np.concatenate((self.d.left_out, self.q.left_out))


def fit_surface(
    points: FloatArray,
    values: FloatArray,
    *,
    symmetric: bool,
    variances: FloatArray | None = None,
    like: FluxSurface | None = None,
) -> FluxSurface:
    """Return the surface through flux linkages (n, 2) at locations (n, 2), the smoothness of each chosen by leaving out locations.

    Where `symmetric`, points stand for their mirror images too: ψ_d is even, ψ_q odd in i_q and nil on the d axis.
    It has the coordinates of a surface that it is to be `like`. Raises EstimationError where the points do not carry a surface.
    """
    n = len(points)
    spread = np.ones((n, 2)) if variances is None else variances
    everywhere = np.arange(n)
    off_axis = np.flatnonzero(points[:, 1] != 0.0) if symmetric else everywhere
    d = fit_spline(
        points,
        values[:, 0],
        Parity.EVEN if symmetric else Parity.NONE,
        variances=spread[:, 0],
        candidates=() if like is None else (like.d.axes,),
    )
    q = fit_spline(
        points[off_axis],
        values[off_axis, 1],
        Parity.ODD if symmetric else Parity.NONE,
        variances=spread[off_axis, 1] if np.all(spread[off_axis, 1] > 0.0) else None,
        candidates=() if like is None else (like.q.axes,),
    )
    return FluxSurface(d, q, 2 * everywhere, 2 * off_axis + 1, 2 * n)
