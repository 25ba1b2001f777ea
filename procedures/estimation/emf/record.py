"""A record of a turning machine's voltages before it is fitted: checks, where the fit starts, how white its residual is."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from procedures.estimation.emf.harmonics import HarmonicModel
from procedures.estimation.emf.period import bent_course, start_frequency
from procedures.estimation.fitting.checks import positive, same_length, series, uniform_step
from procedures.estimation.fitting.fit import EstimationError, FloatArray


@dataclass(frozen=True)
class DigitizedChannel:
    """Properties of a recorded channel besides its values.

    `resolution` one converter step (V), 0 where it is not known; `clipped` whether readings reached an end of the converter, None
    where nobody says; `gain_limit` the limit of its gain error as stated, relative.
    """

    name: str
    resolution: float = 0.0
    clipped: bool | None = None
    gain_limit: float = 0.0


def channels_told(
    count: int, digitized: Sequence[DigitizedChannel], resolution: float | Sequence[float]
) -> list[DigitizedChannel]:
    """Return what is known of each of so many channels. Raises EstimationError where it is told of another number of them."""
    if digitized:
        if len(digitized) != count:
            raise EstimationError(f"{len(digitized)} channels are described, {count} recorded; describe each of them")
        return list(digitized)
    steps = np.broadcast_to(np.asarray(resolution, dtype=np.float64), (count,))
    return [DigitizedChannel(str(k + 1), float(step)) for k, step in enumerate(steps)]


def prepare(
    time: ArrayLike, channels: ArrayLike, digitized: Sequence[DigitizedChannel] = ()
) -> tuple[FloatArray, FloatArray]:
    """Return time (n,) and channels (C, n), which are called as `digitized` says, by their number from 1 elsewhere. Raises
    EstimationError on a gap, a constant channel or values that are no numbers.
    """
    t = series("time", time, least=16)
    array = np.atleast_2d(np.asarray(channels, dtype=np.float64))
    if array.ndim != 2:
        raise EstimationError("channels must have the shape (channels, points)")
    names = [digitized[k].name if k < len(digitized) else str(k + 1) for k in range(len(array))]
    rows = [series(f"channel {name}", row, least=16) for name, row in zip(names, array, strict=True)]
    for name, row in zip(names, rows, strict=True):
        same_length(time=t, **{f"channel {name}": row})
        if np.ptp(row) == 0:
            raise EstimationError(f"channel {name} is constant; check its probe and that the shaft turns")
    uniform_step(t)
    return t, np.vstack(rows)


def start(t: FloatArray, v: FloatArray, frequency: float | None) -> FloatArray:
    """Return the course of the phase (rad) to start from. Raises EstimationError on less than a period."""
    half = float(t[-1] - t[0]) / 2
    f = positive("frequency", frequency, "Hz") if frequency is not None else start_frequency(t, v)
    if f * 2 * half * t.size / (t.size - 1) < 0.98:
        raise EstimationError(f"the record holds no whole period of {f:g} Hz; turn faster or record longer")
    bent = bent_course(t, v[np.argmax(np.std(v, axis=1))], f)
    return np.array([0.0, 2 * np.pi * f * half]) if bent is None else bent


def usable(t: FloatArray, harmonics: Sequence[int], course: FloatArray) -> tuple[int, ...]:
    """Return the harmonics below the sampling limit. Raises EstimationError where the fundamental is not among them."""
    if 1 not in harmonics or any(k < 1 for k in harmonics):
        raise EstimationError("the harmonics to fit must be positive and include 1, the fundamental")
    per_sample = 2 * float(course[1]) / (t.size - 1)
    kept = tuple(sorted({int(k) for k in harmonics if k * per_sample < 0.9 * np.pi}))
    if not kept:
        raise EstimationError("fewer than two samples a period; sample faster")
    return kept


def colour(t: FloatArray, model: HarmonicModel, frequency: float) -> float:
    """Return the density of the residuals around the fundamental against their mean density; 1 unless clearly more."""
    n = t.size
    bins = frequency * float(t[-1] - t[0]) * n / (n - 1)
    reach = max(int(0.5 * bins), 4)
    low, high = max(1, int(bins) - reach), min(n // 2, int(bins) + reach + 1)
    total = 0.0
    for row in model.residuals:
        power = np.abs(np.fft.rfft(row)) ** 2
        mean = float(np.mean(power[1:]))
        total += float(np.mean(power[low:high])) / mean if mean > 0 else 1.0
    ratio = total / model.residuals.shape[0]
    count = 2 * (high - low) * model.residuals.shape[0]
    return ratio if ratio > float(special.chdtri(count, 0.01)) / count else 1.0
