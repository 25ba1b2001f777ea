"""Currents and voltages of a motor that a six-step drive commutates."""

import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from sim_instruments.physics.circuits.network import Network
from sim_instruments.physics.circuits.source import VoltageSource
from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.motion.motion import Motion
from sim_instruments.six_step.balance import losses
from sim_instruments.six_step.circuit import Observables
from sim_instruments.six_step.steady_state import SteadyState
from sim_instruments.world.sources.six_step_stage import STATE_ANGLE, SixStepStage

Quantity = Callable[[SteadyState, FloatArray], FloatArray]
Times = slice | NDArray[np.bool_]

_BUS = [Observables.bus_voltage, Observables.supply_current]
#: Speeds between which waveforms are interpolated while the speed changes, of the no-load speed.
_SPACING = 1.0 / 48.0
#: Times worked on at once, which bounds the memory.
_CHUNK = 1 << 15
_PIECES = 16


class Commutated:
    """The exact periodic steady state at the shaft's speed, in phase with its angle.

    With `uniform` the speed is `speed` throughout (a ripple of the shaft's speed is not seen in the waveforms).
    Otherwise, an approximation, they pass through the steady states of the present speed, interpolated between a grid
    of speeds on which `speed` lies. `stage` is that of the winding's temperature; leads are part of the drive's figures.
    """

    def __init__(
        self,
        network: Network,
        motion: Motion,
        stage: SixStepStage,
        speed: float,
        *,
        source: VoltageSource,
        uniform: bool = True,
    ) -> None:
        self.network = network
        self.motion = motion
        self._stage = stage
        self._speed = speed
        self._uniform = uniform
        self._source = source

    def winding_currents(self, times: FloatArray) -> FloatArray:
        """Return the winding currents (A, shape (3, n))."""
        return self._waveform(times, SteadyState.winding_currents)

    def drops(self, times: FloatArray) -> FloatArray:
        """Return the voltage drops (V, shape (3, n)) along the windings."""
        return self._waveform(times, SteadyState.winding_voltages)

    def source_voltage(self, times: FloatArray) -> FloatArray:
        """Return the output voltage (V) of a supply that is no part of this circuit: its terminals are open."""
        return self._source.at(times)

    def torque(self, times: FloatArray) -> FloatArray:
        """Return the currents' torque (N·m, shape (n,)), its mean over a state at the present speed."""
        result = np.empty(len(times))
        for here, share, steady in self._mixture(times):
            result[here] = share[0] * steady[0].electromagnetic_torque + share[1] * steady[1].electromagnetic_torque
        return result

    def copper_loss(self, times: FloatArray) -> FloatArray:
        """Return the windings' copper loss (W, shape (n,)), its mean over a state at the present speed."""
        result = np.empty(len(times))
        for here, share, pair in self._mixture(times):
            result[here] = share[0] * losses(pair[0]).copper + share[1] * losses(pair[1]).copper
        return result

    def bus(self, times: FloatArray) -> FloatArray:
        """Return bus voltage (V) and current out of the source (A), shape (2, n)."""
        return self._waveform(times, _bus, 2)

    def bus_integrals(self, start: float, end: float) -> FloatArray:
        """Return bus voltage and source current integrated over a time (V·s, A·s); exact at uniform speed."""
        if self._uniform:
            steady = self._stage.steady(self._speed)
            first, last = (float(angle) for angle in self._angles(np.array([start, end])))
            # The angle and not the clock counts, so a ripple of the speed stretches time.
            passed = (last - first) / (steady.drive.pole_pairs * self._speed)
            area = _accumulated(steady, last) - _accumulated(steady, first)
            return np.asarray(area * ((end - start) / passed))
        points, weights = np.polynomial.legendre.leggauss(8)
        edges = np.linspace(start, end, _PIECES + 1)
        half = 0.5 * (end - start) / _PIECES
        times = (0.5 * (edges[1:] + edges[:-1])[:, np.newaxis] + half * points).ravel()
        means = np.empty((2, len(times)))
        for here, share, steady_pair in self._mixture(times):
            low, high = (steady.averages[_BUS][:, np.newaxis] for steady in steady_pair)
            means[:, here] = share[0] * low + share[1] * high
        return means @ np.tile(half * weights, _PIECES)

    def _angles(self, times: FloatArray) -> FloatArray:
        stage = self._stage
        return self.motion.angle(times) * stage.drive.pole_pairs + stage.state_angle(0.0)

    def _waveform(self, times: FloatArray, quantity: Quantity, rows: int = 3) -> FloatArray:
        result = np.empty((rows, len(times)))
        turn = 2.0 * math.pi
        for begin in range(0, len(times), _CHUNK):
            chunk = slice(begin, begin + _CHUNK)
            at = times[chunk]
            angles = np.mod(self._angles(at), turn)
            part = np.empty((rows, len(at)))
            for here, share, pair in self._mixture(at):
                part[:, here] = sum(
                    weight * quantity(steady, angles[here] * (steady.period / turn))
                    for weight, steady in zip(share, pair, strict=True)
                    if np.any(weight)
                )
            result[:, chunk] = part
        return result

    def _mixture(
        self, times: FloatArray
    ) -> Iterator[tuple[Times, tuple[FloatArray, FloatArray], tuple[SteadyState, SteadyState]]]:
        """Give which times lie between which two steady states, and the share of each."""
        stage = self._stage
        if self._uniform:
            steady = stage.steady(self._speed)
            yield slice(None), (np.ones(len(times)), np.zeros(len(times))), (steady, steady)
            return
        spacing = _SPACING * stage.bridge.no_load_speed
        place = (np.maximum(self.motion.speed(times), stage.slowest) - self._speed) / spacing
        below = np.floor(place)
        for number in np.unique(below):
            here = below == number
            low, high = (max(self._speed + k * spacing, stage.slowest) for k in (number, number + 1.0))
            share = place[here] - number
            yield here, (1.0 - share, share), (stage.steady(low), stage.steady(high))


def _bus(steady: SteadyState, times: FloatArray) -> FloatArray:
    return np.array([steady.bus_voltage(times), steady.supply_current(times)])


def _accumulated(steady: SteadyState, angle: float) -> FloatArray:
    """Return the integrals of bus voltage and source current from angle 0 of T1T2 to an angle (rad)."""
    states = math.floor(angle / STATE_ANGLE)
    left = (angle / STATE_ANGLE - states) * steady.state_time
    total: FloatArray = states * steady.state_time * steady.averages[_BUS]
    for segment in steady.segments:
        length = min(segment.duration, left - segment.start)
        if length > 0.0:
            total = total + replace(segment, duration=length).integrals(segment.circuit.observables)[_BUS]
    return total
