"""Lower bound of a motor's drag, from a coast-down that is too short to be fitted."""

from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import FloatArray

#: Standard uncertainties from a value to its one-sided 97.5 % bound.
ONE_SIDED = 1.96


@dataclass(frozen=True)
class OwnDrag:
    """Bounds of the other rotating parts: least inertia (kg·m²), largest Coulomb friction (N·m) and viscous friction (N·m·s)."""

    inertia: float
    coulomb_friction: float
    viscous_friction: float


def least_drag(
    own: OwnDrag, time: FloatArray, speed: FloatArray, torque: FloatArray, *, slow: float, later: float, error: float
) -> float:
    """Return what the motor's Coulomb friction is at the least (N·m, 97.5 %), of a driven ramp (s, rad/s, N·m; (n,) each) and a coast.

    `later` (s) after its last reading the shaft was as slow as `slow` (rad/s); `error` (rad/s) is what the difference of both speeds may
    be off. In between, the inertia of what turns beside the motor alone was slowed down no more slowly than that. Not more than 0 where
    nothing can be told.
    """
    top = float(speed[-1])
    slowing = max(top - slow - error, 0.0) / later
    most = own.coulomb_friction + own.viscous_friction * top + _growing(time, speed, torque)
    return own.inertia * slowing - most


def _growing(time: FloatArray, speed: FloatArray, torque: FloatArray) -> float:
    """Return the most (N·m) by which a drag can have grown with the speed over a driven ramp: its acceleration falls by that."""
    curve, covariance = np.polyfit(time, speed, 2, cov=True)
    span = float(time[-1] - time[0])
    falls = span * (-2.0 * float(curve[0]) + 2.0 * ONE_SIDED * float(np.sqrt(covariance[0, 0])))
    # All of the torque is more than what the inertia takes.
    inertia = float(np.mean(torque)) * span / float(speed[-1] - speed[0])
    return inertia * max(falls, 0.0)
