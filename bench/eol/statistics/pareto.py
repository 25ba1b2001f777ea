"""Shares of failures, the most frequent first."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import accumulate


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
