"""Dormand and Prince's method of order 5(4), in plain numbers: at a swing's few states arrays cost more than the arithmetic."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import mul

import numpy as np
from scipy.integrate import RK45

from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.integration.integration_step import Begin, IntegrationStep, relative_error
from sim_instruments.physics.integration.swing_equations import Law

# With Shampine's interpolant; SciPy holds the tables. The second stage has no part in the result.
_C = [float(c) for c in RK45.C]
_A = [tuple(float(a) for a in row[:stage]) for stage, row in enumerate(RK45.A)]
_B = [float(b) for b in RK45.B]
_E = [float(e) for e in RK45.E]
_P: FloatArray = np.asarray(RK45.P, dtype=np.float64)
#: Close to the 3.3 decays of a step up to which the method is stable.
_STABLE = 1.5
_P_COLUMNS = [[float(p) for p in column] for column in _P.T]


@dataclass
class ExplicitStep(IntegrationStep):
    """A step with the slopes of all states at each of the method's stages; `hurried` where a current would have taken less."""

    stages: list[list[float]]
    hurried: bool = False

    def course(self, number: int) -> Callable[[float], float]:
        """Return one state over the share of the step that has passed."""
        begin = self.state[number]
        column = [stage[number] for stage in self.stages]
        first, second, third, fourth = (self.length * sum(map(mul, p, column)) for p in _P_COLUMNS)
        return lambda share: begin + share * (first + share * (second + share * (third + share * fourth)))


class DormandPrince:
    """The explicit method: quick as long as nothing in the circuit is much quicker than the rotor."""

    exponent = -0.2

    def tried(self, law: Law, begin: Begin, length: float) -> tuple[ExplicitStep, float]:
        """Return a step of a length (s), and its error relative to what is allowed."""
        start, state, first, direction = begin.start, begin.state, begin.slopes, begin.direction
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
        errors = [
            length * (e0 * k1 + e2 * k3 + e3 * k4 + e4 * k5 + e5 * k6 + e6 * k7)
            for k1, k3, k4, k5, k6, k7 in zip(first, third, fourth, fifth, sixth, ended, strict=True)
        ]
        stages = [first, second, third, fourth, fifth, sixth, ended]
        step = ExplicitStep(start, length, state, after, ended, watched, stages)
        # Shampine's measure, from the two slopes at the step's end: how much of it the quickest current would take alone.
        for number in range(2, len(state)):
            moved = abs(after[number] - point[number])
            if moved * _STABLE < length * abs(ended[number] - sixth[number]):
                step.hurried = True
        return step, relative_error(begin, after, errors)


def rises(steps: Sequence[ExplicitStep]) -> FloatArray:
    """Return how the states rise over each step: coefficients (4, steps, states) of the share that has passed."""
    lengths = np.array([step.length for step in steps])
    stages = np.array([step.stages for step in steps])
    result: FloatArray = np.einsum("kis,ij->jks", stages, _P) * lengths[:, np.newaxis]
    return result
