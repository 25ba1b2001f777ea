"""The periodic steady state at constant speed, by shooting over one sixth of a period, and its waveforms."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from sim_instruments.six_step.circuit import Observables, Real
from sim_instruments.six_step.drive import SixStepDrive, SixStepError
from sim_instruments.six_step.segment import ConductionSegment
from sim_instruments.six_step.state import Bridge, StateInterval

_STATE_ANGLE = math.pi / 3
_MOST_ITERATIONS = 500
#: Of the no-load speed: beyond it exact arithmetic has too few digits, and no machine lives.
_SPEED_RANGE = (1e-9, 1e6)
#: In states: with a longer time constant the little that a state adds drowns in rounding.
_LONGEST_CONSTANT = 1e8


def next_state(values: Real) -> Real:
    """Winding quantities one state later from those now, shape (3, …): windings renamed, direction reversed."""
    return -values[[1, 2, 0]]


def previous_state(values: Real) -> Real:
    """Winding quantities one state earlier, the inverse of `next_state`."""
    return -values[[2, 0, 1]]


@dataclass(frozen=True)
class SteadyState:
    """Periodic steady state of a drive at constant speed; times in s since a state T1T2 began, any real number.

    Windings are a (leg 1 to 2), b (2 to 3), c (3 to 1) of a delta, or the phases a, b, c of a wye on legs 1, 2, 3;
    currents count positive in those directions, into the motor for lines. Voltages in V, currents in A, speed in
    mechanical rad/s.
    """

    bridge: Bridge
    speed: float
    segments: tuple[ConductionSegment, ...]
    start_currents: Real
    end_currents: Real

    @property
    def drive(self) -> SixStepDrive:
        """The drive that was solved."""
        return self.bridge.drive

    @property
    def state_time(self) -> float:
        """Length of one state of 60° electrical, in s."""
        return _STATE_ANGLE / (self.drive.pole_pairs * self.speed)

    @property
    def period(self) -> float:
        """Electrical period, in s."""
        return 6.0 * self.state_time

    @cached_property
    def averages(self) -> Real:
        """Averages over T1T2 of the quantities of `Observables`, shape (17,)."""
        total = sum(segment.integrals(segment.circuit.observables) for segment in self.segments)
        return np.asarray(total) / self.state_time

    @cached_property
    def product_averages(self) -> Real:
        """Averages over T1T2 of all products of two of the quantities of `Observables`, shape (17, 17)."""
        total = sum(segment.product_integrals(segment.circuit.observables) for segment in self.segments)
        return np.asarray(total) / self.state_time

    @cached_property
    def electromagnetic_torque(self) -> float:
        """Average torque of the currents on the magnets, in N·m."""
        impulse = sum(segment.torque_impulse() for segment in self.segments)
        return impulse / self.state_time

    @property
    def load_torque(self) -> float:
        """Average torque left at the shaft after the bearings, in N·m; negative when the shaft is driven."""
        return self.electromagnetic_torque - self.drive.friction_torque(self.speed)

    @property
    def average_bus_voltage(self) -> float:
        """Average voltage between the bridge's rails, in V."""
        return float(self.averages[Observables.bus_voltage])

    @property
    def average_supply_current(self) -> float:
        """Average current out of the source, in A; negative when energy returns."""
        return float(self.averages[Observables.supply_current])

    @property
    def freewheel_time(self) -> float:
        """Time in s from the start of the state until the leaving leg's current first is zero; the state's if never."""
        time = 0.0
        for segment in self.segments:
            if segment.circuit.conduction.idle is not self.segments[0].circuit.conduction.idle:
                break
            time += segment.duration
        first_is_open = self.segments[0].circuit.conduction.idle.value == "open"
        return 0.0 if first_is_open else time

    def winding_currents(self, times: ArrayLike) -> Real:
        """Currents of the windings a, b, c at `times`, shape (3, len(times))."""
        return self._windings(times, Observables.currents)

    def winding_voltages(self, times: ArrayLike) -> Real:
        """Voltages across the windings a, b, c at `times`, shape (3, len(times))."""
        return self._windings(times, Observables.voltages)

    def emfs(self, times: ArrayLike) -> Real:
        """EMF of the windings a, b, c at `times`, shape (3, len(times))."""
        return self._windings(times, Observables.emfs)

    def line_currents(self, times: ArrayLike) -> Real:
        """Currents from the legs 1, 2, 3 into the motor at `times`, shape (3, len(times))."""
        return self._windings(times, Observables.line_currents)

    def leg_voltages(self, times: ArrayLike) -> Real:
        """Voltages of the motor's terminals 1, 2, 3 over the negative rail at `times`, shape (3, len(times))."""
        states, local = self._locate(times)
        values = self._evaluate(local)
        legs, bus = values[Observables.leg_voltages], values[Observables.bus_voltage]
        result = np.empty_like(legs)
        for state in range(6):
            here = states == state
            turned = np.roll(legs[:, here], -state, axis=0)
            result[:, here] = turned if state % 2 == 0 else bus[here] - turned
        return result

    def bus_voltage(self, times: ArrayLike) -> Real:
        """Voltage between the bridge's rails at `times`, shape (len(times),)."""
        return np.asarray(self._evaluate(self._locate(times)[1])[Observables.bus_voltage])

    def supply_current(self, times: ArrayLike) -> Real:
        """Give the current out of the source at `times`, shape (len(times),)."""
        return np.asarray(self._evaluate(self._locate(times)[1])[Observables.supply_current])

    def torque(self, times: ArrayLike) -> Real:
        """Torque of the currents on the magnets at `times`, in N·m, shape (len(times),)."""
        values = self._evaluate(self._locate(times)[1])
        return np.asarray((values[Observables.currents] * values[Observables.emfs]).sum(axis=0) / self.speed)

    def _windings(self, times: ArrayLike, rows: slice) -> Real:
        states, local = self._locate(times)
        values = self._evaluate(local)[rows]
        result = np.empty_like(values)
        for state in range(6):
            here = states == state
            sign = 1.0 if state % 2 == 0 else -1.0
            result[:, here] = sign * np.roll(values[:, here], -state, axis=0)
        return result

    def _locate(self, times: ArrayLike) -> tuple[np.ndarray[tuple[int], np.dtype[np.int64]], Real]:
        """Find the number of the state, 0 to 5 from T1T2, and the time within it."""
        t = np.atleast_1d(np.asarray(times, dtype=np.float64))
        number = np.floor(t / self.state_time)
        local = np.clip(t - number * self.state_time, 0.0, self.state_time)
        return (number.astype(np.int64) % 6).reshape(-1), local.reshape(-1)

    def _evaluate(self, local: Real) -> Real:
        """Evaluate the quantities of `Observables` at times within T1T2, shape (17, len(local))."""
        starts = np.array([segment.start for segment in self.segments])
        index = np.clip(np.searchsorted(starts, local, side="right") - 1, 0, len(starts) - 1)
        result = np.empty((17, len(local)))
        for number, segment in enumerate(self.segments):
            here = index == number
            if here.any():
                result[:, here] = segment.values(segment.circuit.observables, local[here] - segment.start)
        return result


