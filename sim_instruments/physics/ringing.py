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
# Dormand and Prince 5(4) with Shampine's interpolant, whose tables SciPy holds.
_C = [float(c) for c in RK45.C]
_A = [[float(a) for a in row[:stage]] for stage, row in enumerate(RK45.A)]
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
    """From `state` at `start` (s) over `length` (s), with the slopes of each state at the method's stages; `after`,
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
        first, second, third, fourth = (self.length * sum(map(mul, p, self.stages[number])) for p in _P_COLUMNS)
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
        self._weights = np.einsum("ksi,ij->jks", np.array([step.stages for step in record.steps]), _P)

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
        slopes, watched = equations.evaluate(passed, state, direction)
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
                slopes, watched = equations.evaluate(passed, state, direction)
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
        evaluate = self._equations.evaluate
        stages = [[slope] for slope in slopes]
        for c, row in zip(_C[1:], _A[1:], strict=True):
            # Each row is as long as there are stages so far.
            point = [value + length * sum(map(mul, row, column)) for value, column in zip(state, stages, strict=True)]
            for column, slope in zip(stages, evaluate(start + c * length, point, direction)[0], strict=True):
                column.append(slope)
        after = [value + length * sum(map(mul, _B, column)) for value, column in zip(state, stages, strict=True)]
        ended, watched = evaluate(start + length, after, direction)
        total = 0.0
        for number, column in enumerate(stages):
            column.append(ended[number])
            allowance = (_ANGLE, speed, _CURRENT)[min(number, 2)]
            if number:
                allowance += _RELATIVE * max(abs(state[number]), abs(after[number]))
            total += (length * sum(map(mul, _E, column)) / allowance) ** 2
        return _Step(start, length, state, stages, after, ended, watched), math.sqrt(total / len(state))

    def _crossing(self, step: _Step, watched: float, direction: int) -> float | None:
        """Return the share of the step after which the threshold is passed, None where it is not."""
        rules, evaluate = self._rules, self._equations.evaluate
        if not rules.sense * (watched - rules.threshold) <= 0.0 < rules.sense * (step.watched - rules.threshold):
            return None
        if watched == rules.threshold:
            return 0.0

        def beyond(share: float) -> float:
            return evaluate(step.start + share * step.length, step.at(share), direction)[1] - rules.threshold

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
