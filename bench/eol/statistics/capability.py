"""Capability and performance of a process, with intervals."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bench.eol.limits import ParameterLimits
from bench.eol.statistics.control_chart import D2

#: A spread of no more than this share of the mean is what rounding leaves of values that are all alike.
ALIKE = 1e-12


@dataclass(frozen=True)
class Capability:
    """Cp and Cpk by one standard deviation, with two-sided confidence intervals; NaN where they are not defined.

    By the standard deviation within (of neighbours) they are Cp and Cpk, by the overall one Pp and Ppk (ISO 22514-2).
    They are not defined for an open side (Cp), for fewer than two values, and for values that are all alike.
    """

    count: int
    mean: float
    standard_deviation: float
    cp: float
    cp_interval: tuple[float, float]
    cpk: float
    cpk_interval: tuple[float, float]


def of_moments(
    count: int,
    mean: float,
    spread: float,
    limits: ParameterLimits,
    confidence: float = 0.95,
    *,
    freedom: float | None = None,
) -> Capability:
    """Return the capability from count, mean and standard deviation with its degrees of freedom (n − 1 where none are given).

    Cp's interval is exact for normal values (chi square); Cpk's is Bissell's normal approximation (1990), as
    ISO 22514-2 and NIST/SEMATECH 7.1.6 give them.
    """
    # scipy.stats takes a second to load, and these are the same functions.
    from scipy.special import chdtri, ndtri

    if count < 2 or not spread > ALIKE * abs(mean):
        nothing = (math.nan, math.nan)
        return Capability(count, mean, spread, math.nan, nothing, math.nan, nothing)
    alpha = 1.0 - confidence
    known = count - 1.0 if freedom is None else freedom
    cp = limits.tolerance / (6.0 * spread) if math.isfinite(limits.tolerance) else math.nan
    factors = [math.sqrt(float(chdtri(known, 1.0 - p)) / known) for p in (alpha / 2.0, 1.0 - alpha / 2.0)]
    sides = [side for side in ((limits.high - mean), (mean - limits.low)) if math.isfinite(side)]
    cpk = min(sides) / (3.0 * spread) if sides else math.nan
    half = float(ndtri(1.0 - alpha / 2.0)) * math.sqrt(1.0 / (9.0 * count) + cpk**2 / (2.0 * known))
    return Capability(count, mean, spread, cp, (cp * factors[0], cp * factors[1]), cpk, (cpk - half, cpk + half))


def spread_within(rows: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Return the standard deviation of neighbours by their mean moving range, and its degrees of freedom; NaN and 0 without any.

    `rows` are values that followed each other; from the end of one to the beginning of the next is no neighbourhood. With 0.62
    degrees of freedom a range (Wheeler, Advanced Topics in Statistical Process Control, 1995, table 3.2).
    """
    ranges = [np.abs(np.diff(np.asarray(row, dtype=np.float64))) for row in rows]
    count = sum(each.size for each in ranges)
    if not count:
        return math.nan, 0.0
    return float(sum(each.sum() for each in ranges)) / count / D2, max(1.0, 0.62 * count)
