"""Rosenbrock's method RODAS of order 4(3): for circuits that settle, or rotors that creep, much quicker than they swing.

Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.7; stable whatever the step.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from operator import mul

import numpy as np

from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.integration.integration_step import Begin, IntegrationStep, relative_error
from sim_instruments.physics.integration.swing_equations import Law

_GAMMA = 0.25
_C2, _C3, _C4 = 0.386, 0.21, 0.63
_D1, _D2, _D3, _D4 = 0.25, -0.1043, 0.1035, -0.0362
_A21 = 1.544
_A31, _A32 = 0.9466785280815826, 0.2557011698983284
_A41, _A42, _A43 = 3.314825187068521, 2.896124015972201, 0.9986419139977817
_A51, _A52, _A53, _A54 = 1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950
_C21 = -5.6688
_C31, _C32 = -2.430093356833875, -0.2063599157091915
_C41, _C42, _C43 = -0.1073529058151375, -9.594562251023355, -20.47028614809616
_C51, _C52, _C53, _C54 = 7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160
_C61, _C62, _C63, _C64, _C65 = (
    8.083246795921522,
    -7.981132988064893,
    -31.52159432874371,
    16.31930543123136,
    -6.058818238834054,
)
_DENSE = (
    (10.12623508344586, -7.487995877610167, -34.80091861555747, -7.992771707568823, 1.025137723295662),
    (-0.6762803392801253, 6.087714651680015, 16.43084320892478, 24.76722511418386, -6.594389125716872),
)
#: The embedded result of order 3 errs by far more than the step's own, which is what counts.
_LENIENT = 100.0
#: Changes of angle (rad), and of the others relative or at least so large, from which slopes of the law are taken.
_CHANGE, _LEAST = 1e-7, 1e-3


@dataclass
class ImplicitStep(IntegrationStep):
    """A step with each state's results of the method's stages."""

    parts: Sequence[tuple[float, ...]]

    def course(self, number: int) -> Callable[[float], float]:
        """Return one state over the share of the step that has passed."""
        begin = self.state[number]
        bend, twist = (sum(map(mul, row, self.parts[number])) for row in _DENSE)
        first, second, third = self.after[number] - begin + bend, twist - bend, -twist
        return lambda share: begin + share * (first + share * (second + share * third))


class Rosenbrock:
    """The linearly implicit method; `timed` says that the law depends on time itself."""

    exponent = -0.25

    def __init__(self, timed: bool) -> None:
        self._timed = timed
        self._linearised: tuple[Begin, FloatArray] | None = None

    def tried(self, law: Law, begin: Begin, length: float) -> tuple[ImplicitStep, float]:
        """Return a step of a length (s), and its error relative to what is allowed."""
        start, state, direction = begin.start, begin.state, begin.direction
        if self._linearised is None or self._linearised[0] is not begin:
            self._linearised = begin, -_jacobian(law, begin)
        matrix = self._linearised[1].copy()
        matrix.flat[:: len(state) + 1] += 1.0 / (_GAMMA * length)
        inverse = np.linalg.inv(matrix).tolist()
        drift = [0.0] * len(state)
        if self._timed:
            later = 1e-3 * length
            slopes = law(start + later, state, direction)[0]
            drift = [(new - old) / later * length for new, old in zip(slopes, begin.slopes, strict=True)]

        def solved(right: list[float]) -> list[float]:
            return [sum(map(mul, row, right)) for row in inverse]

        rate = 1.0 / length
        first = solved([f + _D1 * t for f, t in zip(begin.slopes, drift, strict=True)])
        point = [y + _A21 * u1 for y, u1 in zip(state, first, strict=True)]
        slopes = law(start + _C2 * length, point, direction)[0]
        second = solved(
            [f + rate * (_C21 * u1) + _D2 * t for f, u1, t in zip(slopes, first, drift, strict=True)],
        )
        point = [y + _A31 * u1 + _A32 * u2 for y, u1, u2 in zip(state, first, second, strict=True)]
        slopes = law(start + _C3 * length, point, direction)[0]
        third = solved(
            [
                f + rate * (_C31 * u1 + _C32 * u2) + _D3 * t
                for f, u1, u2, t in zip(slopes, first, second, drift, strict=True)
            ]
        )
        point = [
            y + _A41 * u1 + _A42 * u2 + _A43 * u3 for y, u1, u2, u3 in zip(state, first, second, third, strict=True)
        ]
        slopes = law(start + _C4 * length, point, direction)[0]
        fourth = solved(
            [
                f + rate * (_C41 * u1 + _C42 * u2 + _C43 * u3) + _D4 * t
                for f, u1, u2, u3, t in zip(slopes, first, second, third, drift, strict=True)
            ]
        )
        point = [
            y + _A51 * u1 + _A52 * u2 + _A53 * u3 + _A54 * u4
            for y, u1, u2, u3, u4 in zip(state, first, second, third, fourth, strict=True)
        ]
        slopes = law(start + length, point, direction)[0]
        fifth = solved(
            [
                f + rate * (_C51 * u1 + _C52 * u2 + _C53 * u3 + _C54 * u4)
                for f, u1, u2, u3, u4 in zip(slopes, first, second, third, fourth, strict=True)
            ]
        )
        point = [y + u5 for y, u5 in zip(point, fifth, strict=True)]
        slopes = law(start + length, point, direction)[0]
        errors = solved(
            [
                f + rate * (_C61 * u1 + _C62 * u2 + _C63 * u3 + _C64 * u4 + _C65 * u5)
                for f, u1, u2, u3, u4, u5 in zip(slopes, first, second, third, fourth, fifth, strict=True)
            ]
        )
        after = [y + error for y, error in zip(point, errors, strict=True)]
        relative = relative_error(begin, after, errors) / _LENIENT
        ended, watched, _ = law(start + length, after, direction)
        parts = list(zip(first, second, third, fourth, fifth, strict=True))
        return ImplicitStep(start, length, state, after, ended, watched, parts), relative


def _jacobian(law: Law, begin: Begin) -> FloatArray:
    """Return the slopes' derivatives by the states (states, states)."""
    columns = []
    for number, value in enumerate(begin.state):
        change = _CHANGE * max(abs(value), _LEAST) if number else _CHANGE
        moved = begin.state.copy()
        moved[number] = value + change
        slopes = law(begin.start, moved, begin.direction)[0]
        columns.append([(new - old) / change for new, old in zip(slopes, begin.slopes, strict=True)])
    result: FloatArray = np.array(columns).T
    return result


def rises(steps: Sequence[ImplicitStep]) -> FloatArray:
    """Return how the states rise over each step: coefficients (4, steps, states) of the share that has passed."""
    parts = np.array([step.parts for step in steps])
    bend, twist = np.einsum("ksi,ji->jks", parts, np.array(_DENSE))
    whole = np.array([step.after for step in steps]) - np.array([step.state for step in steps])
    return np.array([whole + bend, twist - bend, -twist, np.zeros_like(whole)])
