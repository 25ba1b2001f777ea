"""Repeated readings and repeated estimates of one quantity."""

import math
from collections.abc import Sequence

import numpy as np
from scipy.special import stdtrit


def mean_of_readings(values: Sequence[float]) -> tuple[float, float, float]:
    """Return mean, standard uncertainty of the mean and degrees of freedom of readings taken under one condition.

    A single reading has no statistics: its uncertainty is 0 and its degrees of freedom infinite, and what is known of it is the
    instrument's. Source: JCGM 100, 4.2.
    """
    readings = np.asarray(values, dtype=float)
    if readings.size == 1:
        return float(readings[0]), 0.0, math.inf
    return float(readings.mean()), float(readings.std(ddof=1) / math.sqrt(readings.size)), float(readings.size - 1)


def mean_of_estimates(values: Sequence[float], uncertainties: Sequence[float]) -> tuple[float, float, float]:
    """Return weighted mean, standard uncertainty and degrees of freedom of estimates with their own uncertainties.

    Where they scatter more than their uncertainties explain, the scatter decides (Birge ratio).
    """
    estimates = np.asarray(values, dtype=float)
    own = np.asarray(uncertainties, dtype=float)
    if estimates.size == 1:
        return float(estimates[0]), float(own[0]), math.inf
    if np.any(own <= 0.0):
        return mean_of_readings(values)
    weights = own**-2
    mean = float(np.sum(weights * estimates) / np.sum(weights))
    internal = float(np.sum(weights) ** -0.5)
    freedom = float(estimates.size - 1)
    birge = math.sqrt(float(np.sum(weights * (estimates - mean) ** 2)) / freedom)
    return (mean, internal, math.inf) if birge <= 1.0 else (mean, internal * birge, freedom)


#: One-sided, for 999 of 1000 on both sides.
_SURELY = 0.9995
#: A reading is odd beyond so many times the others' spread.
_SPREADS = 8.0


def odd_reading(values: Sequence[float], share: float, limit: float = 0.0) -> int | None:
    """Return which of several readings of one quantity contradicts the others most, the later of two; None where none does.

    It is off the others' median by more than `share` of that, twice the instrument's `limit` of error in the readings' unit, and
    eight times their own spread.
    """
    readings = np.asarray(values, dtype=float)
    worst, found = 1.0, None
    for number in range(readings.size - 1, -1, -1):
        others = np.delete(readings, number)
        if not others.size:
            break
        middle = float(np.median(others))
        spread = float(np.median(np.abs(others - middle)))
        bound = max(share * abs(middle), 2.0 * limit, _SPREADS * spread)
        off = abs(float(readings[number]) - middle)
        beyond = off / bound if bound > 0.0 else (math.inf if off else 0.0)
        if beyond > worst:
            worst, found = beyond, number
    return found


def stands_out(values: Sequence[float], number: int) -> bool:
    """Tell whether a reading is an outlier among readings of the same quantity, so that it may be left out of their mean.

    It is beyond what one more normal reading like the others would be in 999 of 1000 cases (Student). Three others at least.
    """
    others = np.delete(np.asarray(values, dtype=float), number)
    if others.size < 3:
        return False
    reach = float(stdtrit(others.size - 1, _SURELY)) * math.sqrt(1.0 + 1.0 / others.size)
    return abs(float(values[number]) - float(others.mean())) > reach * float(others.std(ddof=1))
