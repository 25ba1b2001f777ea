"""Individuals charts and the rules that tell a process that has changed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

#: Moving range of two: mean range over standard deviation (d2), and the range chart's upper factor (D4).
D2, _D4 = 1.128379167, 3.267


@dataclass(frozen=True)
class Signal:
    """A rule that a point (index from 0) breaks, by its number in Nelson's list (Journal of Quality Technology 16, 1984)."""

    index: int
    rule: int


@dataclass(frozen=True)
class Chart:
    """Centre line, standard deviation by the mean moving range, the control limits of values and of moving ranges, signals."""

    centre: float
    sigma: float
    low: float
    high: float
    range_high: float
    signals: tuple[Signal, ...]


def individuals_chart(
    values: ArrayLike, *, baseline: int | None = None, rules: Sequence[int] = (1, 2, 3, 5, 6)
) -> Chart:
    """Return the chart of single values in their order; centre and sigma come from the first `baseline` of them, else all.

    Rules: 1 a point beyond 3 sigma; 2 nine in a row on one side; 3 six in a row rising or falling; 4 fourteen in a row up and
    down in turn; 5 two of three beyond 2 sigma on one side; 6 four of five beyond 1 sigma on one side; 7 fifteen in a row within
    1 sigma; 8 eight in a row beyond 1 sigma on both sides. Raises ValueError for fewer than two values.
    """
    data = np.asarray(values, dtype=np.float64)
    base = data[:baseline]
    if base.size < 2:
        raise ValueError("a control chart needs two values at least")
    centre = float(base.mean())
    mean_range = float(np.abs(np.diff(base)).mean())
    sigma = mean_range / D2
    signals = sorted(
        (Signal(int(index), rule) for rule in rules for index in _broken(rule, data - centre, sigma)),
        key=lambda signal: (signal.index, signal.rule),
    )
    return Chart(centre, sigma, centre - 3.0 * sigma, centre + 3.0 * sigma, _D4 * mean_range, tuple(signals))


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
