"""Non-linear least squares of a few parameters, from good start values."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fit import EstimationError, FloatArray

_ROUNDS = 200
#: A step below this share of the standard uncertainty is the last one.
_LAST_STEP = 3e-5
#: Share of the curvature that is added to it where a step leads too far.
_LEAST_DAMPING = 1e-3


@dataclass(frozen=True)
class Solution:
    """Optimum: `values` (k,), `covariance` (k, k) for residuals of unit variance, `gain` (k, n) = J⁺, `cost` = Σr²."""

    values: FloatArray
    covariance: FloatArray
    gain: FloatArray
    cost: float


def solve(
    evaluate: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    start: FloatArray,
    scale: FloatArray,
    names: Sequence[str],
) -> Solution:
    """Minimise Σ residuals(p)² from `start` by Levenberg's and Marquardt's method; `scale` (k,) is a typical size of a change.

    `evaluate` gives the residuals (n,), of unit variance, and their derivatives (k, n) by the parameters.
    Raises EstimationError where it does not converge or the data leave a parameter undetermined.
    """
    fitted = ", ".join(names)
    values = start
    residuals, slopes = evaluate(values)
    cost, damping = float(residuals @ residuals), 0.0
    if not np.isfinite(cost):
        raise EstimationError(f"the fit of {fitted} does not start; check the record")
    for _ in range(_ROUNDS):
        normal, gradient = scale * (slopes @ slopes.T) * scale[:, None], scale * (slopes @ residuals)
        damped = normal + damping * np.diag(np.diag(normal))
        step = np.linalg.lstsq(damped, -gradient, rcond=1e-15)[0]
        # The squares fall by the step's own square in units of its variance.
        fall = float(-gradient @ step)
        if fall < _LAST_STEP**2 * max(1.0, cost / residuals.size):
            break
        tried = evaluate(values + step * scale)
        reached = float(tried[0] @ tried[0])
        if reached < cost:
            values, cost = values + step * scale, reached
            residuals, slopes = tried
            damping = 0.1 * damping if damping > _LEAST_DAMPING else 0.0
        else:
            damping = max(10.0 * damping, _LEAST_DAMPING)
    else:
        raise EstimationError(f"the fit of {fitted} does not converge; check that the record shows what it should")
    q, r = np.linalg.qr((slopes * scale[:, None]).T)
    sizes = np.linalg.svd(r, compute_uv=False)
    if not sizes[-1] > 1e-10 * sizes[0]:
        raise EstimationError(f"the record does not determine {fitted} apart; take a longer or livelier one")
    inverse = (scale[:, None] * np.linalg.inv(r)) @ q.T
    # So small a last step does what the derivatives say.
    return Solution(values + step * scale, inverse @ inverse.T, inverse, cost - fall)
