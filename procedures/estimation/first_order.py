"""Exact response of a first-order system to an input that is straight between its samples."""

import math
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fit import FloatArray

#: exp(±this) is within the range of numbers, and exp(−_GONE) is nothing beside 1.
_RANGE, _GONE = 600.0, 40.0


@dataclass(frozen=True)
class Weights:
    """Over one segment between samples: `decay` of the state, and how much of the segment's length times the input's
    `first` and `last` sample comes to it; each with its derivative by rate·step.
    """

    decay: float
    first: float
    last: float
    decay_slope: float
    first_slope: float
    last_slope: float


def weights(x: float) -> Weights:
    """Return the weights of a segment of x = rate·step."""
    decay = math.exp(-x)
    if abs(x) < 1e-3:
        mean, last = 1 - x / 2 + x**2 / 6 - x**3 / 24, 0.5 - x / 6 + x**2 / 24 - x**3 / 120
        mean_slope, last_slope = -0.5 + x / 3 - x**2 / 8, -1 / 6 + x / 12 - x**2 / 40
    else:
        mean = -math.expm1(-x) / x
        last = (1 - mean) / x
        mean_slope = (decay - mean) / x
        last_slope = -(mean_slope + last) / x
    return Weights(decay, mean - last, last, -decay, mean_slope - last_slope, last_slope)


def recursion(decay: float, gain: FloatArray) -> FloatArray:
    """Return y (shape of `gain`, (n, …)) of y[k] = decay·y[k − 1] + gain[k], nothing being there before.

    `decay` within −1 … 1.
    """
    if decay == 0.0:
        return gain.copy()
    rate, n = -math.log(abs(decay)), len(gain)
    if decay > 0.0 and rate * n <= _RANGE:
        # In closed form: each term relative to what has decayed of it by its own time.
        decayed = np.exp(-rate * np.arange(n)).reshape(-1, *(1,) * (gain.ndim - 1))
        result: FloatArray = np.cumsum(gain / decayed, axis=0)
        result *= decayed
        return result
    # Sums over twice as many terms each time, until what is left of the first has decayed.
    result, reach, share = gain.copy(), 1, decay
    while reach < n and reach * rate < _GONE:
        earlier = result[:-reach] * share
        result[reach:] += earlier
        reach, share = 2 * reach, share * share
    return result


def respond_evenly(step: float, drive: FloatArray, rate: float) -> FloatArray:
    """Return y(t), shape (n, …), of y' = drive − rate·y with y = 0 at the first of samples `step` (s) apart.

    `drive` (n, …) runs straight from sample to sample (first-order hold); `rate` (1/s) is not negative.
    """
    w = weights(rate * step)
    result = np.zeros_like(drive)
    result[1:] = recursion(w.decay, step * (w.first * drive[:-1] + w.last * drive[1:]))
    return result


def gathered_evenly(step: float, shares: FloatArray, rate: float) -> FloatArray:
    """Return shares (n, …) in the drive for shares in the response: Σ shares·respond_evenly(drive) = Σ result·drive."""
    w = weights(rate * step)
    later = step * recursion(w.decay, shares[:0:-1])[::-1]
    result = np.zeros_like(shares)
    result[:-1] = w.first * later
    result[1:] += w.last * later
    return result


def response_and_slope(step: float, drive: FloatArray, rate: float) -> tuple[FloatArray, FloatArray]:
    """Return what `respond_evenly` does, and its derivative by the rate (s times the response's unit), for a drive (n,)."""
    w = weights(rate * step)
    response, slope = np.zeros_like(drive), np.zeros_like(drive)
    response[1:] = recursion(w.decay, step * (w.first * drive[:-1] + w.last * drive[1:]))
    inner = w.decay_slope * response[:-1] + step * (w.first_slope * drive[:-1] + w.last_slope * drive[1:])
    slope[1:] = recursion(w.decay, step * inner)
    return response, slope


def respond(time: FloatArray, drive: FloatArray, rate: float, start: float = 0.0) -> FloatArray:
    """Return y(t), shape (n,), of y' = drive − rate·y with y = `start` at the first sample; `rate` in 1/s, may be 0.

    `drive` (n,) runs straight from sample to sample (first-order hold); sampling need not be even.
    """
    steps = np.diff(time)
    step = float(time[-1] - time[0]) / steps.size
    if rate >= 0.0 and np.all(np.abs(steps - step) < 1e-6 * step):
        result = respond_evenly(step, drive, rate)
        return result + start * np.exp(-rate * (time - time[0])) if start else result
    decay_each, first_each, last_each = _segment_weights(rate * steps)
    gain = steps * (first_each * drive[:-1] + last_each * drive[1:])
    result = np.empty_like(time)
    result[0] = start
    begin = 0
    while begin < steps.size:
        # Blocks short enough that the growing exponential of the closed form keeps its precision.
        age = np.abs(rate) * (time[begin + 1 :] - time[begin])
        length = max(int(np.searchsorted(age, 20.0)), 1)
        block = slice(begin, begin + length)
        decayed = np.cumprod(decay_each[block])
        result[begin + 1 : begin + 1 + length] = decayed * (result[begin] + np.cumsum(gain[block] / decayed))
        begin += length
    return result


def _segment_weights(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Decay and the weights of a segment's first and last input sample, each over the segment, for x = rate·step."""
    decay = np.exp(-x)
    small = np.abs(x) < 1e-3
    safe = np.where(small, 1.0, x)
    mean = np.where(small, 1 - x / 2 + x**2 / 6 - x**3 / 24, -np.expm1(-safe) / safe)
    last = np.where(small, 0.5 - x / 6 + x**2 / 24 - x**3 / 120, (1 - mean) / safe)
    return decay, mean - last, last
