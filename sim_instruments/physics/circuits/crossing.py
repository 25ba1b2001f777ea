"""The first time at which a closed-form signal passes a threshold."""

import math
from collections.abc import Callable

import numpy as np
from scipy.optimize import brentq

from sim_instruments.physics.circuits.windings import FloatArray


def first_rise(
    signal: Callable[[FloatArray], FloatArray], start: float, end: float, time_constants: FloatArray
) -> float:
    """Return the first time (s) in start … end at which the signal rises through zero, infinite where it never does.

    The signal is a sum of exponentials of the given time constants and a ramp until `end`: it is looked at densely
    where it can bend, then the crossing is found to full precision.
    """
    if len(time_constants):
        settled = 40.0 * float(time_constants.max())
        finest = 1e-4 * float(time_constants.min())
    else:
        settled = finest = 0.0
    last = min(end - start, settled) if settled else (end - start if math.isfinite(end) else 0.0)
    if last <= 0.0:
        return math.inf
    first = min(finest, 0.5 * last) or 1e-6 * last
    fine = 10.0 ** np.linspace(math.log10(first), math.log10(last), 200)
    fine[0], fine[-1] = first, last
    steps = np.concatenate([[0.0], fine, np.linspace(0, last, 100)])
    steps.sort()
    steps = steps[np.append(True, steps[1:] != steps[:-1])]
    if math.isfinite(end) and end - start > last:
        steps = np.append(steps, end - start)
    values = signal(start + steps)
    # What starts on the threshold has passed it already, upwards or not, in the eyes of whoever chose this regime.
    rises = np.nonzero((values[:-1] <= 0.0) & (values[1:] > 0.0))[0]
    for index in rises:
        low, high = start + steps[index], start + steps[index + 1]
        # Evaluated alone, a value may differ in its last digit from the same one in a row.
        if values[index] == 0.0 or _at(signal, low) >= 0.0:
            return float(low)
        if _at(signal, high) <= 0.0:
            return float(high)
        return float(brentq(lambda t: _at(signal, t), low, high, xtol=1e-15, rtol=8.9e-16))
    return math.inf


def _at(signal: Callable[[FloatArray], FloatArray], time: float) -> float:
    return float(signal(np.array([time]))[0])
