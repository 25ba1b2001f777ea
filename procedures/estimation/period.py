"""Period and plain readings of a periodic waveform, as read off a screen, and where a fit of it starts."""

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.checks import increasing, same_length, series
from procedures.estimation.fit import EstimationError, FloatArray
from procedures.estimation.noise import white_noise

#: Points that suffice for a start value where the record holds a few periods.
_ENOUGH = 1000


def crossings(time: FloatArray, values: FloatArray, level: float) -> FloatArray:
    """Return the times (s) at which the values rise through `level`, one a period, noise around the level ignored."""
    centred = values - level
    band = max(0.15 * float(np.max(np.abs(centred))), 3 * white_noise(values))
    state = np.where(centred > band, 1, np.where(centred < -band, -1, 0))
    sides = np.flatnonzero(state)
    found = []
    for k in np.flatnonzero((state[sides][1:] > 0) & (state[sides][:-1] < 0)):
        part = slice(int(sides[k]), int(sides[k + 1]) + 1)
        # A line through the whole transition averages the noise at the crossing.
        line = np.polynomial.polynomial.polyfit(time[part] - time[part.start], centred[part], 1)
        found.append(float(time[part.start] - line[0] / line[1]) if line[1] > 0 else float(np.mean(time[part])))
    return np.array(found)


def period_of(time: ArrayLike, values: ArrayLike) -> float:
    """Return the mean period (s) between rising passages through the mean level (§3.4).

    Raises EstimationError where the record holds no whole period.
    """
    t, v = series("time", time, least=8), series("values", values, least=8)
    same_length(time=t, values=v)
    increasing(t)
    if np.ptp(v) == 0:
        raise EstimationError("the waveform is constant; check the probe and that the shaft turns")
    rising = crossings(t, v, 0.5 * float(np.max(v) + np.min(v)))
    if rising.size < 2:
        raise EstimationError("the record holds no whole period; turn faster or record longer")
    return float(rising[-1] - rising[0]) / (rising.size - 1)


def peak_to_peak(values: ArrayLike) -> float:
    """Return largest minus smallest value, as read off a screen (§3.4); noise and harmonics bias it upwards."""
    v = series("values", values, least=2)
    return float(np.max(v) - np.min(v))


def peak_amplitude(values: ArrayLike) -> float:
    """Return the largest magnitude about the middle of the extremes, as read off a screen (§3.4)."""
    return 0.5 * peak_to_peak(values)


def start_frequency(time: FloatArray, channels: FloatArray) -> float:
    """Return the frequency (Hz) at which all channels together hold most power, to a fraction of a bin.

    Raises EstimationError where the record holds less than a whole period or nothing periodic.
    """
    n = time.size
    span = float(time[-1] - time[0]) * n / (n - 1)
    centred = channels - channels.mean(axis=1, keepdims=True)
    size = np.sqrt(np.mean(centred**2, axis=1))
    if np.all(size == 0):
        raise EstimationError("the waveform is constant; check the probes and that the shaft turns")
    centred = centred / np.where(size > 0, size, 1.0)[:, None]
    power = np.sum(np.abs(np.fft.rfft(centred * np.hanning(n), 8 * n)) ** 2, axis=0)
    frequencies = np.fft.rfftfreq(8 * n, span / n)
    highest = int(np.argmax(power[4:])) + 4
    rough = float(frequencies[highest])
    if rough * span < 4.0:
        # Few periods: leakage moves the peak, so the waveform itself is compared.
        grid = np.linspace(0.3, 5.0, 189) / span
        left = []
        block = max(1, n // _ENOUGH)
        whole = n // block * block
        since = time[:whole].reshape(-1, block).mean(axis=1) - time[0]
        few = centred[:, :whole].reshape(centred.shape[0], -1, block).mean(axis=2)
        for f in grid:
            angle = 2 * np.pi * f * since
            design = np.column_stack((np.ones(since.size), np.cos(angle), np.sin(angle)))
            q, _ = np.linalg.qr(design)
            left.append(float(np.sum(few**2) - np.sum((few @ q) ** 2)))
        rough = float(grid[int(np.argmin(left))])
    if rough * span < 1.0:
        raise EstimationError(
            f"the record holds no whole period (about {rough * span:.2f} of one); turn faster or record longer"
        )
    band = (frequencies > 0.5 * rough) & (frequencies < 1.5 * rough)
    if float(np.max(power[band])) < 16 * float(np.mean(power)) * 1.0 and float(np.max(power)) < 30 * float(
        np.median(power)
    ):
        raise EstimationError("nothing periodic stands out of the noise; turn faster or use a finer range")
    return rough
