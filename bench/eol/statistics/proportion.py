"""Shares: of yields with their interval, of failures added up."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate


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


@dataclass(frozen=True)
class ParetoShare:
    """One cause's share of all failures, and that of it and all before it; NaN where nothing failed."""

    share: float
    cumulative: float


def pareto(counts: Sequence[int]) -> list[ParetoShare]:
    """Return the shares of counts in their order."""
    total = sum(counts)
    if not total:
        return [ParetoShare(math.nan, math.nan) for _ in counts]
    return [
        ParetoShare(count / total, so_far / total) for count, so_far in zip(counts, accumulate(counts), strict=True)
    ]
