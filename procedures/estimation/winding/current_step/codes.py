"""Evaluates a converter's codes: whether the range ended, or the steps are too coarse for the noise."""

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray

#: A range's end shows where noise before the converter is at least this share of a code, and where chance would have put so many
#: samples above the last code.
_LEAST_NOISE, _MISSING = 0.15, 10.0
#: Noise that is tried for a resting signal's codes, in codes; what is below the likeliest by so much (half of χ²) is excluded. Of
#: larger noise the variance tells enough.
_NOISES, _EXCLUDED, _BY_VARIANCE = np.linspace(0.05, 0.8, 51), 2.0, 0.75
#: Where between two codes a signal may rest.
_PLACES = np.linspace(-0.5, 0.5, 32, endpoint=False)
_LEAST_AT_END = 5
#: A resting signal is straight over so many samples; readings at the end of a range are counted over so many.
_TOGETHER, _COUNTED = 32, (64, 256)
#: Noise below this share of a code does not carry the signal from one to the next.
_COARSE = 0.1


def clipped_at(
    values: FloatArray, before: int, resolution: float, upwards: bool, end: float | None = None
) -> float | None:
    """Return the value at which a signal (n,) is cut off, None where it is not.

    `before` is how many samples lie before the step, from which the noise is read; `end` the last value that the converter gives, where
    it is known. Where it is not, the codes must end more abruptly than the noise does.
    """
    x = values if upwards else -values
    top = float(np.max(x))
    sign = 1.0 if upwards else -1.0
    if end is not None:
        return sign * top if top >= sign * end - 0.75 * resolution else None
    levels = np.unique(x)[-8:]
    code = float(resolution or (np.median(np.diff(levels)) if levels.size > 1 else 0.0))
    at = np.flatnonzero(x >= top - 0.25 * code)
    if len(at) < _LEAST_AT_END or before < 3:
        return None
    noise = _before_converter(values[:before], code)
    if noise <= max(_LEAST_NOISE * code, 1e-6 * float(np.ptp(values))):
        return None
    within = (x >= top - 0.25 * code)[at[0] : at[-1] + 1].astype(np.float64)
    above = max(_expected_above(within, length, code / noise) for length in _COUNTED)
    return sign * top if above > _MISSING else None


def _expected_above(within: FloatArray, length: int, code: float) -> float:
    """Return how many samples chance would have put above the last code, by how many lie `within` it (n,); `code` is in noises.

    Counted over `length` samples each, for the signal itself may move while it is there.
    """
    starts = np.arange(0, within.size, length)
    counts = np.diff(np.append(starts, within.size))
    shares = np.clip(np.add.reduceat(within, starts) / counts, 0.0, 1.0 - 1.0 / counts)
    return float(counts @ special.ndtr(special.ndtri(shares) - code))


def _before_converter(resting: FloatArray, code: float) -> float:
    """Return the noise before a converter, at the least, from readings (n,) of a resting signal."""
    variance = _scatter(resting)
    noise = float(np.sqrt(max(variance - code**2 / 12.0, 0.0)))
    if code <= 0.0 or noise > _BY_VARIANCE * code:
        return noise
    return code * _by_codes(np.rint(resting / code))


def _by_codes(codes: FloatArray) -> float:
    """Return the least noise (in codes) that a resting signal's codes (n,) do not exclude.

    What is read depends on where between two codes the signal lies: of each few samples it may lie elsewhere, the noise is one.
    """
    length = min(_TOGETHER // 2, codes.size)
    blocks = codes[: codes.size // length * length].reshape(-1, length)
    middles = np.round(np.median(blocks, axis=1))[:, None]
    reach = np.arange(-4, 5)
    counts = np.stack([np.sum(blocks == middles + k, axis=1) for k in reach], axis=1)
    edges = np.append(reach - 0.5, reach[-1] + 0.5)
    passed = special.ndtr((edges - _PLACES[:, None]) / _NOISES[:, None, None])
    chances = np.log(np.maximum(np.diff(passed, axis=-1), 1e-12))
    likely = np.sum(np.max(np.einsum("bk,npk->nbp", counts, chances), axis=-1), axis=-1)
    return float(_NOISES[int(np.argmax(likely > np.max(likely) - _EXCLUDED))])


def _scatter(values: FloatArray) -> float:
    """Return the variance of a resting signal (n,) about straight lines over few samples each: hum and drift are not its noise."""
    length = min(_TOGETHER, values.size)
    blocks = values[: values.size // length * length].reshape(-1, length)
    place = np.linspace(-1.0, 1.0, length)
    left = blocks - blocks.mean(axis=1, keepdims=True)
    left = left - np.outer(left @ place / (place @ place), place)
    return float(np.sum(left**2)) / (blocks.shape[0] * max(length - 2, 1))


def too_coarse(values: FloatArray, model: FloatArray, resolution: float) -> bool:
    """Return whether the noise before the converter is less than a tenth of a code, told by how seldom a rising signal (n,) falls back.

    `model` (n,) is the signal without noise.
    """
    if resolution <= 0.0:
        return False
    rise = np.diff(model) / resolution
    whole = (model[-1] - model[0]) / resolution
    if whole < 0.0:
        rise, whole = -rise, -whole
    progress = np.abs(model[1:] - model[0]) / resolution
    inside = (progress > 2.0) & (progress < whole - 2.0) & (rise > 0.0)
    # Two readings in a row, either side of a code's edge, against the rise.
    u = rise[inside] / (_COARSE * np.sqrt(2.0))
    expected = (
        _COARSE * np.sqrt(2.0) * float(np.sum(np.exp(-(u**2) / 2.0) / np.sqrt(2.0 * np.pi) - u * special.ndtr(-u)))
    )
    back = np.diff(values) * np.sign(model[-1] - model[0])
    counted = int(np.sum(back[inside] < -0.25 * resolution))
    return bool(expected > 6.0 and counted < expected - 2.0 * np.sqrt(expected))


def limited_from(voltage: FloatArray, current: FloatArray, begin: int, noise: float) -> int | None:
    """Return the sample at which a supply's limit ends the rise of the current (n,), None where nothing does.

    The voltage (n,), whose noise is given, falls at once, and from then on the current stands. `begin` is the last sample before the step.
    """
    if begin >= voltage.size - 20:
        return None
    swing = float(np.median(voltage[begin:]) - np.mean(voltage[:begin]))
    fall = -np.sign(swing) * np.diff(voltage[begin:])
    at = int(np.argmax(fall)) + begin
    if fall[at - begin] < max(8.0 * noise, 0.005 * abs(swing)) or at >= voltage.size - 20:
        return None
    length = min(20, at // 2, (voltage.size - at) // 2)
    rising = abs(float(np.mean(current[at - length // 2 : at]) - np.mean(current[at - 2 * length : at - length])))
    rest = current[at + 2 :]
    half = rest.size // 2
    standing = abs(float(np.mean(rest[half:]) - np.mean(rest[:half])))
    change = abs(float(np.mean(rest) - np.mean(current[:begin])))
    scatter = float(np.std(current[:begin])) / np.sqrt(length)
    stands = standing < 0.005 * change + 4.0 * scatter and rising > 4.0 * scatter
    return at - 1 if stands and bool(np.max(np.abs(rest - np.mean(rest))) < 0.1 * change) else None
