"""Optional terms of the model of a ramp, beside inertia and friction proportional to speed."""

from dataclasses import dataclass, field, replace

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.nonlinear import IntArray


@dataclass(frozen=True)
class Stribeck:
    """More friction at low speed: amplitude·exp(−(ω/`speed`)^`power`); of several fits at once each has its `speed` (m, 1)."""

    speed: float | FloatArray
    power: float

    def friction(self, speed: FloatArray) -> FloatArray:
        """Return the term for an amplitude of 1 at speeds (rad/s)."""
        x = np.maximum(speed, 0.0) / self.speed
        return np.asarray(np.exp(-x if self.power == 1.0 else -(x**self.power)))

    def shape(self, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the term for an amplitude of 1, and its slope (s/rad), at speeds (rad/s)."""
        value = self.friction(speed)
        if self.power == 1.0:
            return value, value / -self.speed
        x = np.maximum(speed, 0.0) / self.speed
        return value, -self.power * x ** (self.power - 1.0) / self.speed * value


@dataclass(frozen=True)
class FrictionDrift:
    """Friction that falls while the shaft turns, as grease warms, or rises: as 1 − exp(−t/`time`), by the amplitude until `end` (s).

    It is the viscous friction, the amplitude being that at the speed `top` (rad/s), or the Coulomb friction where `top` is 0. Of several
    fits at once each has its `time` (m, 1).
    """

    time: float | FloatArray
    end: float
    top: float = 0.0

    def fall(self, turned: FloatArray, speed: FloatArray) -> FloatArray:
        """Return by what friction has fallen for an amplitude of 1, after times (s) of turning, at speeds (rad/s)."""
        fallen = np.expm1(-turned / self.time) / np.expm1(-self.end / self.time)
        return np.asarray(fallen * (speed / self.top if self.top else np.ones_like(speed)))


@dataclass(frozen=True)
class Terms:
    """Terms of the model beside inertia, Coulomb, viscous and quadratic friction.

    `speed_filter` (s) is a filter's time constant, of several fits at once each one's (m, 1), each ramp beginning with a transient of its
    own; `torque_filter` that the torque's is fitted; `added` (m, n) are further shapes in the speeds of all ramps.
    """

    stribeck: Stribeck | None = None
    drift: FrictionDrift | None = None
    speed_filter: float | FloatArray = 0.0
    torque_filter: bool = False
    added: tuple[FloatArray, ...] = field(default=(), compare=False)

    @property
    def filters_speed(self) -> bool:
        """Whether there is a filter of the speed."""
        return isinstance(self.speed_filter, np.ndarray) or self.speed_filter > 0.0

    @property
    def several(self) -> tuple[int, ...]:
        """How many fits these are the terms of: (m,), () for one."""
        law, drift = self.stribeck, self.drift
        for each in (law.speed if law else 0.0, drift.time if drift else 0.0, self.speed_filter):
            if isinstance(each, np.ndarray):
                return (len(each),)
        return ()

    def of(self, rows: IntArray) -> "Terms":
        """Return the terms of some of several fits."""
        law, drift, lag = self.stribeck, self.drift, self.speed_filter
        if law is not None and isinstance(law.speed, np.ndarray):
            law = replace(law, speed=law.speed[rows])
        if drift is not None and isinstance(drift.time, np.ndarray):
            drift = replace(drift, time=drift.time[rows])
        return replace(self, stribeck=law, drift=drift, speed_filter=lag[rows] if isinstance(lag, np.ndarray) else lag)
