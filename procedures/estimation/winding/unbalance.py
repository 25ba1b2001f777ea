"""Unbalance of the three phases of a machine: deviations from their mean."""

import math
from collections.abc import Sequence
from typing import Generic, NamedTuple

import numpy as np
from scipy import special

from procedures.estimation.fitting.checks import Number, estimate_of
from procedures.estimation.fitting.fit import EstimationError


class Deviation(NamedTuple, Generic[Number]):
    """The value farthest from the mean of all: which it is, and by what share of the mean, above or below."""

    place: int
    share: Number


class Pooled(NamedTuple):
    """Means of groups of readings, and one standard deviation of a single reading for all, with its degrees of freedom."""

    means: tuple[float, ...]
    deviation: float
    degrees_of_freedom: float


def largest_deviation(values: Sequence[Number]) -> Deviation[Number]:
    """Return which of the values is farthest from their mean, and its deviation over the mean.

    The form is that of the voltage unbalance of NEMA MG 1. Raises EstimationError where the mean is not above zero.
    """
    mean = _mean(values)
    # The size of an uncertain number by abs() would be a plain one.
    shares = [(value / mean - 1.0) * (1.0 if value >= mean else -1.0) for value in values]
    place = max(range(len(shares)), key=lambda k: estimate_of(shares[k]))
    return Deviation(place, shares[place])


def spread(values: Sequence[Number]) -> Number:
    """Return the largest less the smallest of the values over their mean. Raises EstimationError where that is not above zero."""
    ordered = sorted(values, key=estimate_of)
    share: Number = (ordered[-1] - ordered[0]) / _mean(values)
    return share


def pooled(groups: Sequence[Sequence[float]]) -> Pooled:
    """Return the groups' means, and the standard deviation of one reading from the scatter within all groups (JCGM 100, H.5.2.5).

    Without a group of two or more readings nothing is known of it: it is 0, with infinite degrees of freedom.
    """
    freedom = sum(len(group) - 1 for group in groups)
    means = tuple(float(np.mean(group)) for group in groups)
    if not freedom:
        return Pooled(means, 0.0, math.inf)
    squares = sum(float(np.sum((np.asarray(group) - mean) ** 2)) for group, mean in zip(groups, means, strict=True))
    return Pooled(means, math.sqrt(squares / freedom), float(freedom))


def all_at_once(count: int, degrees_of_freedom: float) -> float:
    """Return by what factor an interval of 95 % widens so that `count` of them hold all at once (Bonferroni).

    Whichever of several deviations turns out to be the largest is not one that was chosen beforehand.
    """
    one, all_of_them = 0.975, 1.0 - 0.025 / count
    if math.isinf(degrees_of_freedom):
        return float(special.ndtri(all_of_them) / special.ndtri(one))
    return float(special.stdtrit(degrees_of_freedom, all_of_them) / special.stdtrit(degrees_of_freedom, one))


def saliency_share(d_axis: float, q_axis: float) -> float:
    """Return by how much of the mean a line inductance may differ from it for the rotor's position alone.

    Between two lines a machine of `d_axis` and `q_axis` inductance (H) shows Ld + Lq + (Ld − Lq)·cos(2θ + …).
    """
    return abs(q_axis - d_axis) / (q_axis + d_axis)


def _mean(values: Sequence[Number]) -> Number:
    mean = sum(values[1:], values[0]) / len(values)
    if not (math.isfinite(estimate_of(mean)) and estimate_of(mean) > 0.0):
        raise EstimationError(
            f"the mean of {', '.join(f'{estimate_of(value):g}' for value in values)} is not above zero"
        )
    return mean
