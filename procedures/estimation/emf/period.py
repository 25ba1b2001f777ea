"""Period and plain readings of a periodic waveform, as read off a screen, and where a fit of it starts."""

import numpy as np
from numpy.polynomial import chebyshev
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import series
from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: Points that suffice for a start value where the record holds a few periods.
_ENOUGH = 1000
#: A transform's points over the record's, so that its maximum is not missed between two of them.
_PADDED = 2
#: With fewer periods leakage moves a spectrum's peak; steps a period in which the best frequency is then looked for.
_FEW, _FINE = 4.0, 40
#: Readings of a period that are taken together before it is looked where they cross the middle between these quantiles.
_MEDIANS, _EXTREMES = 64, (0.01, 0.99)
#: A fit begins where its phase is off by less than this (rad); a course of up to this degree is told by so many crossings at least, whose
#: periods are no more than so many times the next.
_NEAR_ENOUGH, _MOST_DEGREE, _LEAST_CROSSINGS, _NEXT = 0.6, 6, 10, 1.4
#: Of a speed that ripples, up to this degree, of so many crossings each, where periods differ less: missing samples make one that does not.
_MOST_OF_RIPPLE, _CROSSINGS_EACH, _NEXT_OF_RIPPLE = 40, 3, 1.12
#: A slower wave is told from this share of the amplitude on, if it is so many times what noise makes and has so many periods.
_SLOWER, _BEYOND, _LEAST_SLOWER = 0.1, 5.0, 2.0


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
    centred /= np.where(size > 0, size, 1.0)[:, None]
    spectrum = np.fft.rfft(centred * np.hanning(n), _PADDED * n)
    power = np.sum(spectrum.real**2 + spectrum.imag**2, axis=0)
    first = _PADDED // 2
    highest = int(np.argmax(power[first:-1])) + first
    # A parabola through the logarithms of the highest value and its neighbours.
    before, at, after = np.log(power[highest - 1 : highest + 2] + 1e-300)
    aside = float(0.5 * (before - after) / min(before - 2.0 * at + after, -1e-9))
    power[highest] = np.exp(at - 0.25 * (before - after) * aside)
    rough = (highest + aside) / (_PADDED * span)
    if rough * span < _FEW:
        # Leakage moves the peak, so the waveform itself is compared.
        rough = _nearest_sine(centred) / span
    if rough * span < 1.0:
        raise EstimationError(
            f"the record holds no whole period (about {rough * span:.2f} of one); turn faster or record longer"
        )
    band = power[int(0.5 * rough * span * _PADDED) + 1 : int(1.5 * rough * span * _PADDED) + 1]
    if np.max(band) < 16 * np.mean(power) and np.max(power) < 30 * np.median(power):
        raise EstimationError("nothing periodic stands out of the noise; turn faster or use a finer range")
    return rough


