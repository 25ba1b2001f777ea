"""Exact response of a first-order system to an input that is straight between its samples."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Generic, TypeVar, overload

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: exp(±this) is within the range of numbers, and exp(−_GONE) is nothing beside 1.
_RANGE, _GONE = 600.0, 40.0
_BLOCK = 128
#: Decays of so many samples are kept: a search asks for the same ones time and again.
_REMEMBERED = 20_000
#: Below this rate·step the weights' series are more precise than their closed forms.
_SHORT = 1e-3


ComplexArray = NDArray[np.complex128]
_Number = TypeVar("_Number", float, FloatArray)


@dataclass(frozen=True)
class Weights(Generic[_Number]):
    """Over one segment between samples: `decay` of the state, and how much of the segment's length times the input's
    `first` and `last` sample comes to it; each with its derivative by rate·step.
    """

    decay: _Number
    first: _Number
    last: _Number
    decay_slope: _Number
    first_slope: _Number
    last_slope: _Number


def weights(x: float) -> Weights[float]:
    """Return the weights of a segment of x = rate·step."""
    decay = math.exp(-x)
    if abs(x) < _SHORT:
        mean, last, mean_slope, last_slope = _short(x)
    else:
        mean = -math.expm1(-x) / x
        last = (1 - mean) / x
        mean_slope = (decay - mean) / x
        last_slope = -(mean_slope + last) / x
    return Weights(decay, mean - last, last, -decay, mean_slope - last_slope, last_slope)


def segment_weights(x: FloatArray) -> Weights[FloatArray]:
    """Return the weights of segments of x (n,)."""
    decay, short = np.exp(-x), np.abs(x) < _SHORT
    safe = np.where(short, 1.0, x)
    mean = -np.expm1(-safe) / safe
    last = (1 - mean) / safe
    mean_slope = (np.exp(-safe) - mean) / safe
    last_slope = -(mean_slope + last) / safe
    for exact, series in zip((mean, last, mean_slope, last_slope), _short(x[short]), strict=True):
        exact[short] = series
    return Weights(decay, mean - last, last, -decay, mean_slope - last_slope, last_slope)


def _short(x: _Number) -> tuple[_Number, _Number, _Number, _Number]:
    """Return for a short segment the mean decay and the last sample's weight, and the slopes of both."""
    return (
        1 - x / 2 + x**2 / 6 - x**3 / 24,
        0.5 - x / 6 + x**2 / 24 - x**3 / 120,
        -0.5 + x / 3 - x**2 / 8,
        -1 / 6 + x / 12 - x**2 / 40,
    )


def recursion(decay: float, gain: FloatArray) -> FloatArray:
    """Return y (shape of `gain`, (n, …)) of y[k] = decay·y[k − 1] + gain[k], nothing being there before.

    `decay` within −1 … 1.
    """
    if decay == 0.0:
        return gain.copy()
    rate, n = -math.log(abs(decay)), len(gain)
    if decay > 0.0 and rate * n <= _RANGE:
        # In closed form: each term relative to what has decayed of it by its own time.
        decayed = decays(rate, n).reshape(-1, *(1,) * (gain.ndim - 1))
        result: FloatArray = gain / decayed
        np.cumsum(result, axis=0, out=result)
        result *= decayed
        return result
    # Sums over twice as many terms each time, until what is left of the first has decayed.
    result, reach, share = gain.copy(), 1, decay
    while reach < n and reach * rate < _GONE:
        earlier = result[:-reach] * share
        result[reach:] += earlier
        reach, share = 2 * reach, share * share
    return result


@overload
def decays(rate: float, n: int) -> FloatArray: ...
@overload
def decays(rate: complex, n: int) -> ComplexArray: ...
def decays(rate: complex, n: int) -> FloatArray | ComplexArray:
    """Return exp(−rate·k) for k = 0 … n − 1, not to be written to."""
    return _kept_decays(rate, n) if n <= _REMEMBERED else _decays(rate, n)


