"""Checks of the data before an estimate, so that no result is NaN."""

from typing import TYPE_CHECKING, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.fit import EstimationError, FloatArray

if TYPE_CHECKING:
    from GTC.lib import UncertainReal

#: What a formula takes and gives: a float, or an uncertain real number that carries its budget with it.
Number = TypeVar("Number", float, "UncertainReal")


def series(name: str, values: ArrayLike, *, least: int = 1) -> FloatArray:
    """Return values as a float array of shape (n,). Raises EstimationError where they are not finite or fewer than `least`."""
    array = np.asarray(values, dtype=np.float64)
    if array.ndim != 1:
        raise EstimationError(f"{name} has {array.ndim} dimensions; a series of values is needed")
    if array.size < least:
        raise EstimationError(f"{name} has {array.size} points, at least {least} are needed; take more points")
    bad = np.flatnonzero(~np.isfinite(array))
    if bad.size:
        raise EstimationError(
            f"{name} holds {bad.size} values that are not numbers, the first at point {bad[0]}; remove or retake them"
        )
    return array


def same_length(**arrays: FloatArray) -> None:
    """Raise EstimationError unless all series have the same number of points."""
    sizes = {name: array.shape[-1] for name, array in arrays.items()}
    if len(set(sizes.values())) > 1:
        raise EstimationError("series differ in length: " + ", ".join(f"{name} {size}" for name, size in sizes.items()))


def increasing(time: FloatArray) -> None:
    """Raise EstimationError unless time increases from point to point."""
    back = np.flatnonzero(np.diff(time) <= 0)
    if back.size:
        raise EstimationError(
            f"time does not increase at point {back[0] + 1} ({time[back[0] + 1]:g} s); sort or retake the record"
        )


def uniform_step(time: FloatArray) -> float:
    """Return the sampling interval (s). Raises EstimationError where time does not increase or a sample is missing."""
    increasing(time)
    steps = np.diff(time)
    step = float(time[-1] - time[0]) / (time.size - 1)
    typical = float(np.median(steps))
    # Files round the time of a sample, so single steps may differ by a good part of themselves.
    gap = np.flatnonzero((steps > 1.9 * typical) | (steps < 0.1 * typical))
    if gap.size or abs(step - typical) > 0.2 * typical:
        where = int(gap[0]) if gap.size else int(np.argmax(steps))
        raise EstimationError(
            f"the samples are not evenly spaced: {steps[where]:g} s between points {where} and {where + 1}, "
            f"elsewhere {typical:g} s; export the record without gaps"
        )
    return step


def estimate_of(quantity: Number) -> float:
    """Return a number as it is, and the estimate of an uncertain one."""
    return float(getattr(quantity, "x", quantity))


def positive(name: str, value: Number, unit: str) -> float:
    """Return the value, the estimate of an uncertain one. Raises EstimationError unless it is finite and above zero."""
    estimate = estimate_of(value)
    if not (np.isfinite(estimate) and estimate > 0):
        raise EstimationError(f"{name} = {estimate:g} {unit} is not above zero; check the reading")
    return estimate
