"""Exact response of a first-order system to an input that is straight between its samples."""

import numpy as np

from procedures.estimation.fit import FloatArray


def _segment_weights(x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Decay and the weights of a segment's first and last input sample, each over the segment, for x = rate·step."""
    decay = np.exp(-x)
    small = np.abs(x) < 1e-3
    safe = np.where(small, 1.0, x)
    mean = np.where(small, 1 - x / 2 + x**2 / 6 - x**3 / 24, -np.expm1(-safe) / safe)
    last = np.where(small, 0.5 - x / 6 + x**2 / 24 - x**3 / 120, (1 - mean) / safe)
    return decay, mean - last, last


def respond(time: FloatArray, drive: FloatArray, rate: float, start: float = 0.0) -> FloatArray:
    """Return y(t), shape (n,), of y' = drive − rate·y with y = `start` at the first sample; `rate` in 1/s, may be 0.

    `drive` (n,) runs straight from sample to sample (first-order hold); sampling need not be even.
    """
    # scipy.signal takes long to load, and who only reads results needs none of it.
    from scipy.signal import lfilter

    steps = np.diff(time)
    step = float(time[-1] - time[0]) / steps.size
    if np.all(np.abs(steps - step) < 1e-6 * step):
        decay, first, last = (float(w[0]) for w in _segment_weights(np.array([rate * step])))
        state, _ = lfilter([1.0], [1.0, -decay], step * (first * drive[:-1] + last * drive[1:]), zi=[decay * start])
        return np.append(start, state)
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
