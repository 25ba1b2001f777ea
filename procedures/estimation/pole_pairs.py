"""Pole pairs from marked rest positions, or from frequency and speed (§3.1)."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.checks import positive, series
from procedures.estimation.fit import EstimationError, FloatArray


class PositionCount(NamedTuple):
    """Pole pairs, and how well the marks fit them: 1 when evenly spaced, about 0 for chance."""

    pole_pairs: int
    concentration: float


class FrequencyRatio(NamedTuple):
    """Pole pairs as the nearest integer to `ratio`; `certain` when the uncertainties cannot make it another."""

    pole_pairs: int
    ratio: float
    certain: bool


def _distinct(angles: FloatArray) -> int:
    """Count the marks, taking as one those much closer together than the typical neighbours."""
    ordered = np.sort(np.mod(angles, 2 * np.pi))
    gaps = np.diff(np.append(ordered, ordered[0] + 2 * np.pi))
    return int(np.sum(gaps > 0.35 * float(np.max(gaps)) / 2)) or 1


def from_angles(angles: ArrayLike, *, threshold: float = 0.75, largest: int = 60) -> PositionCount:
    """Return the smallest p at which the marks (rad, mechanical, over one or more full turns) coincide modulo 2π/p.

    A missed or doubled mark does not change the result (with three or more positions a turn). Raises
    EstimationError where no p up to the number of marks makes |mean exp(j·p·θ)| reach `threshold`.
    """
    marks = series("marked angles", angles)
    most = min(largest, _distinct(marks) + max(1, marks.size // 4))
    candidates = np.arange(1, most + 1)
    concentration = np.abs(np.mean(np.exp(1j * np.outer(candidates, marks)), axis=1))
    high = np.flatnonzero(concentration >= threshold)
    if not high.size:
        best = int(np.argmax(concentration))
        raise EstimationError(
            f"the {marks.size} marked positions are not evenly spaced (best p = {candidates[best]}, concentration "
            f"{concentration[best]:.2f}, {threshold:.2f} needed); mark all stable positions of one full turn again"
        )
    first = int(high[0])
    return PositionCount(int(candidates[first]), float(concentration[first]))


def from_frequency(frequency: float, speed_rpm: float, u_frequency: float, u_speed: float) -> FrequencyRatio:
    """Return p = round(60·f/n) from electrical frequency (Hz) and speed (rpm), with their uncertainties (Hz, rpm).

    The count is certain where p·(u_f/f + u_n/n) < 0.5. Raises EstimationError where the ratio is below one half.
    """
    f = positive("frequency", abs(frequency), "Hz")
    n = positive("speed", abs(speed_rpm), "rpm")
    ratio = 60.0 * f / n
    p = round(ratio)
    if p < 1:
        raise EstimationError(
            f"{f:g} Hz at {n:g} rpm gives {ratio:.3f} pole pairs; frequency and speed do not belong together"
        )
    return FrequencyRatio(p, ratio, p * (abs(u_frequency) / f + abs(u_speed) / n) < 0.5)
