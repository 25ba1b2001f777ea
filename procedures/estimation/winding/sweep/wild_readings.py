"""Single inductance readings of a sweep that none of the others bears out: found, named and left out."""

import numpy as np
from numpy.typing import NDArray
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding

IntArray = NDArray[np.intp]
#: A reading is looked at beyond so many of the others' spreads, and not below this share of the readings' size.
_SPREADS, _SHARE = 8.0, 1e-3
#: What is left out is none of the others' kind: chance puts one of a sweep's readings there in this share of sweeps.
_CHANCE = 1e-3
#: Readings beside those that a model takes, and the share of the readings that may be wild: more of them are a course.
_SPARE, _MOST = 6, 0.1
#: Rounds of the fit by absolute values, and the least residual in it, as a share of the median.
_ROUNDS, _LEAST = 30, 1e-3
#: Of readings over time, what neighbours lead to: a cubic through two on either side.
_NEIGHBOURS = np.array([-1.0, 4.0, 0.0, 4.0, -1.0]) / 6.0
#: A course that four neighbours do not hold leaves more than noise.
_OVER_TIME = 15.0
_MENDED = 0.25


def wild_at_angles(design: FloatArray, values: FloatArray, resolution: float) -> IntArray:
    """Return which of the readings (H, (n,)) lie far off what the columns of `design` (n, k) make of the others."""
    n, k = design.shape
    if n < k + _SPARE + 1:
        return np.zeros(0, dtype=np.intp)
    weights = np.ones(n)
    left = values
    for _ in range(_ROUNDS):
        root = np.sqrt(weights)
        coefficients, *_ = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)
        left = values - design @ coefficients
        size = np.abs(left)
        weights = 1.0 / np.maximum(size, _LEAST * float(np.median(size)) + 1e-300)
    spread = max(1.4826 * float(np.median(np.abs(left))) * np.sqrt(n / (n - k)), resolution / np.sqrt(12.0))
    suspects = np.flatnonzero(np.abs(left) > np.maximum(_SPREADS * spread, _SHARE * float(np.median(np.abs(values)))))
    if not suspects.size or suspects.size > max(1.0, _MOST * n):
        return np.zeros(0, dtype=np.intp)
    kept = np.delete(np.arange(n), suspects)
    coefficients, squares, rank, _ = np.linalg.lstsq(design[kept], values[kept], rcond=None)
    if rank < k:
        return np.zeros(0, dtype=np.intp)
    freedom = kept.size - k
    variance = max(float(squares[0]) / freedom if squares.size else 0.0, resolution**2 / 12.0)
    inverse = np.linalg.inv(design[kept].T @ design[kept])
    reach = -float(special.stdtrit(freedom, 0.5 * _CHANCE / n))
    far = np.sqrt(variance * (1.0 + np.einsum("ij,jk,ik->i", design[suspects], inverse, design[suspects])))
    off = np.abs(values[suspects] - design[suspects] @ coefficients)
    return np.asarray(suspects[off > reach * far], dtype=np.intp)


def wild_over_time(values: FloatArray, resolution: float) -> IntArray:
    """Return which of the readings (H, (n,)), one after the other at even times, their neighbours do not lead to."""
    n = values.size
    if n < 5 + _SPARE:
        return np.zeros(0, dtype=np.intp)
    off = _off(values)
    inner = np.abs(off[2:-2])
    spread = max(1.4826 * float(np.median(inner)), resolution / np.sqrt(12.0))
    # Four neighbours do not hold a fast course: what that leaves is alike at many readings.
    limit = max(
        _OVER_TIME * spread, _SHARE * float(np.median(np.abs(values))), 3.0 * float(np.quantile(inner, 1.0 - _MOST))
    )
    suspects = [k for k in np.flatnonzero(np.abs(off) > limit) if abs(off[k]) >= np.max(np.abs(off[k - 2 : k + 3]))]
    mended = values.copy()
    mended[suspects] -= off[suspects]
    # Of a wild reading its neighbours are off, too, and are not once it is gone; where the hand slipped, they stay so.
    left = _off(mended)
    found = [k for k in suspects if np.max(np.abs(left[k - 2 : k + 3])) < _MENDED * abs(off[k])]
    return np.array(found if len(found) <= max(1.0, _MOST * n) else [], dtype=np.intp)


def _off(values: FloatArray) -> FloatArray:
    """Return by how much readings are off what two neighbours on either side lead to; 0 for the two at each end."""
    off = np.zeros(values.size)
    off[2:-2] = values[2:-2] - np.convolve(values, _NEIGHBOURS, "valid")
    return off


def led_to(values: FloatArray) -> FloatArray:
    """Return what each reading's neighbours lead to (H)."""
    return np.asarray(values - _off(values))


def named(wild: IntArray, values: FloatArray, expected: FloatArray) -> tuple[Finding, ...]:
    """Return a finding for each wild reading; `expected` (H, (n,)) is where the others lead."""
    return tuple(
        Finding(
            Cause.ODD_READING,
            Answer.MODELLED,
            figures={"record": "sweep", "number": float(k + 1), "read": 1e6 * values[k], "expected": 1e6 * expected[k]},
        )
        for k in wild
    )
