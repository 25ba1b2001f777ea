"""Torque constant from torque over current (§2.4)."""

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, Fit
from procedures.estimation.fitting.linear import least_squares


def fit_torque_constant(
    current: ArrayLike, torque: ArrayLike, speed: ArrayLike | None = None, *, torque_resolution: float = 0.0
) -> Fit:
    """Fit shaft torque (N·m) = torque_constant·current (A, peak) − friction·sign(speed) + offset.

    Without `speed` (rad/s), or with one direction only, friction and the sensor's zero are one: names `torque_constant`,
    `offset`. With both directions: `torque_constant`, `offset`, `friction`. Raises EstimationError on too few points
    or one current only.
    """
    i, t = series("current", current, least=3), series("torque", torque, least=3)
    same_length(current=i, torque=t)
    if np.ptp(i) <= 1e-9 * np.max(np.abs(i)):
        raise EstimationError("all currents are alike; take readings at several currents")
    names, columns = ["torque_constant", "offset"], [i, np.ones_like(i)]
    if speed is not None:
        direction = np.sign(series("speed", speed))
        same_length(current=i, speed=direction)
        if direction.min() < direction.max():
            names.append("friction")
            columns.append(-direction)
    return least_squares(names, np.column_stack(columns), t, resolution=torque_resolution)
