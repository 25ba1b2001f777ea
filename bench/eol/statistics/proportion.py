"""A share with its interval: yields."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Proportion:
    """`hits` of `count`; `share` and its two-sided interval are NaN where nothing was counted."""

    hits: int
    count: int
    share: float
    interval: tuple[float, float]


def proportion(hits: int, count: int, confidence: float = 0.95) -> Proportion:
    """Return a share with its exact interval (Clopper, Pearson, Biometrika 26, 1934; NIST/SEMATECH 7.2.4.1).

    Raises ValueError for counts that cannot be.
    """
    from scipy.special import betaincinv

    if not 0 <= hits <= count:
        raise ValueError(f"{hits} of {count} is no share")
    if count == 0:
        return Proportion(0, 0, math.nan, (math.nan, math.nan))
    tail = (1.0 - confidence) / 2.0
    low = float(betaincinv(hits, count - hits + 1, tail)) if hits else 0.0
    high = float(betaincinv(hits + 1, count - hits, 1.0 - tail)) if hits < count else 1.0
    return Proportion(hits, count, hits / count, (low, high))
