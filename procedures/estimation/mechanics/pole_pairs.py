"""Pole pairs from marked rest positions, or from frequency and speed (§3.1)."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import positive, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: Marks coincide from this length of their mean phasor on; no motor has more pole pairs.
_COINCIDE, _MOST = 0.75, 60


class PositionCount(NamedTuple):
    """Pole pairs, and how well the marks fit them: 1 when evenly spaced, about 0 for chance."""

    pole_pairs: int
    concentration: float


class Places(NamedTuple):
    """The places of an even spacing that marks take.

    Places with a mark, marks beyond one a place and turn, largest distance (rad) of marks of one place, widest gap (rad).
    """

    taken: int
    repeated: int
    spread: float
    gap: float


class FrequencyRatio(NamedTuple):
    """Pole pairs as the nearest integer to `ratio`; `certain` when the uncertainties cannot make it another."""

    pole_pairs: int
    ratio: float
    certain: bool


def _gaps(angles: FloatArray) -> FloatArray:
    """Return the angles (rad) between neighbouring marks, all the way round."""
    ordered = np.sort(np.mod(angles, 2 * np.pi))
    return np.asarray(np.diff(np.append(ordered, ordered[0] + 2 * np.pi)), dtype=np.float64)


def _distinct(angles: FloatArray) -> int:
    """Count the marks, taking as one those much closer together than the typical neighbours."""
    gaps = _gaps(angles)
    return int(np.sum(gaps > 0.35 * float(np.max(gaps)) / 2)) or 1


def from_angles(angles: ArrayLike) -> PositionCount:
    """Return the smallest p at which the marks (rad, mechanical, over one or more full turns) coincide modulo 2π/p.

    A missed or doubled mark does not change the result (with three or more positions a turn). Raises
    EstimationError where no p up to the number of marks makes |mean exp(j·p·θ)| reach 0.75.
    """
    marks = series("marked angles", angles)
    most = min(_MOST, _distinct(marks) + max(1, marks.size // 4))
    candidates = np.arange(1, most + 1)
    concentration = np.abs(np.mean(np.exp(1j * np.outer(candidates, marks)), axis=1))
    high = np.flatnonzero(concentration >= _COINCIDE)
    if not high.size:
        best = int(np.argmax(concentration))
        raise EstimationError(
            f"the {marks.size} marked positions are not evenly spaced round the turn (best p = {candidates[best]}, "
            f"concentration {concentration[best]:.2f}, {_COINCIDE:.2f} needed; the widest gap is "
            f"{math.degrees(float(_gaps(marks).max())):.0f}°); mark all stable positions of one full turn again, with more "
            "current (current_share) where friction holds the shaft between them"
        )
    first = int(high[0])
    return PositionCount(int(candidates[first]), float(concentration[first]))


def places(angles: ArrayLike, pole_pairs: int, turns: int = 1) -> Places:
    """Return how marks (rad, mechanical, without the one that closes the last turn) go round `turns` full turns."""
    marks = series("marked angles", angles)
    past = pole_pairs * marks - np.angle(np.mean(np.exp(1j * pole_pairs * marks)))
    slots = np.round(past / (2 * np.pi)).astype(int) % pole_pairs
    aside = (np.mod(past + np.pi, 2 * np.pi) - np.pi) / pole_pairs
    spread = max(float(np.ptp(aside[slots == slot])) for slot in np.unique(slots))
    counts = np.bincount(slots, minlength=pole_pairs)
    return Places(
        int(np.sum(counts > 0)), int(np.sum(np.maximum(counts - turns, 0))), spread, float(_gaps(marks).max())
    )


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
