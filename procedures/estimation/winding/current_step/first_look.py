"""First estimate of the duration of a recorded step, with any noise."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.noise import white_noise

#: Samples are averaged in so many blocks.
_BLOCKS = 500
#: A change counts as a step beyond so many standard deviations of a block's mean.
_CLEAR = 6.0


class StepLook(NamedTuple):
    """Time constant (s; 0 below a block's length, infinite beyond the record), and from when to when (s) the voltage rises."""

    time_constant: float
    begin: float
    end: float


def look_at_step(time: ArrayLike, voltage: ArrayLike, current: ArrayLike) -> StepLook:
    """Return about how long a step's response takes (s, V, A, shape (n,)), to choose the record's length by.

    From ∫v dt = R·∫i dt + L·i, which does not ask where the voltage began. Raises EstimationError where there is no step.
    """
    t, v, i = (series(n, x, least=100) for n, x in (("time", time), ("voltage", voltage), ("current", current)))
    same_length(time=t, voltage=v, current=i)
    length = max(1, t.size // _BLOCKS)
    at, volts, amperes = (_means(x, length) for x in (t, v, i))
    head, tail = slice(0, max(3, at.size // 20)), slice(-(at.size // 10), None)
    swing = float(np.mean(volts[tail]) - np.mean(volts[head]))
    noise = white_noise(v) / np.sqrt(length)
    if abs(swing) <= _CLEAR * noise:
        raise EstimationError("the voltage shows no step; check the voltage probe and the trigger")
    risen = (volts - float(np.mean(volts[head]))) / swing
    half = int(np.argmax(risen >= 0.5))
    before = np.flatnonzero(risen[: half + 1] < 0.1)
    begin = int(before[-1]) if before.size else 0
    full = half + int(np.argmax(risen[half:] >= 0.9))
    rest = float(np.mean(amperes[: begin + 1]))
    if float(np.max(np.abs(amperes - rest))) <= _CLEAR * white_noise(i) / np.sqrt(length):
        raise EstimationError("the current shows no step; check the current probe and the trigger")
    step = float(at[1] - at[0])
    tau = _time_constant(volts[begin:] - float(np.mean(volts[: begin + 1])), amperes[begin:] - rest, step)
    return StepLook(tau, float(at[begin]), float(at[full]))


class StepCourse(NamedTuple):
    """A step's current at first sight: `fitted` (A, (n,)) of a loop of `resistance` (Ω) and `inductance` (H)."""

    fitted: FloatArray
    resistance: float
    inductance: float


def course_at_sight(time: ArrayLike, voltage: ArrayLike, current: ArrayLike) -> StepCourse:
    """Return the current that one resistance and one inductance draw under the recorded voltage (s, V, A, shape (n,)), in milliseconds.

    From i = i0 + ∫v dt/L − R/L·∫i dt; a line in time stands for what both channels show at rest. Raises EstimationError where the
    current does not follow the voltage as it does in such a loop.
    """
    t, v, i = (series(n, x, least=100) for n, x in (("time", time), ("voltage", voltage), ("current", current)))
    same_length(time=t, voltage=v, current=i)
    step = float(t[1] - t[0])
    design = np.array((_integral(v) * step, -_integral(i) * step, t - t[0], np.ones_like(t)))
    scale = np.sqrt(np.mean(design**2, axis=1))
    if not np.all(scale > 0.0):
        raise EstimationError("a channel is zero throughout; check its probe")
    design /= scale[:, None]
    solution = np.linalg.lstsq(design @ design.T, design @ i, rcond=None)[0]
    per_henry, rate = solution[0] / scale[0], solution[1] / scale[1]
    if not (per_henry > 0.0 and rate > 0.0):
        raise EstimationError("the current does not follow the voltage; check the direction of both probes")
    return StepCourse(np.asarray(solution @ design), float(rate / per_henry), float(1.0 / per_henry))


def _time_constant(volts: FloatArray, amperes: FloatArray, step: float) -> float:
    design = np.column_stack((_integral(amperes), amperes, np.ones_like(amperes)))
    scale = np.sqrt(np.mean(design**2, axis=0))
    solution, *_ = np.linalg.lstsq(design / scale, _integral(volts), rcond=None)
    resistance, inductance = solution[0] / scale[0], solution[1] / scale[1]
    if not resistance > 0.0:
        return float("inf") if inductance > 0.0 else 0.0
    tau = float(inductance / resistance)
    return tau * step if tau > 1.0 else 0.0


def _integral(values: FloatArray) -> FloatArray:
    return np.append(0.0, np.cumsum(0.5 * (values[1:] + values[:-1])))


def _means(values: FloatArray, length: int) -> FloatArray:
    whole = values.size // length * length
    result: FloatArray = values[:whole].reshape(-1, length).mean(axis=1)
    return result
