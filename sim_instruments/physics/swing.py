"""A free rotor under current: the one law of the bench whose motion needs integrating."""

import math
from dataclasses import dataclass
from typing import Literal

import numpy as np

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.source import CurrentSource, Source, VoltageSource
from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.integration.ringing import Ringing, Rules
from sim_instruments.physics.integration.swing_equations import Shaft, SwingEquations
from sim_instruments.physics.mapped.network import MappedNetwork
from sim_instruments.physics.mapped.swing import MappedSwing

__all__ = ["Shaft", "StaticFriction", "Swing", "Thresholds"]

Ending = Literal["horizon", "standstill", "current", "voltage"]


@dataclass(frozen=True)
class Thresholds:
    """The conditions that end the swing early: the source's current passing `current` (A) in `current_direction`, or the voltage
    of a current source rising through `voltage` (V).
    """

    current: float = math.inf
    current_direction: int = 1
    voltage: float = math.inf


@dataclass(frozen=True)
class StaticFriction:
    """Static friction: `torque` (N·m) holds what stands, and what is slower than `slow` (rad/s) and slows down."""

    torque: float
    slow: float


class Swing:
    """Solution of shaft and circuit together, until static friction holds the shaft or a threshold is passed.

    `reversals` are the times (s) at which the shaft turns back on the way.
    """

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
        grip: StaticFriction,
    ) -> None:
        self.network = network
        self.source = source
        self._start = start
        self._p = network.windings.pole_pairs
        self._equations = (
            MappedSwing(network, shaft, source)
            if isinstance(network, MappedNetwork)
            else SwingEquations(network, shaft, source)
        )
        self.reversals: tuple[float, ...] = ()
        self.ending: Ending = "horizon"
        begin = self._equations.begin(angle, speed, loops)
        regulated = isinstance(source, CurrentSource)
        rules = Rules(grip.torque, grip.slow, thresholds.current, thresholds.current_direction)
        if regulated:
            rules = Rules(grip.torque, grip.slow, thresholds.voltage)
        passing: Ending = "voltage" if regulated else "current"
        # An output that trips at once leaves no time at all, and an integrator wants some.
        span = max(horizon - start, 1e-12)
        ringing = Ringing(self._equations, begin, direction, span, rules)
        self._ringing = ringing
        self._asked: FloatArray | None = None
        self._found: FloatArray = np.zeros(0)
        self.reversals = tuple(start + passed for passed in ringing.reversals)
        end = ringing.end
        if ringing.ending == "threshold":
            self.ending = passing
        elif ringing.ending in ("standstill", "creep"):
            self.ending = "standstill"
        self.end = horizon if self.ending == "horizon" else start + end

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
        result: FloatArray = self._derivatives(times)[0][1]
        return result

    # Circuit

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        return self._equations.basis @ self._equations.currents(self._states(times))

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the voltage (V) behind the source's resistance."""
        if isinstance(self.source, VoltageSource):
            return self.source.at(times)
        return self._derivatives(times)[1]

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        windings = self.network.windings
        equations = self._equations
        states, derivatives = self._states(times), self._derivatives(times)[0]
        angles, speeds = states[0] * self._p, states[1] * self._p
        currents = equations.basis @ equations.currents(states)
        slopes = equations.basis @ equations.current_slopes(derivatives)
        return windings.drops(angles, speeds, currents, slopes)

    # Integration

    def _states(self, times: FloatArray) -> FloatArray:
        # Angle, speed and currents are mostly asked for at the same times, one after the other.
        if times is not self._asked:
            self._asked, self._found = times, self._ringing.states(times - self._start)
            self._found.flags.writeable = False
        return self._found

    def _derivatives(self, times: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the states' derivatives (shape (states, n)) and what the supply watches (n,)."""
        states = self._states(times)
        evaluated = [
            self._equations.law(passed, state, 1 if state[1] > 0.0 else -1)
            for passed, state in zip((times - self._start).tolist(), states.T.tolist(), strict=True)
        ]
        slopes = np.array([slope for slope, _, _ in evaluated]).reshape(len(times), len(states)).T
        return slopes, np.array([watched for _, watched, _ in evaluated])
