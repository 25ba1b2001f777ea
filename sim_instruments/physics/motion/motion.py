"""Laws of motion of the shaft, each in closed form. Angles and speeds are mechanical, times absolute bench times."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from sim_instruments.physics.circuits.windings import FloatArray


class Motion(Protocol):
    """Angle (rad), speed (rad/s) and acceleration (rad/s²) at given times (s)."""

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the angle at the times."""

    def speed(self, times: FloatArray) -> FloatArray:
        """Return the speed at the times."""

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return the acceleration at the times."""


@dataclass(frozen=True)
class RestingShaft:
    """A shaft that stands."""

    rest_angle: float

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the constant angle."""
        return np.full_like(times, self.rest_angle)

    def speed(self, times: FloatArray) -> FloatArray:
        """Return zeros."""
        return np.zeros_like(times)

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return zeros."""
        return np.zeros_like(times)


@dataclass(frozen=True)
class Ramp:
    """Constant acceleration from a speed on."""

    start: float
    start_angle: float
    start_speed: float
    rate: float = 0.0

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the angle at the times."""
        passed = times - self.start
        return self.start_angle + self.start_speed * passed + 0.5 * self.rate * passed**2

    def speed(self, times: FloatArray) -> FloatArray:
        """Return the speed at the times."""
        return self.start_speed + self.rate * (times - self.start)

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return the constant acceleration."""
        return np.full_like(times, self.rate)


@dataclass(frozen=True)
class Wavering:
    """A mean speed with a sinusoidal variation: ω = mean·(1 + depth·sin(rate·t + phase))."""

    start: float
    start_angle: float
    mean_speed: float
    depth: float
    rate: float
    phase: float = 0.0

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the angle at the times."""
        passed = times - self.start
        if self.rate == 0.0 or self.depth == 0.0:
            return self.start_angle + self.mean_speed * passed
        swing = (math.cos(self.phase) - np.cos(self.rate * passed + self.phase)) * self.depth / self.rate
        return self.start_angle + self.mean_speed * (passed + swing)

    def speed(self, times: FloatArray) -> FloatArray:
        """Return the speed at the times."""
        return self.mean_speed * (1.0 + self.depth * np.sin(self.rate * (times - self.start) + self.phase))

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return the acceleration at the times."""
        return self.mean_speed * self.depth * self.rate * np.cos(self.rate * (times - self.start) + self.phase)


@dataclass(frozen=True)
class Drag:
    """Constant torque against viscous friction: J·ω' = torque − B·ω, Coulomb friction already in `torque`."""

    start: float
    start_angle: float
    start_speed: float
    torque: float
    inertia: float
    viscous_friction: float

    @property
    def _initial(self) -> float:
        return (self.torque - self.viscous_friction * self.start_speed) / self.inertia

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the angle at the times."""
        passed = times - self.start
        share = passed * (self.viscous_friction / self.inertia)
        # (s + e^−s − 1)/s²; its own series where the difference would cancel.
        bend = 0.5 + share * (-1.0 / 6.0 + share * (1.0 / 24.0 - share / 120.0))
        large = share >= 1e-3
        if large.any():
            s = share[large]
            bend[large] = (s + np.expm1(-s)) / s**2
        return self.start_angle + passed * (self.start_speed + self._initial * passed * bend)

    def speed(self, times: FloatArray) -> FloatArray:
        """Return the speed at the times."""
        passed = times - self.start
        share = passed * self.viscous_friction / self.inertia
        safe = np.where(share == 0.0, 1.0, share)
        return self.start_speed + self._initial * passed * np.where(share == 0.0, 1.0, -np.expm1(-safe) / safe)

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return the acceleration at the times."""
        return self._initial * np.exp(-(times - self.start) * self.viscous_friction / self.inertia)

    def time_of_speed(self, speed: float) -> float:
        """Return the time (s) at which a speed is reached, infinite where it never is."""
        change = speed - self.start_speed
        if change == 0.0:
            return self.start
        if self._initial == 0.0 or change * self._initial < 0.0:
            return math.inf
        straight = change / self._initial
        share = straight * self.viscous_friction / self.inertia
        if share >= 1.0:
            return math.inf
        if share == 0.0:
            return self.start + straight
        return self.start + straight * -math.log1p(-share) / share
