"""Drift of a golden motor: one motor measured again and again, so that what changes is the station."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

_DAY = 86400.0


@dataclass(frozen=True)
class Drift:
    """A straight line through a golden motor's figures: `slope` in the figure's unit per day, with its two-sided interval.

    `change` is the line's rise from the first to the last measurement; `significant` tells that the interval leaves out zero.
    """

    count: int
    mean: float
    standard_deviation: float
    slope: float
    slope_interval: tuple[float, float]
    change: float
    significant: bool


def drift(times: ArrayLike, values: ArrayLike, confidence: float = 0.95) -> Drift:
    """Return the drift of values over times (s) by least squares, the interval by Student's t.

    The slope is NaN for fewer than three values, and where all were taken at one time.
    """
    from scipy.special import stdtrit

    when, data = np.asarray(times, dtype=np.float64) / _DAY, np.asarray(values, dtype=np.float64)
    count = int(data.size)
    mean = float(data.mean()) if count else math.nan
    spread = float(data.std(ddof=1)) if count > 1 else math.nan
    off = when - when.mean() if count else when
    lever = float((off**2).sum())
    if count < 3 or lever == 0.0:
        return Drift(count, mean, spread, math.nan, (math.nan, math.nan), math.nan, False)
    slope = float((off * (data - mean)).sum()) / lever
    rest = data - mean - slope * off
    freedom = count - 2
    half = float(stdtrit(freedom, 0.5 + confidence / 2.0)) * math.sqrt(float((rest**2).sum()) / freedom / lever)
    interval = (slope - half, slope + half)
    change = slope * float(when.max() - when.min())
    return Drift(count, mean, spread, slope, interval, change, interval[0] > 0.0 or interval[1] < 0.0)