def _nearest_sine(centred: FloatArray) -> float:
    """Return how many periods, up to a few, of a sine and an offset leave least of all channels (C, n)."""
    block = max(1, centred.shape[1] // _ENOUGH)
    count = centred.shape[1] // block
    few = centred[:, : count * block].reshape(len(centred), count, block).mean(axis=2)
    share = centred.shape[1] / (count * block)
    # Padded so far that a transform holds the sums with cosine and sine at every step of the search; twice as far the sums of
    # their squares and products, by the angles' sums.
    steps = np.arange(round(0.3 * _FINE), round(1.25 * _FEW * _FINE) + 1)
    sums = np.fft.rfft(few, _FINE * count)[:, steps]
    ones = np.fft.fft(np.ones(count), _FINE * count)
    once, twice = ones[steps], ones[2 * steps]
    normal = np.empty((steps.size, 3, 3))
    normal[:, 0, 0] = count
    normal[:, 0, 1] = normal[:, 1, 0] = once.real
    normal[:, 0, 2] = normal[:, 2, 0] = -once.imag
    normal[:, 1, 1], normal[:, 2, 2] = 0.5 * (count + twice.real), 0.5 * (count - twice.real)
    normal[:, 1, 2] = normal[:, 2, 1] = -0.5 * twice.imag
    with_waves = np.stack((np.broadcast_to(few.sum(axis=1), sums.T.shape), sums.real.T, -sums.imag.T), axis=1)
    taken = np.sum(with_waves * np.linalg.solve(normal, with_waves), axis=(1, 2))
    return float(steps[np.argmax(taken)] * share / _FINE)


def slower_wave(
    time: FloatArray, residuals: FloatArray, frequency: float, amplitude: float
) -> tuple[int, float] | None:
    """Return what part of a frequency (Hz) a wave in a fit's residuals (n,) has, 2 or 3, and its share of the amplitude; None without one.

    A channel that is bent strongly shows twice the frequency larger than the fundamental, which is then left in the residuals. In records
    too short to tell the two apart nothing is found.
    """
    span = float(time[-1] - time[0])
    for part in (2, 3):
        angle = 2.0 * np.pi * frequency / part * time
        if frequency * span < part * _LEAST_SLOWER:
            continue
        design = np.column_stack((np.ones_like(time), np.cos(angle), np.sin(angle)))
        values, *_ = np.linalg.lstsq(design, residuals, rcond=None)
        noise = float(np.sqrt(2.0 * np.mean((residuals - design @ values) ** 2) / time.size))
        size = float(np.hypot(values[1], values[2]))
        if size > max(_SLOWER * amplitude, _BEYOND * noise):
            return part, size / amplitude
    return None


def rising_crossings(t: FloatArray, row: FloatArray, near: float) -> FloatArray:
    """Return when (s) a record of about this frequency (Hz) crosses its middle upwards."""
    # Of many samples a period, medians: neither noise nor single wild readings cross it.
    block = max(1, int(1.0 / (_MEDIANS * near * (t[1] - t[0]))))
    whole = row.size // block * block
    t, row = t[:whole].reshape(-1, block).mean(axis=1), np.median(row[:whole].reshape(-1, block), axis=1)
    level = 0.5 * float(np.sum(np.quantile(row, _EXTREMES)))
    before = np.flatnonzero((row[:-1] < level) & (row[1:] >= level))
    share = (level - row[before]) / (row[before + 1] - row[before])
    return np.asarray(t[before] + share * (t[before + 1] - t[before]))


def bent_course(t: FloatArray, row: FloatArray, near: float) -> FloatArray | None:
    """Return the course of the phase (rad, by Chebyshev polynomials over the record) that the crossings of a record of about this frequency
    (Hz) tell; None where a constant speed comes near enough for a fit to begin with, or no smooth course comes nearer.
    """
    times = rising_crossings(t, row, near)
    if times.size < _LEAST_CROSSINGS:
        return None
    periods = np.diff(times)
    ratios = periods[1:] / periods[:-1]
    # Noise crosses more often, and a dropout hides a crossing.
    if np.min(ratios) < 1.0 / _NEXT or np.max(ratios) > _NEXT:
        return None
    middle, half = 0.5 * (t[0] + t[-1]), 0.5 * (t[-1] - t[0])
    x, phase = (times - middle) / half, 2.0 * np.pi * np.arange(times.size)

    def off(course: FloatArray) -> float:
        return float(np.max(np.abs(chebyshev.chebval(x, course) - phase)))

    even = off(chebyshev.chebfit(x, phase, 1))
    if even < _NEAR_ENOUGH:
        return None
    ripple = np.min(ratios) > 1.0 / _NEXT_OF_RIPPLE and np.max(ratios) < _NEXT_OF_RIPPLE
    most = max(_MOST_DEGREE, min(_MOST_OF_RIPPLE, times.size // _CROSSINGS_EACH) if ripple else 0)
    for degree in range(2, most + 1):
        course = np.asarray(chebyshev.chebfit(x, phase, degree), dtype=np.float64)
        if off(course) < _NEAR_ENOUGH:
            return course
    return None
