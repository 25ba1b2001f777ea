"""Derivatives of what a high pass makes of a current, by the figures of second circuits and dividers."""

import math

import numpy as np

from procedures.estimation.fitting.first_order import response_and_slope_evenly
from procedures.estimation.fitting.fit import FloatArray


def by_share_and_lag(values: FloatArray, step: float, lag: float, share: float, figures: FloatArray) -> FloatArray:
    """Return the derivatives (k, n) of `share` times values (n,) through a high pass of a time constant `lag` (s) by figures (k,).

    The share is the first figure over exp(the second one), the time constant grows with exp(the second one), if there is one.
    """
    rate = 1.0 / lag
    answer, by_rate = response_and_slope_evenly(step, values, rate)
    passed = values - rate * answer
    by_first = math.exp(-float(np.sum(figures[1:]))) * passed
    return np.array([by_first, share * (rate * (answer + rate * by_rate) - passed)][: figures.size])
