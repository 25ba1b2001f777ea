"""Torque constant from torque over current (§2.4)."""

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, Fit
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.fitting.noise import white_noise

#: A change is one beyond so many standard deviations of its mean over few levels.
_CLEAR = 5.0
#: A current below this share of the largest has no sign to speak of.
_NIL = 0.05


def drift_within_levels(torque: ArrayLike, resolution: float = 0.0) -> float:
    """Return by how much torque (N·m), shape (levels, readings), moves from the first to the second half of a level's readings; 0 where
    chance explains it.

    The levels must rise, or fall, in even steps: what lags behind them moves alike at each but the first, which is left out.
    """
    t = np.asarray(torque, dtype=np.float64)
    half = t.shape[1] // 2
    if not half or t.shape[0] < 3:
        return 0.0
    moved = t[1:, -half:].mean(axis=1) - t[1:, :half].mean(axis=1)
    # What lags far behind moves more from level to level: that is no scatter. Of two means of readings that stay within one step,
    # each is off by any part of it.
    scatter = white_noise(moved, math.sqrt(2.0) * resolution)
    drift = float(np.mean(moved))
    return drift if abs(drift) > _CLEAR * scatter / math.sqrt(moved.size) else 0.0


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


class InducedConstant(NamedTuple):
    """The torque constant (N·m/A) that the induced voltage (V, peak) makes, with the standard uncertainty and the degrees of freedom of its
    scatter.
    """

    value: float
    uncertainty: float
    degrees_of_freedom: int
    voltage: float


def induced_constant(current: ArrayLike, voltage: ArrayLike, speed: ArrayLike) -> InducedConstant | None:
    """Return 1.5·|v₀|/ω, v₀ being the voltage (V, peak, d + j·q) at no q-axis current (A, peak), ω the shaft's speed (rad/s).

    All have shape (levels, readings). Electrical power is mechanical power, so that pole pairs do not enter; in the length of the
    voltage neither the angle's zero does nor a delay. Resistance and inductance change it in proportion to the current, switches and
    dead time by its sign. None where there are too few levels, or nothing turns.
    """
    i = np.mean(np.asarray(current, dtype=np.float64), axis=1)
    v = np.mean(np.asarray(voltage, dtype=np.complex128), axis=1)
    turning = abs(float(np.mean(np.asarray(speed, dtype=np.float64))))
    design = np.column_stack((np.ones_like(i), i, np.sign(np.where(np.abs(i) < _NIL * np.max(np.abs(i)), 0.0, i))))
    freedom = i.size - design.shape[1]
    if freedom < 1 or turning == 0.0 or np.linalg.matrix_rank(design) < design.shape[1]:
        return None
    inverse = np.linalg.inv(design.T @ design)
    found = inverse @ design.T @ v
    left = v - design @ found
    axis = found[0] / abs(found[0])
    # Only what lies along it changes the length.
    scatter = math.sqrt(float(inverse[0, 0]) * float(np.sum((left * axis.conjugate()).real ** 2)) / freedom)
    length = abs(complex(found[0]))
    return InducedConstant(1.5 * length / turning, 1.5 * scatter / turning, freedom, length)
