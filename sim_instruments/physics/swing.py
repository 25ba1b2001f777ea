"""A free rotor under current, from one standstill to the next: the one law of the bench that needs integrating."""

import math
import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.integrate import solve_ivp
from scipy.linalg import null_space

from sim_instruments.physics.network import Network
from sim_instruments.physics.small import solve_small
from sim_instruments.physics.source import Source, VoltageSource
from sim_instruments.physics.windings import FloatArray

Ending = Literal["horizon", "standstill", "current", "voltage"]


@dataclass(frozen=True)
class Shaft:
    """What turns: `inertia` kg·m², `coulomb_friction` N·m, `viscous_friction` N·m·s/rad, and a constant `torque` N·m."""

    inertia: float
    coulomb_friction: float
    viscous_friction: float
    torque: float = 0.0


@dataclass(frozen=True)
class Thresholds:
    """What ends the swing early: the source's current passing `current` (A) in `current_direction`, or the voltage of a
    current source rising through `voltage` (V).
    """

    current: float = math.inf
    current_direction: int = 1
    voltage: float = math.inf


class Swing:
    """Solution of shaft and circuit together while the shaft turns one way.

    States: shaft angle, speed, and the currents that the source leaves free. Friction keeps the sign of `direction`.
    """

    #: SciPy's LSODA takes one integration at a time in a process.
    _integrator = threading.Lock()

    def __init__(
        self,
        network: Network,
        shaft: Shaft,
        source: Source,
        *,
        start: float,
        horizon: float,
        angle: float,
        speed: float,
        loops: FloatArray,
        direction: int,
        thresholds: Thresholds,
    ) -> None:
        self.network = network
        self.source = source
        self._shaft = shaft
        self._start = start
        self._direction = direction
        windings = network.windings
        basis = network.basis
        self._p = windings.pole_pairs
        self._basis = basis
        self._m0, self._mc, self._ms = (
            basis.T @ part @ basis
            for part in (windings.inductance_mean, windings.inductance_cos, windings.inductance_sin)
        )
        if isinstance(source, VoltageSource):
            self._reach = np.eye(network.loops)
            self._offset = np.zeros(network.loops)
        else:
            self._reach = null_space(network.drive[np.newaxis, :])
            self._offset = network.drive * (source.current / float(network.drive @ network.drive))
        self._reduced = not isinstance(source, VoltageSource)
        # Magnets in the loops: e = ω·Re[Σ c_h·exp(j·h·θ)], so that a scalar exponential does the work at each step.
        self._magnets = [(h, basis.T @ windings.emf_phasors(h, a, phase)) for h, a, phase in windings.harmonics]
        free = self._reach.T @ (loops - self._offset)
        events = self._events(thresholds)
        with self._integrator:
            solution = solve_ivp(
                self._slopes,
                (0.0, horizon - start),
                np.concatenate([[angle, speed], free]),
                method="LSODA",
                dense_output=True,
                events=[event for _, event in events],
                rtol=1e-6,
                atol=np.concatenate([[1e-7, 1e-5 * max(1.0, abs(speed))], np.full(len(free), 1e-6)]),
                first_step=min(horizon - start, 1e-5),
            )
        if not solution.success or solution.sol is None:
            raise RuntimeError(
                f"the swing of the rotor could not be integrated from {start:.6g} s on: {solution.message}"
            )
        self._dense = solution.sol
        self.end = start + float(solution.t[-1])
        self.ending: Ending = "horizon"
        if solution.status == 1:
            hit = next(k for k, times in enumerate(solution.t_events or ()) if len(times))
            self.ending = events[hit][0]

    # Motion

    def angle(self, times: FloatArray) -> FloatArray:
        """Return the shaft's angle (rad)."""
        result: FloatArray = self._states(times)[0]
        return result

    def speed(self, times: FloatArray) -> FloatArray:
        """Return the shaft's speed (rad/s)."""
        result: FloatArray = self._states(times)[1]
        return result

    def acceleration(self, times: FloatArray) -> FloatArray:
        """Return the shaft's acceleration (rad/s²)."""
        result: FloatArray = self._derivatives(times)[1]
        return result

    # Circuit

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        result: FloatArray = self._basis @ self._loops(self._states(times))
        return result

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) behind the source's resistance."""
        if isinstance(self.source, VoltageSource):
            return self.source.at(times)
        states = self._states(times)
        return np.array(
            [self._needed_voltage(float(t - self._start), state) for t, state in zip(times, states.T, strict=True)]
        )

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        windings = self.network.windings
        states, derivatives = self._states(times), self._derivatives(times)
        angles, speeds = states[0] * self._p, states[1] * self._p
        currents = self._basis @ self._loops(states)
        slopes = self._basis @ (self._reach @ derivatives[2:])
        result: FloatArray = (
            windings.resistance[:, np.newaxis] * currents
            + windings.inductance_times(angles, slopes)
            + speeds * windings.inductance_slope_times(angles, currents)
            + speeds * windings.emf_per_speed(angles)
        )
        return result

    # The equations

    def _states(self, times: FloatArray) -> FloatArray:
        return np.asarray(self._dense(times - self._start), dtype=np.float64)

    def _derivatives(self, times: FloatArray) -> FloatArray:
        states = self._states(times)
        columns = [self._slopes(float(t - self._start), state) for t, state in zip(times, states.T, strict=True)]
        return np.array(columns).T.reshape(states.shape)

    def _loops(self, states: FloatArray) -> FloatArray:
        offset = self._offset[:, np.newaxis] if states.ndim == 2 else self._offset
        result: FloatArray = offset + self._reach @ states[2:]
        return result

    def _parts(self, passed: float, state: FloatArray) -> tuple[FloatArray, FloatArray, float, FloatArray]:
        """Return M, the voltage left for M·x', the torque, and the loop currents."""
        theta, speed = float(state[0]) * self._p, float(state[1]) * self._p
        x = self._loops(state)
        cos, sin = math.cos(2 * theta), math.sin(2 * theta)
        inertance = self._m0 + cos * self._mc + sin * self._ms
        slope_x = (2.0 * cos * self._ms - 2.0 * sin * self._mc) @ x
        magnets = np.zeros(len(x))
        for order, phasors in self._magnets:
            magnets += math.cos(order * theta) * phasors.real - math.sin(order * theta) * phasors.imag
        left = -(self.network.damping @ x) - speed * (slope_x + magnets)
        if isinstance(self.source, VoltageSource):
            left = left + self.network.drive * (self.source.voltage + self.source.slope * passed)
        torque = self._p * float(x @ (0.5 * slope_x + magnets))
        return inertance, left, torque, x

    def _slopes(self, passed: float, state: FloatArray) -> FloatArray:
        inertance, left, torque, _ = self._parts(passed, state)
        motor, shaft = self.network.windings.motor, self._shaft
        torque += shaft.torque - motor.cogging_torque * math.sin(motor.cogging_order * float(state[0]))
        torque -= self._direction * shaft.coulomb_friction + shaft.viscous_friction * float(state[1])
        derivative = np.empty_like(state)
        derivative[0] = state[1]
        derivative[1] = torque / shaft.inertia
        if len(state) > 2:
            if self._reduced:
                reach = self._reach
                derivative[2:] = solve_small(reach.T @ inertance @ reach, reach.T @ left)
            else:
                derivative[2:] = solve_small(inertance, left)
        return derivative

    def _needed_voltage(self, passed: float, state: FloatArray) -> float:
        inertance, left, _, _ = self._parts(passed, state)
        slopes = self._reach @ self._slopes(passed, state)[2:]
        drive = self.network.drive
        return float(drive @ (inertance @ slopes - left)) / float(drive @ drive)

    def _events(self, thresholds: Thresholds) -> "list[tuple[Ending, _Event]]":
        events: list[tuple[Ending, _Event]] = [("standstill", _Event(lambda _, y: self._direction * float(y[1]), -1))]
        if not self._reduced and math.isfinite(thresholds.current):
            drive = self.network.drive
            events.append(
                (
                    "current",
                    _Event(
                        lambda _, y: float(drive @ self._loops(y)) - thresholds.current, thresholds.current_direction
                    ),
                )
            )
        if self._reduced and math.isfinite(thresholds.voltage):
            events.append(("voltage", _Event(lambda t, y: self._needed_voltage(t, y) - thresholds.voltage, 1)))
        return events


class _Event:
    """An event of solve_ivp: it ends the integration where its value passes zero in a direction."""

    def __init__(self, value: Callable[[float, FloatArray], float], direction: int) -> None:
        self._value = value
        self.terminal = True
        self.direction = direction

    def __call__(self, passed: float, state: FloatArray) -> float:
        return self._value(passed, state)
