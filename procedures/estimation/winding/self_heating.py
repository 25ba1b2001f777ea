"""A winding that is warmed by the readings themselves: the resulting uncertainty of the cold resistance."""

from dataclasses import replace

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import Fit, FloatArray
from procedures.estimation.fitting.linear import least_squares

#: How many readings warmth lasts: none beyond its own, as a fine wire's, some, or all.
_LASTS = (0.0, 1.0, 4.0)
#: What chance makes of the square of a score that nothing is behind, and this much more, does not count.
_CHANCE = 2.5
#: Scores beyond this are as good as certain, and not infinite.
_MOST = 40.0


def allowed_for_heating(
    fit: Fit, plain: FloatArray, voltage: FloatArray, current: FloatArray, least: float = 0.0
) -> Fit:
    """Return the fit of four-wire readings (V, A, shape (n,)) with what warming may do to the resistance, its first estimate, and at least
    a variance (Ω²) for other causes.

    `plain` (n, k) is the fit's design. Most of what a resistance does that follows the square of its current looks like a larger
    resistance, so what is seen of the rest counts long before it is beyond chance. It can only rise.
    """
    if voltage.size <= plain.shape[1] + 1:
        return fit
    names = tuple(str(k) for k in range(plain.shape[1] + 1))
    most = least
    for lasts in _LASTS:
        further = least_squares(names, np.column_stack((plain, current * _warmth(current, lasts))), voltage)
        rise, uncertainty = further.value(names[-1]), further.uncertainty(names[-1])
        if rise * fit.value("resistance") <= 0.0 or uncertainty <= 0.0:
            continue
        chance = float(special.stdtr(further.degrees_of_freedom, -rise / uncertainty))
        z = min(-float(special.ndtri(max(chance, 1e-300))), _MOST)
        seen = max(0.0, 1.0 - _CHANCE / z**2) if z > 0.0 else 0.0
        most = max(most, seen * (further.value(names[0]) - fit.value("resistance")) ** 2)
    covariance = fit.covariance.copy()
    covariance[0, 0] += most
    return replace(fit, covariance=covariance)


def _warmth(current: FloatArray, lasts: float) -> FloatArray:
    """Return how warm each reading finds a winding whose warmth lasts so many readings, by what the largest current does in one."""
    power = (current / float(np.max(np.abs(current)))) ** 2
    if not lasts:
        return np.asarray(power)
    apart = np.subtract.outer(np.arange(current.size), np.arange(current.size))
    return np.asarray(np.where(apart >= 0, np.exp(-np.maximum(apart, 0) / lasts), 0.0) @ power)
