"""First-order lags, exact for signals that run straight from one sample to the next; a resonance is one of a complex time constant."""

import cmath
import math
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.linalg.lapack import dtbtrs, ztbtrs

FloatArray = NDArray[np.float64]
#: Real where the time constant is.
Lagged = NDArray[Any]
_Number = TypeVar("_Number", float, complex)

#: A lag forgets what was so many time constants ago, and looks at it at so many times.
_REMEMBERED, _LOOKS = 12.0, 2048


def lag(signal: FloatArray, interval: float, time_constant: complex, first: complex) -> Lagged:
    """Return 1/(1 + sτ) of a signal (shape (n,)) sampled every `interval` s, what it gives having been `first` when it began."""
    if not len(signal):
        return signal
    fall = interval / time_constant
    kept = cmath.exp(-fall) if isinstance(fall, complex) else math.exp(-fall)
    # Of a straight piece: the part that its end has, and the part that its beginning has.
    end = 1.0 + (kept - 1.0 if isinstance(fall, complex) else math.expm1(-fall)) / fall
    begin = 1.0 - kept - end
    driven = np.concatenate([[first], end * signal[1:] + begin * signal[:-1]])
    return recursion(driven, kept)


def recursion(driven: Lagged, kept: complex) -> Lagged:
    """Return y (n,) with yₖ = `driven`ₖ + `kept` · yₖ₋₁, nothing being kept from before the first.

    That is a triangular system of two diagonals, solved forward; scipy.signal's filter takes half a second to import.
    """
    bands = np.empty((2, len(driven)), dtype=complex if isinstance(kept, complex) else float)
    bands[0], bands[1] = 1.0, -kept
    solved, _ = (ztbtrs if isinstance(kept, complex) else dtbtrs)(bands, driven[:, np.newaxis], uplo="L")
    result: Lagged = solved[:, 0]
    return result


def lagged(signal: Callable[[FloatArray], FloatArray], times: FloatArray, time_constant: complex) -> Lagged:
    """Return 1/(1 + sτ) of a signal at evenly spaced times (s): what it was before counts as long as it is felt."""
    if len(times) < 2:
        return np.array([lagged_now(signal, float(time), time_constant) for time in times])
    first = lagged_now(signal, float(times[0]), time_constant)
    interval = float(times[-1] - times[0]) / (len(times) - 1)
    return lag(signal(times), interval, time_constant, first)


def lagged_now(signal: Callable[[FloatArray], FloatArray], time: float, time_constant: _Number) -> _Number:
    """Return 1/(1 + sτ) of a signal at a time (s)."""
    span = _REMEMBERED / (1.0 / time_constant).real
    before = signal(np.linspace(time - span, time, _LOOKS + 1))
    result: _Number = lag(before, span / _LOOKS, time_constant, float(before[0]))[-1].item()
    return result


def memory(time_constant: float) -> float:
    """Return how far (s) back a lag looks."""
    return _REMEMBERED * time_constant
