"""How unlike the three phases of a machine are: deviations from their mean."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from procedures.estimation.fitting.fit import EstimationError


class Deviation(NamedTuple):
    """The value farthest from the mean of all: which it is, and by how much of the mean (signed)."""

    place: int
    share: float


class Pooled(NamedTuple):
    """Means of groups of readings, and one standard deviation of a single reading for all, with its degrees of freedom."""

    means: tuple[float, ...]
    deviation: float
    degrees_of_freedom: float


def largest_deviation(values: Sequence[float]) -> Deviation:
    """Return which of the values is farthest from their mean, and its deviation over the mean.

    The form is that of the voltage unbalance of NEMA MG 1. Raises EstimationError where the mean is not above zero.
    """
    mean = sum(values) / len(values)
    if not (math.isfinite(mean) and mean > 0.0):
        raise EstimationError(f"the mean of {', '.join(f'{value:g}' for value in values)} is not above zero")
    shares = [value / mean - 1.0 for value in values]
    place = max(range(len(shares)), key=lambda k: abs(shares[k]))
    return Deviation(place, shares[place])


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


def saliency_share(d_axis: float, q_axis: float) -> float:
    """Return by how much of the mean a line inductance may differ from it for the rotor's position alone.

    Between two lines a machine of `d_axis` and `q_axis` inductance (H) shows Ld + Lq + (Ld − Lq)·cos(2θ + …).
    """
    return abs(q_axis - d_axis) / (q_axis + d_axis)
