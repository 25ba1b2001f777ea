"""Counts and sums of a parameter's figures by bin: about a middle, or the variance would drown in the mean's square."""

import math
from bisect import bisect_right
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import ColumnElement, Connection, case, func, select
from sqlalchemy import literal as bound

from bench.eol.limits import ParameterLimits
from bench.eol.store.schema import FIGURE

#: Bins between the limits, and beyond each of them.
_INSIDE, _OUTSIDE = 24, 6
#: Where only the spread tells where bins should lie: this many standard deviations to either side.
_REACH = 5.0


@dataclass(frozen=True)
class BinnedSums:
    """Count by bin, and the sums of (value − middle) and of its square; NaN and values that are none are left out."""

    counts: tuple[int, ...]
    middle: float
    total: float
    squares: float

    @property
    def count(self) -> int:
        """Return how many values there are."""
        return sum(self.counts)

    def about(self, middle: float) -> "BinnedSums":
        """Return the same sums about another middle (Chan, Golub, LeVeque, The American Statistician 37, 1983)."""
        off = self.middle - middle
        total = self.total + self.count * off
        return BinnedSums(self.counts, middle, total, self.squares + 2.0 * off * self.total + self.count * off * off)

    def without(self, values: Iterable[float], edges: Sequence[float]) -> "BinnedSums":
        """Return the sums without some of the values that are in them."""
        counts, total, squares = list(self.counts), self.total, self.squares
        for value in values:
            counts[bisect_right(edges, value) - 1] -= 1
            total -= value - self.middle
            squares -= (value - self.middle) ** 2
        return BinnedSums(tuple(counts), self.middle, total, squares)


def sums_of(values: NDArray[np.float64], edges: Sequence[float], middle: float) -> BinnedSums:
    """Return the sums of values that are here."""
    bins = np.searchsorted(edges[1:-1], values, side="right")
    off = values - middle
    counts = np.bincount(bins, minlength=len(edges) - 1).tolist()
    return BinnedSums(tuple(counts), middle, float(np.sum(off)), float(np.sum(off * off)))


def together(parts: Sequence[BinnedSums], middle: float, bins: int) -> BinnedSums:
    """Return sums over the same bins, added up about one middle."""
    moved = [part.about(middle) for part in parts]
    counts = tuple(sum(column) for column in zip(*(part.counts for part in moved), strict=True)) or (0,) * bins
    return BinnedSums(
        counts, middle, math.fsum(part.total for part in moved), math.fsum(part.squares for part in moved)
    )


def summed_by_bin(
    connection: Connection, condition: ColumnElement[bool], edges: Sequence[float], middle: float
) -> BinnedSums:
    """Return the sums of the figures of a condition, in one pass over them."""
    value = FIGURE.c.value
    bin_of = case(*((value < edge, n) for n, edge in enumerate(edges[1:-1])), else_=len(edges) - 2)
    off = value - bound(middle)
    rows = connection.execute(
        select(bin_of.label("bin"), func.count(), func.sum(off), func.sum(off * off))
        .where(condition, value.is_not(None))
        .group_by("bin")
    ).all()
    counts = [0] * (len(edges) - 1)
    for row in rows:
        counts[row[0]] = row[1]
    return BinnedSums(tuple(counts), middle, math.fsum(row[2] for row in rows), math.fsum(row[3] for row in rows))


def bin_edges(limits: ParameterLimits, middle: float, seen: Sequence[float]) -> list[float]:
    """Return the bins' edges, open at both ends: the limits are edges themselves where there are two."""
    if math.isfinite(limits.tolerance) and limits.tolerance > 0.0:
        low, width = limits.low, limits.tolerance / _INSIDE
        # A value on the upper limit is within it.
        inner = [low + n * width for n in range(_INSIDE)] + [math.nextafter(limits.high, math.inf)]
    else:
        spread = math.sqrt(math.fsum((x - middle) ** 2 for x in seen) / max(1, len(seen) - 1)) if seen else 0.0
        reach = _REACH * spread or 1e-3 * abs(middle) or 1.0
        width = 2.0 * reach / _INSIDE
        inner = [middle - reach + n * width for n in range(_INSIDE + 1)]
    below = [inner[0] - n * width for n in range(_OUTSIDE, 0, -1)]
    above = [inner[-1] + n * width for n in range(1, _OUTSIDE + 1)]
    return [-math.inf, *below, *inner, *above, math.inf]
