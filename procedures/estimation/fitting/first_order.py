"""Exact response of a first-order system to an input that is straight between its samples."""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import overload

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
#: Below this one a series of so many terms is as precise as the closed form, and made faster: Σ (−x)^k/(k + 2)!.
_NEARLY_SHORT = 0.02
_SERIES = tuple((-1.0) ** k / math.factorial(k + 2) for k in range(7))
#: Decays of so much are made in closed form, which is as precise as there is little growth in it.
_BLOCK_OF_DECAY = 20.0


ComplexArray = NDArray[np.complex128]


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
    if abs(x) < _SHORT:
        mean = 1 - x / 2 + x**2 / 6 - x**3 / 24
        last = 0.5 - x / 6 + x**2 / 24 - x**3 / 120
        mean_slope = -0.5 + x / 3 - x**2 / 8
        last_slope = -1 / 6 + x / 12 - x**2 / 40
    else:
        mean = -math.expm1(-x) / x
        last = (1 - mean) / x
        mean_slope = (decay - mean) / x
        last_slope = -(mean_slope + last) / x
    return Weights(decay, mean - last, last, -decay, mean_slope - last_slope, last_slope)


def _uneven_weights(x: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the weights of the first and the last sample of segments of x (n,)."""
    short = np.abs(x) < _NEARLY_SHORT
    all_short = bool(np.all(short))
    series = x if all_short else x[short]
    of_last = np.full_like(series, _SERIES[-1])
    for factor in _SERIES[-2::-1]:
        of_last *= series
        of_last += factor
    if all_short:
        last, mean = of_last, 1.0 - x * of_last
    else:
        safe = np.where(short, 1.0, x)
        mean = -np.expm1(-safe) / safe
        last = (1.0 - mean) / safe
        last[short], mean[short] = of_last, 1.0 - series * of_last
    return mean - last, last


def recursion(decay: float, gain: FloatArray, out: FloatArray | None = None) -> FloatArray:
    """Return y (shape of `gain`, (n, …)) of y[k] = decay·y[k − 1] + gain[k], nothing being there before.

    `decay` within −1 … 1. It may be written `out`, which is not the gain.
    """
    if out is None:
        out = np.empty_like(gain)
    if decay == 0.0:
        out[...] = gain
        return out
    rate, n = -math.log(abs(decay)), len(gain)
    if decay > 0.0 and rate * n <= _RANGE:
        # In closed form: each term relative to what has decayed of it by its own time.
        decayed = decays(rate, n).reshape(-1, *(1,) * (gain.ndim - 1))
        np.divide(gain, decayed, out=out)
        np.cumsum(out, axis=0, out=out)
        out *= decayed
        return out
    # Sums over twice as many terms each time, until what is left of the first has decayed.
    out[...] = gain
    reach, share = 1, decay
    while reach < n and reach * rate < _GONE:
        earlier = out[:-reach] * share
        out[reach:] += earlier
        reach, share = 2 * reach, share * share
    return out


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
    recursion(w.decay, _gain(step, w, drive), out=result[1:])
    return result


def _gain(step: float, w: Weights, drive: FloatArray) -> FloatArray:
    """Return what each segment between samples of a drive (n, …) adds to the state, (n − 1, …)."""
    result: FloatArray = step * w.first * drive[:-1]
    result += step * w.last * drive[1:]
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
        recursion(w.decay, _gain(step, w, drive), out=response[1:])
    inner = w.decay_slope * response[:-1] + step * (w.first_slope * drive[:-1] + w.last_slope * drive[1:])
    slope = np.zeros_like(drive)
    inner *= step
    recursion(w.decay, inner, out=slope[1:])
    return response, slope


class Decay:
    """y' = drive − rate·y between uneven samples, made ready for several drives: `steps` (n,) are the times (s) between them, `x` (…, n)
    the rate there times the step, of one system or of several at once.
    """

    def __init__(self, steps: FloatArray, x: FloatArray) -> None:
        # Blocks are those of the system that decays fastest.
        fastest = np.abs(x) if x.ndim == 1 else np.max(np.abs(x), axis=tuple(range(x.ndim - 1)))
        age = np.zeros(steps.size + 1)
        np.cumsum(fastest, out=age[1:])
        self._blocks: list[tuple[int, int]] = []
        #: What is left of a block's begin, and by what each gain has to be larger to have been there.
        self._decayed, grown = np.empty_like(x), np.empty_like(x)
        begin = 0
        while begin < steps.size:
            end = max(int(age.searchsorted(age[begin] + _BLOCK_OF_DECAY)) - 1, begin + 1)
            self._blocks.append((begin, end))
            if end == begin + 1:
                self._decayed[..., begin] = np.exp(-x[..., begin])
                grown[..., begin] = 1.0
            else:
                aged = x[..., begin:end].cumsum(axis=-1)
                np.exp(aged, out=grown[..., begin:end])
                np.divide(1.0, grown[..., begin:end], out=self._decayed[..., begin:end])
            begin = end
        grown *= steps
        first, last = _uneven_weights(x)
        self._first, self._last = np.multiply(grown, first, out=first), np.multiply(grown, last, out=last)

    def respond(self, drive: FloatArray, start: FloatArray | float = 0.0) -> FloatArray:
        """Return y (…, n + 1) for a drive (…, n + 1) that runs straight from sample to sample, from `start` (…).

        Of several systems each has a drive of its own, or several: one axis more, before the last.
        """
        decayed, first, last = self._decayed, self._first, self._last
        if decayed.ndim > 1 and drive.ndim > decayed.ndim:
            decayed, first, last = decayed[..., None, :], first[..., None, :], last[..., None, :]
        gain = first * drive[..., :-1]
        gain += last * drive[..., 1:]
        result = np.empty((*gain.shape[:-1], gain.shape[-1] + 1))
        result[..., 0] = start
        for begin, end in self._blocks:
            part = result[..., begin + 1 : end + 1]
            if end == begin + 1:
                part[..., 0] = decayed[..., begin] * result[..., begin] + gain[..., begin]
                continue
            gain[..., begin:end].cumsum(axis=-1, out=part)
            part += result[..., begin, None]
            part *= decayed[..., begin:end]
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
