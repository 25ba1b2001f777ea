"""Limits of a golden motor out of its own earlier tests: what an unchanged station stays within."""

import math
from collections.abc import Mapping, Sequence

from scipy.special import stdtrit

from bench.eol.limits import ParameterLimits

#: Of so many golden tests at an unchanged station one is outside, whatever the number of figures (Bonferroni).
ONE_IN = 100
#: Where earlier figures are all alike, a rounding more or less is no change.
_ROUNDING = 1e-6


def limits_of_history(history: Mapping[str, Sequence[float]]) -> dict[str, ParameterLimits]:
    """Return for each parameter the interval in which the next figure lies, of normally distributed ones by their mean and spread.

    All figures together are within theirs in 99 % of the tests. Parameters with fewer than two figures have no limits.
    Source: W. Q. Meeker, G. J. Hahn, L. A. Escobar, Statistical Intervals, 2nd ed., 4.7 (prediction of one future observation).
    """
    known = {name: values for name, values in history.items() if len(values) > 1 and all(map(math.isfinite, values))}
    return {name: _prediction(values, 1.0 / (ONE_IN * len(known))) for name, values in known.items()}


def _prediction(values: Sequence[float], outside: float) -> ParameterLimits:
    count = len(values)
    mean = math.fsum(values) / count
    spread = math.sqrt(math.fsum((value - mean) ** 2 for value in values) / (count - 1))
    quantile = float(stdtrit(count - 1, 1.0 - 0.5 * outside))
    half = max(quantile * spread * math.sqrt(1.0 + 1.0 / count), _ROUNDING * abs(mean))
    return ParameterLimits(mean - half, mean + half)
