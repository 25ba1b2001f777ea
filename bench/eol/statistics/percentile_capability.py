"""Performance of a process whose figures are not normal: by percentiles, with intervals that assume no distribution."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bench.eol.limits import ParameterLimits

#: What a normal distribution has within 3 standard deviations below and above its middle.
LOW, MIDDLE, HIGH = 0.00135, 0.5, 0.99865
#: Fewer values than this hardly have one beyond the outer percentiles: the largest would stand for what is not known.
FEWEST = math.ceil(1.0 / LOW)
#: Errors that may each happen once: each of three percentiles lies below or above its interval.
_ERRORS = 6


@dataclass(frozen=True)
class PercentileRanks:
    """The order statistics (from 1) that bound a percentile: `low` is 0 and `high` is count + 1 if none does; `at` lies between
    two.
    """

    low: int
    at: float
    high: int


@dataclass(frozen=True)
class PercentileCapability:
    """Pp and Ppk by the percentiles 0.135, 50 and 99.865 % (ISO 22514-2), with two-sided intervals.

    Pp and Ppk are NaN for fewer values than `FEWEST`, for an open side (Pp), and where so many values are alike that the percentiles are
    one and the same (`alike`); their intervals hold all the same. Where no value bounds a percentile the interval begins at 0.
    """

    count: int
    percentiles: tuple[float, float, float]
    pp: float
    pp_interval: tuple[float, float]
    ppk: float
    ppk_interval: tuple[float, float]
    alike: bool = False


def ranks_of(count: int, confidence: float = 0.95) -> dict[float, PercentileRanks]:
    """Return by percentile the ranks that bound it, such that the indices' intervals have the confidence asked for.

    Source: order statistics as bounds of a quantile, by the binomial distribution (David and Nagaraja, Order Statistics, 2003, 7.1).
    """
    error = (1.0 - confidence) / _ERRORS
    return {share: _ranks(count, share, error) for share in (LOW, MIDDLE, HIGH)}


def needed(ranks: Mapping[float, PercentileRanks], count: int) -> list[int]:
    """Return the ranks whose values `by_percentiles` asks for."""
    wanted = {
        rank for each in ranks.values() for rank in (each.low, math.floor(each.at), math.ceil(each.at), each.high)
    }
    return sorted(rank for rank in wanted if 1 <= rank <= count)


def by_percentiles(
    count: int, ranks: Mapping[float, PercentileRanks], values: Mapping[int, float], limits: ParameterLimits
) -> PercentileCapability:
    """Return Pp and Ppk from the values at the ranks of `needed`."""
    lows, points, highs = {}, {}, {}
    for share, rank in ranks.items():
        lows[share], highs[share] = values.get(rank.low, -math.inf), values.get(rank.high, math.inf)
        below, above = (values.get(end, math.nan) for end in (math.floor(rank.at), math.ceil(rank.at)))
        points[share] = below + (above - below) * (rank.at - math.floor(rank.at)) if above != below else below
    known = count >= FEWEST
    pp, pp_interval = math.nan, (math.nan, math.nan)
    if math.isfinite(limits.tolerance):
        widest = highs[HIGH] - lows[LOW]
        pp = limits.tolerance / (points[HIGH] - points[LOW]) if known and points[HIGH] > points[LOW] else math.nan
        pp_interval = (limits.tolerance / widest, _ratio(limits.tolerance, lows[HIGH] - highs[LOW]))
    sides = []
    alike = False
    if math.isfinite(limits.high):
        ends = (lows[MIDDLE], highs[MIDDLE], lows[HIGH], highs[HIGH])
        alike |= points[HIGH] == points[MIDDLE]
        sides.append(
            (_ratio(limits.high - points[MIDDLE], points[HIGH] - points[MIDDLE]), *_bounds(limits.high, *ends))
        )
    if math.isfinite(limits.low):
        ends = (-highs[MIDDLE], -lows[MIDDLE], -highs[LOW], -lows[LOW])
        alike |= points[LOW] == points[MIDDLE]
        sides.append((_ratio(points[MIDDLE] - limits.low, points[MIDDLE] - points[LOW]), *_bounds(-limits.low, *ends)))
    if not sides:
        return PercentileCapability(
            count, (points[LOW], points[MIDDLE], points[HIGH]), pp, pp_interval, math.nan, (math.nan, math.nan)
        )
    return PercentileCapability(
        count,
        (points[LOW], points[MIDDLE], points[HIGH]),
        pp,
        pp_interval,
        min(side[0] for side in sides) if known and not alike else math.nan,
        (min(side[1] for side in sides), min(side[2] for side in sides)),
        known and alike,
    )


def _bounds(limit: float, middle_low: float, middle_high: float, low: float, high: float) -> tuple[float, float]:
    """Return between what (limit − middle)/(outer − middle) lies, for a middle and an outer percentile that lie between bounds."""
    if math.isinf(middle_low) or math.isinf(middle_high):
        return -math.inf, math.inf
    # It is monotone in each of them, so that its extremes are at the corners.
    corners = [_ratio(limit - middle, outer - middle) for middle in (middle_low, middle_high) for outer in (low, high)]
    return min(corners), max(corners)


def _ratio(room: float, width: float) -> float:
    """Return how many times the room up to a limit holds a width, which may be unknown (infinite) or none."""
    if math.isnan(room) or math.isnan(width):
        return math.nan
    if width == math.inf:
        return 0.0
    return room / width if width > 0.0 else math.copysign(math.inf, room)


def _ranks(count: int, share: float, error: float) -> PercentileRanks:
    from scipy.special import bdtr, bdtrc

    reach = 10.0 * math.sqrt(count * share * (1.0 - share)) + 10.0
    near = np.arange(max(0, int(count * share - reach)), min(count, int(count * share + reach)) + 1)
    # Value number r lies beyond the percentile where fewer than r values are below it.
    low = near[bdtr(near - 1.0, count, share) <= error] if near.size else near
    high = near[bdtrc(near - 1.0, count, share) <= error] if near.size else near
    at = min(max(share * (count + 1), 1.0), float(count))
    return PercentileRanks(int(low.max()) if low.size else 0, at, int(high.min()) if high.size else count + 1)
