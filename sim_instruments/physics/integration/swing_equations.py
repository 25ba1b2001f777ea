"""Equations of a free rotor under current: shaft and circuit together, while the shaft turns one way."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.source import CurrentSource, Source, VoltageSource
from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.motor.bearing import PLAIN, Bearing

#: A circulating current that decays faster than this (1/s) follows any swing of a rotor at once.
_FAST = 6.0e3


@dataclass(frozen=True)
class Shaft:
    """The rotating parts: `inertia` kg·m², `coulomb_friction` N·m, `viscous_friction` N·m·s/rad, and a constant `torque` N·m.

    `bearing` is what drags beside those two.
    """

    inertia: float
    coulomb_friction: float
    viscous_friction: float
    torque: float = 0.0
    bearing: Bearing = PLAIN

    @property
    def static_friction(self) -> float:
        """The torque (N·m) up to which a shaft that stands goes on standing."""
        return self.coulomb_friction + self.bearing.stribeck_torque

    def friction(self, speed: float) -> float:
        """Return the friction (N·m) against a speed (rad/s), with the speed's sign."""
        coulomb = math.copysign(self.coulomb_friction, speed) if speed else 0.0
        return coulomb + self.viscous_friction * speed + self.bearing.drag(speed)

    def frictions(self, speeds: FloatArray) -> FloatArray:
        """Return the friction (N·m) against speeds (rad/s) of any shape, with the speeds' signs."""
        friction: FloatArray = self.coulomb_friction * np.sign(speeds) + self.viscous_friction * speeds
        return friction if self.bearing.plain else friction + self.bearing.drags(speeds)


