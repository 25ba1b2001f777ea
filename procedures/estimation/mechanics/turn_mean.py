"""The mean torque of a shaft that turns, where it varies once a turn."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import fdtrc

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.fitting.repeats import mean_of_readings

#: A part once a turn is one where chance finds as much in fewer than this share of records.
_CHANCE = 1e-4
#: It is looked for where the torque scatters by more than this share of its mean.
_WORTH = 0.02
#: It must leave less than this share of what a drift leaves.
_CLEARER = 0.4
#: Smallest singular value of the design, per root of readings, by which the part can be told from the mean.
_APART = 0.15
_NAMES = ("mean", "cosine", "sine")


@dataclass(frozen=True)
class TurnMean:
    """Mean torque (N·m), its standard uncertainty (N·m) and degrees of freedom; `once_a_turn` (N·m) is the amplitude of a part
    that repeats every turn, 0 where none is seen, and `scatter` (N·m) the standard deviation of what is left.
    """

    mean: float
    uncertainty: float
    degrees_of_freedom: float
    once_a_turn: float
    scatter: float


def mean_over_turns(torque: ArrayLike, time: ArrayLike, speed: ArrayLike) -> TurnMean:
    """Return the mean of torques (N·m) read at times (s) while the shaft turns at speeds (rad/s, mechanical), all of shape (n,).

    A rotor that rubs drags once a turn: that part is fitted beside the mean where it is clearly there. Raises EstimationError for
    fewer than two readings, or arrays of several lengths.
    """
    read, at, turning = series("torques", torque), series("times", time), series("speeds", speed)
    same_length(torques=read, times=at, speeds=turning)
    if read.size < 2:
        raise EstimationError("a mean over turns takes two readings at least")
    mean, uncertainty, freedom = mean_of_readings(list(read))
    scatter = uncertainty * math.sqrt(read.size)
    plain = TurnMean(mean, uncertainty, freedom, 0.0, scatter)
    if read.size <= len(_NAMES) + 1 or scatter <= _WORTH * abs(mean):
        return plain
    angle = np.concatenate(((0.0,), np.cumsum(0.5 * (turning[1:] + turning[:-1]) * np.diff(at))))
    design = np.column_stack((np.ones(read.size), np.cos(angle), np.sin(angle)))
    if np.linalg.svd(design, compute_uv=False)[-1] < _APART * math.sqrt(read.size):
        # Always at the same places of the turn: nothing tells the part from the mean.
        return plain
    fit = least_squares(_NAMES, design, read)
    # What drifts looks like a part of a turn where the readings are nearly a turn apart.
    drift = least_squares(
        ("mean", "slope", "bend"), np.vander(np.linspace(-1.0, 1.0, read.size), 3, increasing=True), read
    )
    if fit.residual_rms > _CLEARER * drift.residual_rms:
        return plain
    left, gained = float(fit.residuals @ fit.residuals), 2.0
    explained = freedom * scatter**2 - left
    ratio = explained / gained / (left / fit.degrees_of_freedom) if left > 0.0 else math.inf
    if float(fdtrc(gained, fit.degrees_of_freedom, ratio)) > _CHANCE:
        return plain
    amplitude = math.hypot(fit.value("cosine"), fit.value("sine"))
    return TurnMean(
        fit.value("mean"),
        fit.uncertainty("mean"),
        fit.degrees_of_freedom,
        amplitude,
        math.sqrt(left / fit.degrees_of_freedom),
    )
