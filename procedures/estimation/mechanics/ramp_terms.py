"""Optional terms of the model of a ramp, beside inertia and friction proportional to speed."""

from dataclasses import dataclass, field

import numpy as np

from procedures.estimation.fitting.fit import FloatArray


@dataclass(frozen=True)
class Stribeck:
    """More friction at low speed: amplitude·exp(−(ω/`speed`)^`power`)."""

    speed: float
    power: float

    def shape(self, speed: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the term for an amplitude of 1, and its slope (s/rad), at speeds (rad/s)."""
        x = np.maximum(speed, 0.0) / self.speed
        value = np.exp(-(x**self.power))
        return value, -self.power * x ** (self.power - 1.0) / self.speed * value


@dataclass(frozen=True)
class Terms:
    """Terms of the model beside inertia, Coulomb, viscous and quadratic friction.

    `speed_filter` (s) is a filter's time constant, each ramp beginning with a transient of its own; `torque_filter` that the torque's
    is fitted; `added` (m, n) are further shapes in the speeds of all ramps.
    """

    stribeck: Stribeck | None = None
    speed_filter: float = 0.0
    torque_filter: bool = False
    added: tuple[FloatArray, ...] = field(default=(), compare=False)
