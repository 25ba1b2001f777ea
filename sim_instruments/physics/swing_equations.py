"""Equations of a free rotor under current: shaft and circuit together, while the shaft turns one way."""

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.linalg import null_space

from sim_instruments.physics.network import Network
from sim_instruments.physics.source import CurrentSource, Source, VoltageSource
from sim_instruments.physics.windings import FloatArray

#: A circulating current that decays faster than this (1/s) follows any swing of a rotor at once.
_FAST = 6.0e3


@dataclass(frozen=True)
class Shaft:
    """What turns: `inertia` kg·m², `coulomb_friction` N·m, `viscous_friction` N·m·s/rad, and a constant `torque` N·m."""

    inertia: float
    coulomb_friction: float
    viscous_friction: float
    torque: float = 0.0


class _Field(NamedTuple):
    """At one state: `torque` (N·m) without friction, loop currents (A), loops' EMF and dM/dθ·x over electrical speed."""

    torque: float
    cos: float
    sin: float
    currents: tuple[float, float, float]
    seen: tuple[float, float, float]


class SwingEquations:
    """Shaft and up to three loops, written out: at this size arrays cost far more than the arithmetic.

    Loop 0 carries all of the source's current, loop 2 is the zero sequence that circulates in a delta, loop 1 what is
    left; loops that a circuit has not stand in the equations with nothing that drives them. States: shaft angle (rad),
    speed (rad/s), and the currents (A) of those loops that neither a regulated current fixes nor follow at once.
    """

    def __init__(self, network: Network, shaft: Shaft, source: Source) -> None:
        windings = network.windings
        motor = windings.motor
        self._p = windings.pole_pairs
        self._shaft = shaft
        self._cogging, self._cogging_order = motor.cogging_torque, motor.cogging_order
        self._columns, self._turn = _turned(network)
        #: Winding currents are basis·x, x being the currents of loops 0, 1, 2 (zero where the circuit has not one).
        self.basis: FloatArray = network.basis @ self._turn
        mean, cos, sin = (
            self.basis.T @ part @ self.basis
            for part in (windings.inductance_mean, windings.inductance_cos, windings.inductance_sin)
        )
        missing = np.diag([0.0 if column else 1.0 for column in self._columns])
        mean += missing
        self._m00, self._m01, self._m11 = (
            (float(mean[at]), float(cos[at]), float(sin[at])) for at in ((0, 0), (0, 1), (1, 1))
        )
        self._m22 = float(mean[2, 2])
        damping = self._turn.T @ network.damping @ self._turn + missing
        self._damping: FloatArray = damping
        self._k: list[list[float]] = damping.tolist()
        self._drive = float((self._turn.T @ network.drive)[0])
        # Magnets in the loops: e = ω·Re[Σ c_h·exp(j·h·θ)].
        self._magnets = []
        for order, amplitude, phase in windings.harmonics:
            a, b, c = (self.basis.T @ windings.emf_phasors(order, amplitude, phase)).tolist()
            self._magnets.append((order, a.real, a.imag, b.real, b.imag, c.real, c.imag))
        self._regulated = isinstance(source, CurrentSource)
        self._current = self._voltage = self._voltage_slope = 0.0
        if isinstance(source, VoltageSource):
            self._voltage, self._voltage_slope = source.voltage, source.slope
        else:
            self._current = source.current / self._drive
        self._has_1 = self._columns[1]
        self._follows = not self._columns[2] or self._k[2][2] > _FAST * self._m22

    def begin(self, angle: float, speed: float, loops: FloatArray) -> list[float]:
        """Return the state of shaft angle (rad), speed (rad/s) and the network's loop currents (A)."""
        x: list[float] = (self._turn.T @ loops).tolist()
        return [angle, speed, *x[self._regulated : 1], *x[1 : 1 + self._has_1], *x[2 : 3 - self._follows]]

    def currents(self, states: FloatArray) -> FloatArray:
        """Return the currents of the three loops (A, shape (3, n)) in states (shape (states, n))."""
        return np.array([self._field(state).currents for state in states.T.tolist()]).reshape(-1, 3).T

    def current_slopes(self, derivatives: FloatArray) -> FloatArray:
        """Return the derivatives of the three loops' currents (A/s, shape (3, n)) out of the states' derivatives."""
        still = np.zeros_like(derivatives[:1])
        rest = derivatives[2:]
        first, rest = (still, rest) if self._regulated else (rest[:1], rest[1:])
        second, rest = (rest[:1], rest[1:]) if self._has_1 else (still, rest)
        return np.vstack([first, second, still if self._follows else rest])

    def evaluate(self, passed: float, state: list[float], direction: int) -> tuple[list[float], float]:
        """Return the states' derivatives `passed` s after the start, with friction against `direction`.

        With them comes what the supply watches: the voltage (V) that a regulated current needs, or the current (A)
        that a voltage drives.
        """
        field, shaft, speed = self._field(state), self._shaft, state[1]
        friction = direction * shaft.coulomb_friction + shaft.viscous_friction * speed
        derivatives = [speed, (field.torque - friction) / shaft.inertia]
        electrical = self._p * speed
        x0, x1, x2 = field.currents
        seen0, seen1, seen2 = field.seen
        (k00, k01, k02), (_, k11, k12), (_, _, k22) = self._k
        left0 = k00 * x0 + k01 * x1 + k02 * x2 + electrical * seen0
        m01 = slope1 = 0.0
        if self._has_1:
            left1 = k01 * x0 + k11 * x1 + k12 * x2 + electrical * seen1
            m01 = self._m01[0] + self._m01[1] * field.cos + self._m01[2] * field.sin
            m11 = self._m11[0] + self._m11[1] * field.cos + self._m11[2] * field.sin
            slope1 = -left1 / m11
        if self._regulated:
            watched = (left0 + m01 * slope1) / self._drive
        else:
            left0 -= self._drive * (self._voltage + self._voltage_slope * passed)
            m00 = self._m00[0] + self._m00[1] * field.cos + self._m00[2] * field.sin
            if self._has_1:
                slope0 = -(left0 + m01 * slope1) / (m00 - m01 * m01 / m11)
                slope1 -= m01 * slope0 / m11
            else:
                slope0 = -left0 / m00
            derivatives.append(slope0)
            watched = self._drive * x0
        if self._has_1:
            derivatives.append(slope1)
        if not self._follows:
            derivatives.append(-(k02 * x0 + k12 * x1 + k22 * x2 + electrical * seen2) / self._m22)
        return derivatives, watched

    def push(self, state: list[float]) -> float:
        """Return the torque (N·m) on the shaft without friction."""
        return self._field(state).torque

    def lasting_push(self, state: list[float]) -> float:
        """Return the torque (N·m) without friction on a shaft that stands there, once the free currents have settled."""
        damping = self._damping
        if self._regulated:
            free = np.linalg.solve(damping[1:, 1:], -damping[1:, 0] * self._current)
            currents = np.array([self._current, *free])
        else:
            currents = np.linalg.solve(damping, np.array([self._drive * self._voltage, 0.0, 0.0]))
        x: list[float] = currents.tolist()
        standing = [state[0], 0.0, *x[self._regulated : 1], *x[1 : 1 + self._has_1], *x[2 : 3 - self._follows]]
        return self._field(standing).torque

    def _field(self, state: list[float]) -> _Field:
        theta = state[0] * self._p
        cos, sin = math.cos(2.0 * theta), math.sin(2.0 * theta)
        e0 = e1 = e2 = 0.0
        for order, real0, imaginary0, real1, imaginary1, real2, imaginary2 in self._magnets:
            along, across = math.cos(order * theta), math.sin(order * theta)
            e0 += along * real0 - across * imaginary0
            e1 += along * real1 - across * imaginary1
            e2 += along * real2 - across * imaginary2
        at = 2
        if self._regulated:
            x0 = self._current
        else:
            x0, at = state[at], at + 1
        x1 = 0.0
        w0 = 2.0 * (self._m00[2] * cos - self._m00[1] * sin) * x0
        w1 = 0.0
        if self._has_1:
            x1, at = state[at], at + 1
            g01 = 2.0 * (self._m01[2] * cos - self._m01[1] * sin)
            w0 += g01 * x1
            w1 = g01 * x0 + 2.0 * (self._m11[2] * cos - self._m11[1] * sin) * x1
        if self._follows:
            k2 = self._k[2]
            x2 = -(k2[0] * x0 + k2[1] * x1 + self._p * state[1] * e2) / k2[2]
        else:
            x2 = state[at]
        torque = self._p * (x0 * (0.5 * w0 + e0) + x1 * (0.5 * w1 + e1) + x2 * e2) + self._shaft.torque
        torque -= self._cogging * math.sin(self._cogging_order * state[0])
        return _Field(torque, cos, sin, (x0, x1, x2), (w0 + e0, w1 + e1, e2))


def _turned(network: Network) -> tuple[tuple[bool, bool, bool], FloatArray]:
    """Return which of the three loops the network has, and their directions in its own loops as columns."""
    columns = np.zeros((network.loops, 3))
    columns[:, 0] = network.drive / np.linalg.norm(network.drive)
    # No source drives a current that only circulates.
    zero = network.basis.T @ np.full(3, 1.0 / np.sqrt(3.0))
    circulates = bool(zero @ zero > 1.0 - 1e-9)
    if circulates:
        columns[:, 2] = zero
    others = null_space(columns.T, rcond=1e-9)
    if others.shape[1]:
        columns[:, 1] = others[:, 0]
    return (True, bool(others.shape[1]), circulates), columns