def steady_state(bridge: Bridge, speed: float, guess: Real | None = None) -> SteadyState:
    """Solve the periodic steady state at a mechanical `speed` in rad/s.

    `guess` is an estimate of the winding currents at the start of T1T2; the result does not depend on it, for a
    passive circuit with diodes contracts to one periodic solution. Newton on the map of one state, with the map
    itself (a contraction) as the step where Newton does not help.
    Raises SixStepError for a speed that is not above 0 or beyond all sense, or when the iteration does not settle.
    """
    if not (math.isfinite(speed) and speed > 0):
        raise SixStepError(
            f"speed is {speed:g} rad/s: a finite speed above 0 is needed (a drive at rest has no period)"
        )
    lowest, highest = _SPEED_RANGE[0] * bridge.no_load_speed, _SPEED_RANGE[1] * bridge.no_load_speed
    if not lowest <= speed <= highest:
        raise SixStepError(
            f"speed is {speed * 30 / math.pi:g} rpm: {lowest * 30 / math.pi:.3g} to {highest * 30 / math.pi:.3g} rpm can be "
            f"solved for this drive, whose EMF equals its source at {bridge.no_load_speed * 30 / math.pi:.5g} rpm"
        )
    duration = _STATE_ANGLE / (bridge.drive.pole_pairs * speed)
    drive = bridge.drive
    constant = (drive.self_inductance - drive.mutual_inductance) * bridge.current_scale / drive.source_voltage
    if constant > _LONGEST_CONSTANT * duration:
        raise SixStepError(
            f"the resistances are too small to be distinguished from zero at {speed * 30 / math.pi:g} rpm: an electrical time "
            f"constant of {constant:.3g} s is {constant / duration:.1g} states, up to {_LONGEST_CONSTANT:g} are allowed"
        )
    scale = bridge.current_scale * (1.0 + speed / bridge.no_load_speed)

    def passage_from(currents: Real) -> tuple[StateInterval, Real]:
        passage = bridge.run(currents, speed=speed, angle=0.0, duration=duration)
        return passage, previous_state(passage.end_currents) - currents

    def size(residual: Real) -> float:
        return float(np.sqrt(residual @ bridge.inductance @ residual))

    start = np.zeros(3) if guess is None else guess
    passage, residual = passage_from(start)
    for _ in range(_MOST_ITERATIONS):
        step = np.linalg.solve(np.eye(3) - previous_state(passage.transition), residual)
        candidate = start + step
        settled = float(np.abs(step).max()) <= 1e-9 * scale
        new_passage, new_residual = passage_from(candidate)
        if settled or size(new_residual) <= 1e-15 * size(np.full(3, scale)):
            return SteadyState(bridge, speed, new_passage.segments, candidate, new_passage.end_currents)
        if size(new_residual) > 0.5 * size(residual):
            plain = start + residual
            plain_passage, plain_residual = passage_from(plain)
            if size(plain_residual) < size(new_residual):
                candidate, new_passage, new_residual = plain, plain_passage, plain_residual
        start, passage, residual = candidate, new_passage, new_residual
    raise SixStepError(
        f"no periodic steady state found at {speed:g} rad/s after {_MOST_ITERATIONS} iterations "
        f"(residual {size(residual):.3g})"
    )
