"""Process capability with its interval."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from bench.eol.limits import Limits


@dataclass(frozen=True)
class Capability:
    """`cp` and `cpk` with two-sided confidence intervals; NaN where they are not defined (an open side, fewer than two values)."""

    count: int
    mean: float
    standard_deviation: float
    cp: float
    cp_interval: tuple[float, float]
    cpk: float
    cpk_interval: tuple[float, float]


def capability(values: ArrayLike, limits: Limits, confidence: float = 0.95) -> Capability:
    """Return the capability of values within limits, both in one unit, by the overall standard deviation.

    Cp's interval is exact for normal values (chi square); Cpk's is Bissell's normal approximation (1990), as
    ISO 22514-2 and NIST/SEMATECH 7.1.6 give them.
    """
    data = np.asarray(values, dtype=np.float64)
    count = int(data.size)
    mean = float(data.mean()) if count else math.nan
    spread = float(data.std(ddof=1)) if count > 1 else math.nan
    return of_moments(count, mean, spread, limits, confidence)


def of_moments(count: int, mean: float, spread: float, limits: Limits, confidence: float = 0.95) -> Capability:
    """Return the capability from count, mean and standard deviation (n − 1), as a database sums them up."""
    # Slow to import; most commands of the line need no distribution.
    from scipy.stats import chi2, norm

    if count < 2 or not spread > 0.0:
        nothing = (math.nan, math.nan)
        return Capability(count, mean, spread, math.nan, nothing, math.nan, nothing)
    alpha, freedom = 1.0 - confidence, count - 1
    cp = limits.tolerance / (6.0 * spread) if math.isfinite(limits.tolerance) else math.nan
    factors = [math.sqrt(float(chi2.ppf(p, freedom)) / freedom) for p in (alpha / 2.0, 1.0 - alpha / 2.0)]
    sides = [side for side in ((limits.high - mean), (mean - limits.low)) if math.isfinite(side)]
    cpk = min(sides) / (3.0 * spread) if sides else math.nan
    half = float(norm.ppf(1.0 - alpha / 2.0)) * math.sqrt(1.0 / (9.0 * count) + cpk**2 / (2.0 * freedom))
    return Capability(count, mean, spread, cp, (cp * factors[0], cp * factors[1]), cpk, (cpk - half, cpk + half))
