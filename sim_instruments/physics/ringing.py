"""Integration of a swinging rotor through its reversals, step by step in plain numbers.

A rotor that only friction damps turns back hundreds of times before it rests: a general integrator started anew at each
reversal costs milliseconds every time, the arithmetic itself a few hundred microseconds.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, field
from operator import mul
from typing import Literal

import numpy as np
from scipy.integrate import RK45
from scipy.optimize import brentq

from sim_instruments.physics.swing_equations import SwingEquations
from sim_instruments.physics.windings import FloatArray

RingingEnd = Literal["horizon", "standstill", "threshold", "creep", "laboured"]

_RELATIVE = 1e-6
# A creeping rotor's speed is small against nothing but itself: errors of 1e-5 rad/s would stop it.
_ANGLE, _SPEED, _CURRENT = 3e-7, 1e-8, 1e-6
_FIRST_STEP = 1e-5
#: A rotor that has not turned back after so many steps creeps against a stiff circuit, which wants another method.
_LABOURED = 150
# Dormand and Prince 5(4) with Shampine's interpolant, whose tables SciPy holds. The second stage has no part in the result.
_C = [float(c) for c in RK45.C]
_A = [tuple(float(a) for a in row[:stage]) for stage, row in enumerate(RK45.A)]
_B = [float(b) for b in RK45.B]
_E = [float(e) for e in RK45.E]
_P: FloatArray = np.asarray(RK45.P, dtype=np.float64)
_P_COLUMNS = [[float(p) for p in column] for column in _P.T]


@dataclass(frozen=True)
class Rules:
    """What ends a swing: `grip` (N·m) holds a shaft that stands, and one slower than `slow` (rad/s) that still slows
    down; what the supply watches, passing `threshold` upwards (`sense` 1) or downwards (-1), ends it too.
    """

    grip: float
    slow: float
    threshold: float = math.inf
    sense: int = 1


@dataclass
class _Step:
    """From `state` at `start` (s) over `length` (s), with the slopes of all states at each of the method's stages; `after`,
    `slopes` and `watched` hold at its end.
    """

    start: float
    length: float
    state: list[float]
    stages: list[list[float]]
    after: list[float]
    slopes: list[float]
    watched: float

    def course(self, number: int) -> Callable[[float], float]:
        """Return one state over the share of the step that has passed."""
        begin = self.state[number]
        column = [stage[number] for stage in self.stages]
        first, second, third, fourth = (self.length * sum(map(mul, p, column)) for p in _P_COLUMNS)
        return lambda share: begin + share * (first + share * (second + share * (third + share * fourth)))

    def at(self, share: float) -> list[float]:
        """Return the state a share of the step on."""
        return [self.course(number)(share) for number in range(len(self.state))]


@dataclass
class _Record:
    steps: list[_Step] = field(default_factory=list)
    reversals: list[float] = field(default_factory=list)


class Ringing:
    """States over time (s, from the swing's start), its `end`, why it ended there, and the `reversals` on the way.

    `direction` is that of the friction at the end.
    """

    def __init__(
        self, equations: SwingEquations, state: list[float], direction: int, horizon: float, rules: Rules
    ) -> None:
        self._equations = equations
        self._rules = rules
        self.direction = direction
        record = _Record()
        self.end, self.ending = self._integrated(state, horizon, record)
        self.reversals = tuple(record.reversals)
        self._starts = np.array([step.start for step in record.steps])
        self._lengths = np.array([step.length for step in record.steps])
        self._states = np.array([step.state for step in record.steps])
        self._weights = np.einsum("kis,ij->jks", np.array([step.stages for step in record.steps]), _P)

    def states(self, passed: FloatArray) -> FloatArray:
        """Return the states (shape (states, n))."""
        at = np.clip(passed, 0.0, self.end)
        index = np.maximum(np.searchsorted(self._starts, at, side="right") - 1, 0)
        length = self._lengths[index][:, np.newaxis]
        share = (at - self._starts[index])[:, np.newaxis] / length
        first, second, third, fourth = self._weights[:, index]
        rise = share * (first + share * (second + share * (third + share * fourth)))
        result: FloatArray = (self._states[index] + length * rise).T
        return result

    def _integrated(self, state: list[float], horizon: float, record: _Record) -> tuple[float, RingingEnd]:
        equations, rules, direction, labour = self._equations, self._rules, self.direction, 0
        passed, length, fastest = 0.0, min(horizon, _FIRST_STEP), abs(state[1])
        slopes, watched = equations.law(passed, state, direction)[:2]
        while passed < horizon:
            last = length >= horizon - passed
            step, error = self._tried(
                passed, horizon - passed if last else length, state, slopes, direction, _SPEED + _RELATIVE * fastest
            )
            if error > 1.0:
                length = step.length * max(0.2, 0.9 * error**-0.2)
                continue
            record.steps.append(step)
            turning = _reversal(step, direction)
            crossing = self._crossing(step, watched, direction)
            if crossing is not None and crossing <= turning:
                return passed + crossing * step.length, "threshold"
            length = step.length * (min(5.0, 0.9 * error**-0.2) if error > 0.0 else 5.0)
            if turning <= 1.0:
                passed += turning * step.length
                state = step.at(turning)
                state[1] = 0.0
                push = equations.push(state)
                if abs(push) <= rules.grip:
                    return passed, "standstill"
                record.reversals.append(passed)
                direction = self.direction = 1 if push > 0.0 else -1
                labour = 0
                slopes, watched = equations.law(passed, state, direction)[:2]
                continue
            passed = horizon if last else passed + step.length
            state, slopes, watched = step.after, step.slopes, step.watched
            fastest = max(fastest, abs(state[1]))
            # Against the braking of joined terminals a rotor creeps to its rest without end: static friction ends that.
            if (
                abs(state[1]) <= rules.slow
                and slopes[1] * state[1] < 0.0
                and abs(equations.lasting_push(state)) <= rules.grip
            ):
                return passed, "creep"
            labour += 1
            if labour > _LABOURED:
                return passed, "laboured"
        return horizon, "horizon"

    def _tried(
        self, start: float, length: float, state: list[float], slopes: list[float], direction: int, speed: float
    ) -> tuple[_Step, float]:
        """Return a step and its error relative to what is allowed; `speed` (rad/s) is the absolute part of that."""
        law, first = self._equations.law, slopes
        (a20,), (a30, a31), (a40, a41, a42), (a50, a51, a52, a53), (a60, a61, a62, a63, a64) = _A[1:]
        _, c2, c3, c4, c5, c6 = _C
        point = [y + length * (a20 * k1) for y, k1 in zip(state, first, strict=True)]
        second = law(start + c2 * length, point, direction)[0]
        point = [y + length * (a30 * k1 + a31 * k2) for y, k1, k2 in zip(state, first, second, strict=True)]
        third = law(start + c3 * length, point, direction)[0]
        point = [
            y + length * (a40 * k1 + a41 * k2 + a42 * k3)
            for y, k1, k2, k3 in zip(state, first, second, third, strict=True)
        ]
        fourth = law(start + c4 * length, point, direction)[0]
        point = [
            y + length * (a50 * k1 + a51 * k2 + a52 * k3 + a53 * k4)
            for y, k1, k2, k3, k4 in zip(state, first, second, third, fourth, strict=True)
        ]
        fifth = law(start + c5 * length, point, direction)[0]
        point = [
            y + length * (a60 * k1 + a61 * k2 + a62 * k3 + a63 * k4 + a64 * k5)
            for y, k1, k2, k3, k4, k5 in zip(state, first, second, third, fourth, fifth, strict=True)
        ]
        sixth = law(start + c6 * length, point, direction)[0]
        b0, _, b2, b3, b4, b5 = _B
        after = [
            y + length * (b0 * k1 + b2 * k3 + b3 * k4 + b4 * k5 + b5 * k6)
            for y, k1, k3, k4, k5, k6 in zip(state, first, third, fourth, fifth, sixth, strict=True)
        ]
        ended, watched, _ = law(start + length, after, direction)
        e0, _, e2, e3, e4, e5, e6 = _E
        total = 0.0
        for number, (k1, k3, k4, k5, k6, k7) in enumerate(zip(first, third, fourth, fifth, sixth, ended, strict=True)):
            allowance = _ANGLE if not number else speed if number == 1 else _CURRENT
            if number:
                before, new = abs(state[number]), abs(after[number])
                allowance += _RELATIVE * (before if before > new else new)
            total += (length * (e0 * k1 + e2 * k3 + e3 * k4 + e4 * k5 + e5 * k6 + e6 * k7) / allowance) ** 2
        stages = [first, second, third, fourth, fifth, sixth, ended]
        return _Step(start, length, state, stages, after, ended, watched), math.sqrt(total / len(state))

    def _crossing(self, step: _Step, watched: float, direction: int) -> float | None:
        """Return the share of the step after which the threshold is passed, None where it is not."""
        rules, law = self._rules, self._equations.law
        if not rules.sense * (watched - rules.threshold) <= 0.0 < rules.sense * (step.watched - rules.threshold):
            return None
        if watched == rules.threshold:
            return 0.0

        def beyond(share: float) -> float:
            return law(step.start + share * step.length, step.at(share), direction)[1] - rules.threshold

        return float(brentq(beyond, 0.0, 1.0, xtol=1e-12)) if beyond(0.0) * beyond(1.0) < 0.0 else 1.0


def _reversal(step: _Step, direction: int) -> float:
    """Return the share of the step after which the shaft stands, infinite where it goes on turning."""
    if direction * step.after[1] > 0.0:
        return math.inf
    low = 0.0 if direction * step.state[1] > 0.0 else 1e-6
    speed = step.course(1)
    if direction * speed(low) <= 0.0:
        return low
    if direction * speed(1.0) >= 0.0:
        return 1.0
    return float(brentq(speed, low, 1.0, xtol=1e-12))
