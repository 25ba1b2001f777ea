"""Noise of a sampled signal, from its scatter and from the steps of its converter."""

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import FloatArray

#: Frequencies of the mains (Hz), and the share by which a net strays from them.
MAINS, MAINS_STRAY = (50.0, 60.0), 0.01

#: Noise makes runs of so many equal readings side by side in phase in no record.
_ALL_ALIKE = 8.0
#: A step of rounding shows in so many levels, the nearest of which are up to so many steps apart; levels are off it by this share of it,
#: and the same from this share of the largest down.
_LEAST_LEVELS, _MOST_STEPS, _OFF_STEP, _SAME = 15, 2000, 1e-3, 1e-11


def white_noise(values: FloatArray, resolution: float = 0.0, among: NDArray[np.bool_] | None = None) -> float:
    """Return the standard deviation of the sample-to-sample noise (unit of the values), quantisation included.

    From second differences, so that a smooth signal does not count; single jumps are left out.
    Never below that of rounding to `resolution`. Of the second differences (n − 2) only those `among` count, where given.
    """
    floor = resolution / np.sqrt(12.0)
    second = np.abs(np.diff(values, 2))
    if among is not None:
        second = second[among]
    if not second.size:
        return float(floor)
    limit = 6.0 * (1.4826 * float(np.median(second)) + resolution)
    if limit == 0:
        limit = float(np.sort(second)[-1 - max(4, second.size // 200)]) if second.size > 10 else float(np.max(second))
    kept = second[second <= limit]
    spread = float(np.sqrt(np.mean(kept**2) / 6.0)) if kept.size else 0.0
    return float(max(spread, floor))


def undithered(noise: float, resolution: float) -> float:
    """Return the standard deviation of the error that rounding leaves in a *mean* of samples (unit of `resolution`).

    `noise` includes quantisation. With noise of half a step or more, rounding averages out; with less, the mean of
    a steady signal stays wrong by up to half a step (first term of the quantiser's Fourier series).
    """
    if resolution <= 0:
        return 0.0
    before = max(noise**2 / resolution**2 - 1.0 / 12.0, 0.0)
    return float(resolution * min(np.exp(-2.0 * np.pi**2 * before) / (np.pi * np.sqrt(2.0)), 1.0 / np.sqrt(12.0)))


def undithered_sine(amplitude: float, noise: float, resolution: float) -> float:
    """Return the standard uncertainty that rounding to `resolution` leaves in the amplitude of a sine (all in one unit).

    However many samples: the steps of a periodic signal repeat with it. `noise` is the residual's, quantisation included. From the first
    term of the quantiser's Fourier series, whose amplitude a sine's turning points weigh as q·√(q/A).
    """
    if resolution <= 0.0 or amplitude <= 0.0:
        return 0.0
    before = max(noise**2 / resolution**2 - 1.0 / 12.0, 0.0)
    return float(0.157 * resolution * np.sqrt(min(resolution / amplitude, 1.0)) * np.exp(-2.0 * np.pi**2 * before))


def alike(phase: FloatArray, values: FloatArray, course: FloatArray, noise: float, resolution: float) -> float:
    """Return how many readings of a periodic signal share one rounding error, 1 where noise averages them out.

    Readings within one step of the signal's `course` at one `phase` (rad), whatever turn they are of, are one reading: sampled at few
    phases, a turn's rounding comes again in every turn. `noise` is the residual's, quantisation included; of a
    `resolution` that is not known (0) equal readings tell it.
    """
    row = (np.floor(course / resolution) if resolution > 0.0 else values)[
        np.argsort(np.mod(phase, 2.0 * np.pi), kind="stable")
    ]
    starts = np.concatenate(([0], np.flatnonzero(np.diff(row)) + 1))
    lengths = np.diff(np.append(starts, row.size))
    run = float(np.sum(lengths**2) / row.size)
    if resolution <= 0.0:
        return run if run > _ALL_ALIKE else 1.0
    own = max(noise**2 / resolution**2, 1.0 / 12.0)
    share = np.exp(-4.0 * np.pi**2 * (own - 1.0 / 12.0)) / (12.0 * own)
    return float(1.0 + share * (run - 1.0))


def rounded_to(values: FloatArray) -> float:
    """Return the step (unit of the values) to which readings (n,) were rounded, 0 where they were not or too few show it.

    All differences are multiples of one step.
    """
    levels = np.unique(values)
    differences = np.diff(levels)
    # Equal numbers in other units differ by the last digits of a float.
    differences = differences[differences > _SAME * max(abs(float(levels[0])), abs(float(levels[-1])))]
    if differences.size < _LEAST_LEVELS:
        return 0.0
    offsets = levels - levels[0]
    smallest = float(np.min(differences))
    parts = np.arange(1.0, _MOST_STEPS + 1.0)
    few = differences[:_LEAST_LEVELS, None] * parts / smallest
    for part in parts[np.max(np.abs(few - np.rint(few)), axis=0) < _OFF_STEP * 10.0]:
        # The smallest difference carries a float's error, the span of all steps hardly.
        step = float(offsets[-1] / np.rint(offsets[-1] * part / smallest))
        if np.max(np.abs(offsets / step - np.rint(offsets / step))) < _OFF_STEP:
            return step
    return 0.0