def _decays(rate: complex, n: int) -> FloatArray | ComplexArray:
    # As products of those of a block's places and of the blocks.
    blocks = np.exp(-rate * _BLOCK * np.arange(-(-n // _BLOCK)))
    result: FloatArray | ComplexArray = np.outer(blocks, np.exp(-rate * np.arange(_BLOCK))).ravel()[:n]
    result.flags.writeable = False
    return result


_kept_decays = lru_cache(maxsize=4)(_decays)


def respond_evenly(step: float, drive: FloatArray, rate: float) -> FloatArray:
    """Return y(t), shape (n, …), of y' = drive − rate·y with y = 0 at the first of samples `step` (s) apart.

    `drive` (n, …) runs straight from sample to sample (first-order hold); `rate` (1/s) is not negative.
    """
    w = weights(rate * step)
    result = np.empty_like(drive)
    result[:1] = 0.0
    result[1:] = recursion(w.decay, _gain(step, w, drive))
    return result


def _gain(step: float, w: Weights[float], drive: FloatArray) -> FloatArray:
    """Return what each segment between samples of a drive (n, …) adds to the state, (n − 1, …)."""
    result: FloatArray = w.first * drive[:-1]
    result += w.last * drive[1:]
    result *= step
    return result


def gathered_evenly(step: float, shares: FloatArray, rate: float) -> FloatArray:
    """Return shares (n, …) in the drive for shares in the response: Σ shares·respond_evenly(drive) = Σ result·drive."""
    w = weights(rate * step)
    later = step * recursion(w.decay, shares[:0:-1])[::-1]
    result = np.zeros_like(shares)
    result[:-1] = w.first * later
    result[1:] += w.last * later
    return result


def response_and_slope_evenly(
    step: float, drive: FloatArray, rate: float, response: FloatArray | None = None
) -> tuple[FloatArray, FloatArray]:
    """Return what `respond_evenly` does, and its derivative by the rate (s times the response's unit), for a drive (n,); the `response` may
    be known.
    """
    w = weights(rate * step)
    if response is None:
        response = np.zeros_like(drive)
        response[1:] = recursion(w.decay, _gain(step, w, drive))
    inner = w.decay_slope * response[:-1] + step * (w.first_slope * drive[:-1] + w.last_slope * drive[1:])
    slope = np.zeros_like(drive)
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
    w = segment_weights(rate * steps)
    return recursion_unevenly(rate * steps, steps * (w.first * drive[:-1] + w.last * drive[1:]), start)


def recursion_unevenly(x: FloatArray, gain: FloatArray, start: FloatArray | float) -> FloatArray:
    """Return y (…, n + 1) of y[k + 1] = exp(−x[k])·y[k] + gain[k] for x (n,) and gain (…, n), from y[0] = `start` (…)."""
    result = np.empty((*gain.shape[:-1], x.size + 1))
    result[..., 0] = start
    age = np.concatenate(((0.0,), np.cumsum(np.abs(x))))
    begin = 0
    while begin < x.size:
        # Blocks short enough that the growing exponential of the closed form keeps its precision.
        end = max(int(np.searchsorted(age, age[begin] + 20.0)) - 1, begin + 1)
        decayed = np.exp(-np.cumsum(x[begin:end]))
        if end == begin + 1:
            result[..., end] = decayed[0] * result[..., begin] + gain[..., begin]
        else:
            summed = np.cumsum(gain[..., begin:end] / decayed, axis=-1)
            result[..., begin + 1 : end + 1] = decayed * (result[..., begin, None] + summed)
        begin = end
    return result


def time_constant_of_ramp(crossing: float, rise: float) -> float:
    """Return the time constant (s) of a first-order response to a straight rise of length `rise` (s), from the time (s) between the
    rise's middle and where the response has gone 63.2 % of its way.

    With τ and x = rise/τ the crossing is τ·(1 + ln(2·sinh(x/2)/x)) after the middle. Raises EstimationError for a crossing that
    still lies in the rise.
    """
    if not crossing > 0.5 * rise:
        raise EstimationError(
            f"the current crosses 63.2 % {crossing:g} s after the middle of a rise of {rise:g} s, before its end: the rise hides it"
        )
    if rise == 0.0:
        return crossing
    # Late: reading off a screen is rare, and this takes a while to import.
    from scipy.optimize import brentq

    def beyond(tau: float) -> float:
        x = rise / tau
        return tau * (1.0 + math.log(-math.expm1(-x) / x) + 0.5 * x) - crossing

    # The shortest is that of a response which ends with the rise; it crosses as late as 0.5 · rise there.
    return float(brentq(beyond, 1e-3 * crossing, crossing))
