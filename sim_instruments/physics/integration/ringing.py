"""Integration of a swinging rotor through its reversals, step by step in plain numbers.

A rotor that only friction damps turns back hundreds of times before it rests: a general integrator started anew at each
reversal costs milliseconds every time, the arithmetic itself a few hundred microseconds.
"""

import math
from dataclasses import dataclass, field
from typing import Literal

import numpy as np
from scipy.optimize import brentq

from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.integration import explicit_step, implicit_step
from sim_instruments.physics.integration.explicit_step import DormandPrince, ExplicitStep
from sim_instruments.physics.integration.implicit_step import ImplicitStep, Rosenbrock
from sim_instruments.physics.integration.integration_step import IntegrationStep, Method, StepStart
from sim_instruments.physics.integration.swing_equations import SwingEquations

RingingEnd = Literal["horizon", "standstill", "threshold", "creep"]

_FIRST_STEP = 1e-5
#: After so many hurried explicit steps in a row it is the circuit that they follow, and not the swing.
_LABOURED = 3


@dataclass(frozen=True)
class Rules:
    """The conditions that end a swing: `grip` (N·m) holds a shaft that stands, and one slower than `slow` (rad/s) that still
    decelerates; also the supply's watched quantity passing `threshold` upwards (`sense` 1) or downwards (-1).
    """

    grip: float
    slow: float
    threshold: float = math.inf
    sense: int = 1


@dataclass
class _Record:
    steps: list[IntegrationStep] = field(default_factory=list)
    reversals: list[float] = field(default_factory=list)


class Ringing:
    """States over time (s, from the swing's start), its `end`, why it ended there, and the `reversals` on the way."""

    def __init__(
        self, equations: SwingEquations, state: list[float], direction: int, horizon: float, rules: Rules
    ) -> None:
        self._equations = equations
        self._rules = rules
        record = _Record()
        self.end, self.ending = self._integrated(state, direction, horizon, record)
        self.reversals = tuple(record.reversals)
        self._starts = np.array([step.start for step in record.steps])
        self._lengths = np.array([step.length for step in record.steps])
        self._states = np.array([step.state for step in record.steps])
        # A swing may become an implicit one on the way, and then stays it.
        explicit = [step for step in record.steps if isinstance(step, ExplicitStep)]
        implicit = [step for step in record.steps if isinstance(step, ImplicitStep)]
        parts = [explicit_step.rises(explicit)] if explicit else []
        parts += [implicit_step.rises(implicit)] if implicit else []
        self._rises = np.concatenate(parts, axis=1)

    def states(self, passed: FloatArray) -> FloatArray:
        """Return the states (shape (states, n))."""
        at = np.clip(passed, 0.0, self.end)
        index = np.maximum(np.searchsorted(self._starts, at, side="right") - 1, 0)
        share = ((at - self._starts[index]) / self._lengths[index])[:, np.newaxis]
        first, second, third, fourth = self._rises[:, index]
        rise = share * (first + share * (second + share * (third + share * fourth)))
        result: FloatArray = (self._states[index] + rise).T
        return result

    def _integrated(
        self, state: list[float], direction: int, horizon: float, record: _Record
    ) -> tuple[float, RingingEnd]:
        equations, rules, labour = self._equations, self._rules, 0
        law = equations.law
        method: Method = DormandPrince()
        passed, length, fastest = 0.0, min(horizon, _FIRST_STEP), abs(state[1])
        slopes, watched = law(passed, state, direction)[:2]
        begin = StepStart(passed, state, slopes, direction, fastest)
        while passed < horizon:
            last = length >= horizon - passed
            step, error = method.tried(law, begin, horizon - passed if last else length)
            if error > 1.0:
                length = step.length * max(0.2, 0.9 * error**method.exponent)
                continue
            record.steps.append(step)
            turning = _reversal(step, direction)
            crossing = self._crossing(step, watched, direction)
            if crossing is not None and crossing <= turning:
                return passed + crossing * step.length, "threshold"
            length = step.length * (min(5.0, 0.9 * error**method.exponent) if error > 0.0 else 5.0)
            if turning <= 1.0:
                passed += turning * step.length
                state = step.at(turning)
                state[1] = 0.0
                push = equations.push(state)
                if abs(push) <= rules.grip:
                    return passed, "standstill"
                record.reversals.append(passed)
                direction = 1 if push > 0.0 else -1
                labour = 0
                slopes, watched = law(passed, state, direction)[:2]
                begin = StepStart(passed, state, slopes, direction, fastest)
                continue
            passed = horizon if last else passed + step.length
            state, slopes, watched = step.after, step.slopes, step.watched
            fastest = max(fastest, abs(state[1]))
            begin = StepStart(passed, state, slopes, direction, fastest)
            # Against the braking of joined terminals a rotor creeps to its rest without end: static friction ends that.
            if (
                abs(state[1]) <= rules.slow
                and slopes[1] * state[1] < 0.0
                and abs(equations.lasting_push(state)) <= rules.grip
            ):
                return passed, "creep"
            if isinstance(step, ExplicitStep):
                labour = labour + 1 if step.hurried else 0
                if labour == _LABOURED:
                    method = Rosenbrock(equations.timed)
        return horizon, "horizon"

    def _crossing(self, step: IntegrationStep, watched: float, direction: int) -> float | None:
        """Return the share of the step after which the threshold is passed, None where it is not."""
        rules, law = self._rules, self._equations.law
        if not rules.sense * (watched - rules.threshold) <= 0.0 < rules.sense * (step.watched - rules.threshold):
            return None
        if watched == rules.threshold:
            return 0.0

        def beyond(share: float) -> float:
            return law(step.start + share * step.length, step.at(share), direction)[1] - rules.threshold

        return float(brentq(beyond, 0.0, 1.0, xtol=1e-12)) if beyond(0.0) * beyond(1.0) < 0.0 else 1.0


def _reversal(step: IntegrationStep, direction: int) -> float:
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
