"""Non-linear least squares of a few parameters, from good start values."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.optimize import least_squares

from procedures.estimation.fit import EstimationError, FloatArray


@dataclass(frozen=True)
class Solution:
    """Optimum: `values` (k,), `covariance` (k, k) for residuals of unit variance, `gain` (k, n) = J⁺, `cost` = Σr²."""

    values: FloatArray
    covariance: FloatArray
    gain: FloatArray
    cost: float


def solve(
    residuals: Callable[[FloatArray], FloatArray],
    start: FloatArray,
    scale: FloatArray,
    names: Sequence[str],
    slopes: Callable[[FloatArray], FloatArray] | None = None,
) -> Solution:
    """Minimise Σ residuals(p)² from `start`; `scale` (k,) is a typical size of a change of each parameter.

    `slopes` gives the residuals' derivatives (n, k) by the parameters; without it they are taken by differences.

    Raises EstimationError where it does not converge or the data leave a parameter undetermined.
    """

    def scaled(z: FloatArray) -> FloatArray:
        return residuals(start + z * scale)

    def scaled_slopes(z: FloatArray) -> FloatArray:
        return scale * (slopes(start + z * scale) if slopes else np.zeros(0))

    jacobian: Literal["3-point"] | Callable[[FloatArray], FloatArray] = scaled_slopes if slopes else "3-point"
    try:
        found = least_squares(
            scaled, np.zeros_like(start), jac=jacobian, xtol=1e-12, ftol=1e-12, gtol=1e-12, max_nfev=200
        )
    except ValueError as error:
        raise EstimationError(f"the fit of {', '.join(names)} does not start: {error}; check the record") from error
    if found.status <= 0 or not np.all(np.isfinite(found.x)):
        raise EstimationError(
            f"the fit of {', '.join(names)} does not converge; check that the record shows what it should"
        )
    u, s, vt = np.linalg.svd(np.asarray(found.jac, dtype=np.float64), full_matrices=False)
    if s[-1] <= 1e-10 * s[0]:
        raise EstimationError(f"the record does not determine {', '.join(names)} apart; take a longer or livelier one")
    inverse = (vt.T / s) @ u.T * scale[:, None]
    return Solution(start + found.x * scale, inverse @ inverse.T, inverse, float(2 * found.cost))
