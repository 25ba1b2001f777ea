"""Linear least squares with a covariance that never falls below what the readings' resolution allows."""

from collections.abc import Sequence

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray


def least_squares(names: Sequence[str], design: FloatArray, data: FloatArray, *, resolution: float = 0.0) -> Fit:
    """Fit data (n,) by design (n, k) with equal weights; `resolution` is one step of the data.

    Raises EstimationError where there are no more points than parameters, or the points do not determine them.
    """
    points, parameters = design.shape
    if points <= parameters:
        raise EstimationError(f"{points} points do not suffice for {parameters} parameters; take more points")
    scale = np.sqrt(np.sum(design**2, axis=0))
    if np.any(scale == 0):
        raise EstimationError(
            f"the data hold nothing on {', '.join(n for n, s in zip(names, scale, strict=True) if s == 0)}"
        )
    u, s, vt = np.linalg.svd(design / scale, full_matrices=False)
    if s[-1] < 1e-9 * s[0]:
        raise EstimationError(f"the points do not determine {', '.join(names)} apart; spread them more")
    values = (vt.T @ ((u.T @ data) / s)) / scale
    residuals = data - design @ values
    squares = float(residuals @ residuals)
    freedom = points - parameters
    variance = max(squares / freedom, resolution**2 / 12.0)
    covariance = variance * (vt.T / s**2) @ vt / np.outer(scale, scale)
    return Fit(tuple(names), values, covariance, float(freedom), residuals, float(np.sqrt(squares / points)))