#: From seconds since the start, a state and the way of the friction: the states' derivatives, what the supply watches
#: (the voltage (V) that a regulated current needs, the current (A) that a voltage drives), and the torque (N·m) on the
#: shaft without friction.
Law = Callable[[float, list[float], int], tuple[list[float], float, float]]


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
        self._cogging = motor.cogging_torque, motor.cogging_order, motor.cogging_phase
        self._columns, self._turn = network.principal_loops
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
        for order, (a, b, c) in zip(windings.emf_orders, (self.basis.T @ windings.emf_phasors).T.tolist(), strict=True):
            self._magnets.append((order, a.real, a.imag, b.real, b.imag, c.real, c.imag))
        self._regulated = isinstance(source, CurrentSource)
        self._current = self._voltage = self._voltage_slope = 0.0
        if isinstance(source, VoltageSource):
            self._voltage, self._voltage_slope = source.voltage, source.slope
        else:
            self._current = source.current / self._drive
        #: Whether the source's voltage runs, so that the law depends on time itself.
        self.timed = self._voltage_slope != 0.0
        self._has_1 = self._columns[1]
        self._follows = not self._columns[2] or self._k[2][2] > _FAST * self._m22
        self.law: Law = self._written_out()

    def begin(self, angle: float, speed: float, loops: FloatArray) -> list[float]:
        """Return the state of shaft angle (rad), speed (rad/s) and the network's loop currents (A)."""
        x: list[float] = (self._turn.T @ loops).tolist()
        return [angle, speed, *x[self._regulated : 1], *x[1 : 1 + self._has_1], *x[2 : 3 - self._follows]]

    def currents(self, states: FloatArray) -> FloatArray:
        """Return the currents of the three loops (A, shape (3, n)) in states (shape (states, n))."""
        rest = states[2:]
        still = np.zeros_like(states[0])
        first, rest = (still + self._current, rest) if self._regulated else (rest[0], rest[1:])
        second, rest = (rest[0], rest[1:]) if self._has_1 else (still, rest)
        if not self._follows:
            third = rest[0]
        elif self._columns[2]:
            theta, emf = states[0] * self._p, still
            for order, *_, real, imaginary in self._magnets:
                emf = emf + np.cos(order * theta) * real - np.sin(order * theta) * imaginary
            k20, k21, k22 = self._k[2]
            third = -(k20 * first + k21 * second + self._p * states[1] * emf) / k22
        else:
            third = still
        return np.array([first, second, third])

    def current_slopes(self, derivatives: FloatArray) -> FloatArray:
        """Return the derivatives of the three loops' currents (A/s, shape (3, n)) out of the states' derivatives."""
        still = np.zeros_like(derivatives[:1])
        rest = derivatives[2:]
        first, rest = (still, rest) if self._regulated else (rest[:1], rest[1:])
        second, rest = (rest[:1], rest[1:]) if self._has_1 else (still, rest)
        return np.vstack([first, second, still if self._follows else rest])

    def push(self, state: list[float]) -> float:
        """Return the torque (N·m) on the shaft without friction."""
        return self.law(0.0, state, 0)[2]

    def lasting_push(self, state: list[float]) -> float:
        """Return the torque (N·m) without friction on a shaft that stands there, once the free currents have settled."""
        return self.push([state[0], 0.0, *self._settled])

    @cached_property
    def _settled(self) -> list[float]:
        """The currents (A) of a state, once they have settled round a shaft that stands."""
        damping = self._damping
        if self._regulated:
            free = np.linalg.solve(damping[1:, 1:], -damping[1:, 0] * self._current)
            currents = np.array([self._current, *free])
        else:
            currents = np.linalg.solve(damping, np.array([self._drive * self._voltage, 0.0, 0.0]))
        x: list[float] = currents.tolist()
        return [*x[self._regulated : 1], *x[1 : 1 + self._has_1], *x[2 : 3 - self._follows]]

    def _written_out(self) -> Law:
        """Return the law with everything that does not change in its own variables, which is what makes it quick."""
        cos, sin, p = math.cos, math.sin, self._p
        inertia, coulomb, viscous = self._shaft.inertia, self._shaft.coulomb_friction, self._shaft.viscous_friction
        outside, (cogging, cogging_order, cogging_phase) = self._shaft.torque, self._cogging
        (m00, m00_cos, m00_sin), (m01, m01_cos, m01_sin), (m11, m11_cos, m11_sin) = self._m00, self._m01, self._m11
        m22, drive, voltage, voltage_slope = self._m22, self._drive, self._voltage, self._voltage_slope
        (k00, k01, k02), (_, k11, k12), (k20, k21, k22) = self._k
        regulated, current, has_1, follows = self._regulated, self._current, self._has_1, self._follows
        magnets, has_2 = tuple(self._magnets), self._columns[2]
        at_1 = 2 if regulated else 3
        at_2 = at_1 + 1 if has_1 else at_1

        def law(passed: float, state: list[float], direction: int) -> tuple[list[float], float, float]:
            angle, speed = state[0], state[1]
            theta, electrical = angle * p, p * speed
            cos2, sin2 = cos(2.0 * theta), sin(2.0 * theta)
            e0 = e1 = e2 = 0.0
            for order, real0, imaginary0, real1, imaginary1, real2, imaginary2 in magnets:
                along, across = cos(order * theta), sin(order * theta)
                e0 += along * real0 - across * imaginary0
                if has_1:
                    e1 += along * real1 - across * imaginary1
                if has_2:
                    e2 += along * real2 - across * imaginary2
            x0 = current if regulated else state[2]
            x1 = x2 = w1 = slope1 = coupling = 0.0
            w0 = 2.0 * (m00_sin * cos2 - m00_cos * sin2) * x0
            if has_1:
                x1 = state[at_1]
                g01 = 2.0 * (m01_sin * cos2 - m01_cos * sin2)
                w0 += g01 * x1
                w1 = g01 * x0 + 2.0 * (m11_sin * cos2 - m11_cos * sin2) * x1
            if not follows:
                x2 = state[at_2]
            elif has_2:
                x2 = -(k20 * x0 + k21 * x1 + electrical * e2) / k22
            torque = p * (x0 * (0.5 * w0 + e0) + x1 * (0.5 * w1 + e1) + x2 * e2) + outside
            torque -= cogging * sin(cogging_order * angle + cogging_phase)
            derivatives = [speed, (torque - (direction * coulomb + viscous * speed)) / inertia]
            left0 = k00 * x0 + k01 * x1 + k02 * x2 + electrical * (w0 + e0)
            if has_1:
                left1 = k01 * x0 + k11 * x1 + k12 * x2 + electrical * (w1 + e1)
                coupling = m01 + m01_cos * cos2 + m01_sin * sin2
                own1 = m11 + m11_cos * cos2 + m11_sin * sin2
                slope1 = -left1 / own1
            if regulated:
                watched = (left0 + coupling * slope1) / drive
            else:
                left0 -= drive * (voltage + voltage_slope * passed)
                own0 = m00 + m00_cos * cos2 + m00_sin * sin2
                if has_1:
                    slope0 = -(left0 + coupling * slope1) / (own0 - coupling * coupling / own1)
                    slope1 -= coupling * slope0 / own1
                else:
                    slope0 = -left0 / own0
                derivatives.append(slope0)
                watched = drive * x0
            if has_1:
                derivatives.append(slope1)
            if not follows:
                derivatives.append(-(k02 * x0 + k12 * x1 + k22 * x2 + electrical * e2) / m22)
            return derivatives, watched, torque

        return law
