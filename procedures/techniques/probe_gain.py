"""One channel's gain from its record of a steady level in both polarities."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from drivers.interfaces import Accuracy, Reading, Waveform

#: Noise below this share of a converter step does not average the steps.
_DITHERS = 0.3


@dataclass(frozen=True)
class ShownLevel:
    """A channel's mean at a steady level (V or A), its Type A uncertainty, and the reference's reading of the level, both signed.

    `stated` is the limit of the channel's gain without a verification, relative.
    """

    shown: float
    uncertainty: float
    reference: float
    accuracy: Accuracy
    stated: float


def shown_level(wave: Waveform, reference: Reading, sign: float) -> ShownLevel:
    """Return a record's mean with what its noise and the converter's steps leave open."""
    noise, step = float(np.std(wave.values, ddof=1)), wave.resolution
    scatter = noise / np.sqrt(wave.values.size)
    # Without noise the mean is anywhere within a step.
    coarse = step / np.sqrt(12.0) if noise < _DITHERS * step else 0.0
    return ShownLevel(
        float(np.mean(wave.values)),
        float(np.hypot(scatter, coarse)),
        sign * reference.value,
        reference.accuracy,
        wave.accuracy.gain,
    )


def steady(readings: Sequence[Reading]) -> Reading:
    """Return the mean of readings of one level, with its scatter as their noise."""
    values = np.array([reading.value for reading in readings])
    noise = float(np.std(values, ddof=1) / np.sqrt(values.size)) if values.size > 1 else 0.0
    last = readings[-1]
    return replace(last, value=float(np.mean(values)), accuracy=replace(last.accuracy, noise=noise))


def less_zero(reading: Reading, zero: Reading) -> Reading:
    """Return a meter's reading less what it shows of nothing, which takes its offset out; a meter that shows exactly none is not known."""
    if not zero.value:
        return reading
    # Once for each polarity, so it does not fall out.
    noise = float(np.hypot(reading.accuracy.noise, np.sqrt(2.0) * zero.accuracy.noise))
    return replace(
        reading, value=reading.value - zero.value, accuracy=replace(reading.accuracy, offset=0.0, noise=noise)
    )


def gain_between(high: ShownLevel, low: ShownLevel) -> tuple[float, float, Accuracy]:
    """Return the gain between two levels, its Type A uncertainty, and the reference's limits of error, relative to it.

    Offsets of the channel fall out. The reference's offset does not where it reads both levels in one polarity.
    """
    rise = high.reference - low.reference
    gain = (high.shown - low.shown) / rise
    meter = high.accuracy
    limit = meter.gain + (2.0 * meter.offset + meter.resolution) / abs(rise)
    scatter = np.sqrt(sum(end.uncertainty**2 + (gain * end.accuracy.noise) ** 2 for end in (high, low)))
    return gain, float(scatter) / abs(rise), Accuracy(gain=limit, source=meter.source)
