"""Individuals charts and the rules that tell a process that has changed."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Signalled where the level changes for good; Nelson's rules are 1 to 8.
SHIFT = 9
#: Moving range of two: mean range over standard deviation (d2).
D2 = 1.128379167
#: The share of charts that signal for nothing, and of these the share that points far off may make; the rest is left to shifts.
_FALSE_ALARMS, _POINTS = 0.01, 0.7
#: Charts of which the false alarms of named rules are counted: the share is known to ± 2 %.
_SIMULATED = 2000


@dataclass(frozen=True)
class Signal:
    """A rule that a point (index from 0) breaks, by its number in Nelson's list (Journal of Quality Technology 16, 1984)."""

    index: int
    rule: int


@dataclass(frozen=True)
class Chart:
    """Centre line, standard deviation by the mean moving range, the control limits, signals.

    A point signals beyond `reach` sigma (rule 1), and the last one before the level changes for good (`SHIFT`). `false_alarms` is
    the share of charts of this length, of a process that does not change, on which anything signals: a bound, or for rules that
    were named, by simulation. Where the values are not normal, centre is the median, limits are infinite, and only a shift signals.
    A limit that lies where no value can be is infinite, too.
    """

    centre: float
    sigma: float
    low: float
    high: float
    signals: tuple[Signal, ...]
    reach: float
    false_alarms: float


def individuals_chart(
    values: ArrayLike,
    *,
    rules: Sequence[int] = (),
    normal: bool = True,
    possible: tuple[float, float] = (-math.inf, math.inf),
) -> Chart:
    """Return the chart of single values in their order; centre and sigma come from all of them.

    Without `rules`, points far off and a lasting change of level signal, with limits such that at most a hundredth of
    charts of this length signals for nothing. Named rules are Nelson's: 1 a point beyond 3 sigma; 2 nine in a row on one side; 3 six in
    a row rising or falling; 4 fourteen in a row up and down in turn; 5 two of three beyond 2 sigma on one side; 6 four of five
    beyond 1 sigma on one side; 7 fifteen in a row within 1 sigma; 8 eight in a row beyond 1 sigma on both sides.
    `possible` is the range of values that there can be.
    Raises ValueError for fewer than two values.
    """
    data = np.asarray(values, dtype=np.float64)
    if data.size < 2:
        raise ValueError("a control chart needs two values at least")
    centre = float(data.mean()) if normal or rules else float(np.median(data))
    mean_range = float(np.abs(np.diff(data)).mean())
    sigma = mean_range / D2
    off = data - centre
    if rules:
        reach, alarms = 3.0, simulated_false_alarms(tuple(rules), data.size)
        found = [Signal(int(index), rule) for rule in rules for index in _broken(rule, off, sigma)]
    else:
        reach, alarms = math.inf, (1.0 - _POINTS) * _FALSE_ALARMS
        if normal:
            reach, alarms = _reach(data.size, _POINTS * _FALSE_ALARMS), _FALSE_ALARMS
        far = np.abs(off) > reach * sigma if sigma > 0.0 and normal else np.zeros(data.size, dtype=bool)
        found = [Signal(int(index), 1) for index in np.flatnonzero(far)]
        found += [Signal(index, SHIFT) for index in _shift(data, (1.0 - _POINTS) * _FALSE_ALARMS)]
    signals = sorted(found, key=lambda signal: (signal.index, signal.rule))
    half = reach * sigma if math.isfinite(reach) else math.inf
    low = centre - half if centre - half > possible[0] else -math.inf
    high = centre + half if centre + half < possible[1] else math.inf
    return Chart(centre, sigma, low, high, tuple(signals), reach, alarms)


@cache
def simulated_false_alarms(rules: tuple[int, ...], points: int) -> float:
    """Return the share of charts of so many independent normal values on which a rule signals, by a fixed simulation."""
    random = np.random.default_rng(1)
    signalled = 0
    for _ in range(_SIMULATED):
        data = random.standard_normal(points)
        sigma = float(np.abs(np.diff(data)).mean()) / D2
        signalled += any(_broken(rule, data - data.mean(), sigma).size for rule in rules)
    return signalled / _SIMULATED


def _reach(points: int, alarms: float) -> float:
    """Return how many sigma a point may lie off: Student's t of the moving range's freedom, the error shared among all points."""
    from scipy.special import stdtrit

    freedom = max(1.0, 0.62 * (points - 1))
    return float(stdtrit(freedom, 1.0 - alarms / (2.0 * points))) * math.sqrt((points - 1.0) / points)


def _shift(data: NDArray[np.float64], alarms: float) -> list[int]:
    """Return where the level changes for good: the last point before the change, if any.

    The cumulative sum of the ranks' deviations is held against the largest one of a Brownian bridge, whose distribution is
    Kolmogorov's, whatever that of the values (Pettitt, Applied Statistics 28, 1979).
    """
    from scipy.special import kolmogi

    _, which, counts = np.unique(data, return_inverse=True, return_counts=True)
    ends = np.cumsum(counts)
    ranks = (ends - 0.5 * (counts - 1))[which]
    spread = float(ranks.std())
    if not spread > 0.0:
        return []
    sums = np.abs(np.cumsum(ranks - ranks.mean())) / (spread * math.sqrt(data.size))
    return [int(sums.argmax())] if sums.max() > float(kolmogi(alarms)) else []


def _broken(rule: int, off: NDArray[np.float64], sigma: float) -> NDArray[np.intp]:
    """Return the last index of every run that breaks a rule."""
    upper, lower = off > 0.0, off < 0.0
    match rule:
        case 1:
            return np.flatnonzero(np.abs(off) > 3.0 * sigma)
        case 2:
            return _either(_all_of(upper, 9), _all_of(lower, 9))
        case 3:
            steps = np.diff(off)
            return 1 + _either(_all_of(steps > 0.0, 5), _all_of(steps < 0.0, 5))
        case 4:
            steps = np.diff(off)
            return 2 + _all_of(steps[1:] * steps[:-1] < 0.0, 12)
        case 5:
            return _either(_some_of(off > 2.0 * sigma, 2, 3), _some_of(off < -2.0 * sigma, 2, 3))
        case 6:
            return _either(_some_of(off > sigma, 4, 5), _some_of(off < -sigma, 4, 5))
        case 7:
            return _all_of(np.abs(off) < sigma, 15)
        case 8:
            outside = _all_of(np.abs(off) > sigma, 8)
            return np.array(
                [i for i in outside if upper[i - 7 : i + 1].any() and lower[i - 7 : i + 1].any()], dtype=np.intp
            )
        case _:
            raise ValueError(f"there is no rule {rule}; allowed are 1 to 8")


def _all_of(flags: NDArray[np.bool_], length: int) -> NDArray[np.intp]:
    return _some_of(flags, length, length)


def _some_of(flags: NDArray[np.bool_], wanted: int, length: int) -> NDArray[np.intp]:
    """Return where a window of `length` ends that holds `wanted`, the last of them being one."""
    if flags.size < length:
        return np.array([], dtype=np.intp)
    counts = np.convolve(flags.astype(np.intp), np.ones(length, dtype=np.intp), mode="valid")
    ends = np.flatnonzero(counts >= wanted) + length - 1
    return ends[flags[ends]]


def _either(first: NDArray[np.intp], second: NDArray[np.intp]) -> NDArray[np.intp]:
    return np.union1d(first, second)
