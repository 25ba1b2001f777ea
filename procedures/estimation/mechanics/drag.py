"""Drag over speed: the torque to turn a motor without current."""

import math

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, Fit

#: Terms of a drag over the speed: constant, linear, quadratic.
NAMES = ("constant", "linear", "quadratic")


def fit_drag(speed: ArrayLike, torque: ArrayLike, uncertainty: ArrayLike) -> Fit:
    """Fit T = a + b·ω + c·ω² (N·m, N·m·s/rad, N·m·s²/rad²) to drags (N·m) at mechanical speeds (rad/s).

    With two speeds the quadratic term is left out, with one the linear one too. `uncertainty` (N·m) is each point's own; where points
    scatter beyond it, the covariance grows. Bearings, air and iron are in all three terms, and no term is one of them alone. Raises
    EstimationError for no point, or speeds that do not tell the terms apart.
    """
    omega, drag, own = series("speeds", speed), series("torques", torque), series("uncertainties", uncertainty)
    same_length(speeds=omega, torques=drag, uncertainties=own)
    terms = min(omega.size, len(NAMES))
    design = np.vander(omega, terms, increasing=True) / own[:, np.newaxis]
    scale = np.sqrt(np.sum(design**2, axis=0))
    u, s, vt = np.linalg.svd(design / scale, full_matrices=False)
    if s[-1] < 1e-9 * s[0]:
        raise EstimationError("the speeds do not determine the drag's course; spread them more")
    values = (vt.T @ ((u.T @ (drag / own)) / s)) / scale
    left = drag - np.vander(omega, terms, increasing=True) @ values
    # As many terms as points leave nothing: what is known then is what the points are known by.
    freedom = float(omega.size - terms) or math.inf
    growth = max(float(np.sum((left / own) ** 2)) / freedom, 1.0)
    covariance = growth * (vt.T / s**2) @ vt / np.outer(scale, scale)
    return Fit(NAMES[:terms], values, covariance, freedom, left, float(np.sqrt(np.mean(left**2))))


def drag_at(fit: Fit, speed: ArrayLike) -> tuple[np.ndarray, np.ndarray]:
    """Return a fitted drag (N·m) and its standard uncertainty at mechanical speeds (rad/s), both of the speeds' shape."""
    powers = np.vander(np.atleast_1d(np.asarray(speed, dtype=np.float64)), len(fit.values), increasing=True)
    variance = np.einsum("nk,kl,nl->n", powers, fit.covariance, powers)
    return powers @ fit.values, np.sqrt(np.maximum(variance, 0.0))
