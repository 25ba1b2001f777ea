"""Rosenbrock's method RODAS of order 4(3): for circuits that settle, or rotors that creep, much quicker than they swing.

Hairer and Wanner, Solving Ordinary Differential Equations II, section IV.7; stable whatever the step.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache
from operator import mul
from typing import Any

import numpy as np

from sim_instruments.physics.circuits.windings import FloatArray
from sim_instruments.physics.integration.integration_step import IntegrationStep, StepStart, relative_error
from sim_instruments.physics.integration.stages import compiled, numbered, weighted
from sim_instruments.physics.integration.swing_equations import Law

_GAMMA = 0.25
_C = (0.0, 0.386, 0.21, 0.63, 1.0)
_D = (0.25, -0.1043, 0.1035, -0.0362)
_A = (
    (),
    (1.544,),
    (0.9466785280815826, 0.2557011698983284),
    (3.314825187068521, 2.896124015972201, 0.9986419139977817),
    (1.221224509226641, 6.019134481288629, 12.53708332932087, -0.6878860361058950),
)
_B = (
    (),
    (-5.6688,),
    (-2.430093356833875, -0.2063599157091915),
    (-0.1073529058151375, -9.594562251023355, -20.47028614809616),
    (7.496443313967647, -10.24680431464352, -33.99990352819905, 11.70890893206160),
    (8.083246795921522, -7.981132988064893, -31.52159432874371, 16.31930543123136, -6.058818238834054),
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
        self._linearised: tuple[StepStart, list[list[float]]] | None = None

    def tried(self, law: Law, begin: StepStart, length: float) -> tuple[ImplicitStep, float]:
        """Return a step of a length (s), and its error relative to what is allowed."""
        start, state, direction = begin.start, begin.state, begin.direction
        if self._linearised is None or self._linearised[0] is not begin:
            self._linearised = begin, _jacobian(law, begin)
        drift = []
        if self._timed:
            later = 1e-3 * length
            slopes = law(start + later, state, direction)[0]
            drift = [(new - old) / later * length for new, old in zip(slopes, begin.slopes, strict=True)]
        written = _written_out(len(state), self._timed)
        parts, errors, after = written(law, start, state, direction, length, begin.slopes, self._linearised[1], drift)
        relative = relative_error(begin, after, errors) / _LENIENT
        ended, watched, _ = law(start + length, after, direction)
        return ImplicitStep(start, length, state, after, ended, watched, parts), relative


def _jacobian(law: Law, begin: StepStart) -> list[list[float]]:
    """Return the slopes' derivatives by each of the states."""
    columns = []
    for number, value in enumerate(begin.state):
        change = _CHANGE * max(abs(value), _LEAST) if number else _CHANGE
        moved = begin.state.copy()
        moved[number] = value + change
        slopes = law(begin.start, moved, begin.direction)[0]
        columns.append([(new - old) / change for new, old in zip(slopes, begin.slopes, strict=True)])
    return columns


@cache
def _written_out(states: int, timed: bool) -> Callable[..., Any]:
    """Return the method's stages: each state's results, the errors, and the end."""
    number = range(states)
    columns = [numbered(f"m_{column}_", states) for column in number]
    lines = [
        f"{numbered('y', states)} = state",
        f"{numbered('f', states)} = slopes",
        f"{', '.join(f'({name})' for name in columns)} = jacobian",
        f"rate, shift = 1.0 / length, 1.0 / ({_GAMMA} * length)",
    ]
    lines += [f"{numbered('t', states)} = drift"] * timed
    lines += [f"m_{c}_{r} = {'shift ' * (c == r)}- m_{c}_{r}" for c in number for r in number]
    # From the last to the first: what settles quicker has the larger pivot.
    for last in reversed(number):
        lines.append(f"p{last} = 1.0 / m_{last}_{last}")
        for row in range(last):
            lines.append(f"m_{last}_{row} *= p{last}")
            lines += [f"m_{c}_{row} -= m_{last}_{row} * m_{c}_{last}" for c in range(last)]
    for stage, weights in enumerate(_B):
        results = [[f"u{k}_{n}" for k in range(stage)] for n in number]
        if stage == len(_A):
            lines += [f"q{n} += {results[n][-1]}" for n in number]
        elif stage:
            lines += [f"q{n} = y{n} + {weighted(_A[stage], results[n])}" for n in number]
        if stage:
            at = f"start + {_C[min(stage, len(_C) - 1)]!r} * length"
            lines.append(f"{numbered('f', states)} = law({at}, [{numbered('q', states)}], direction)[0]")
        for n in number:
            push = f" + rate * ({weighted(weights, results[n])})" if stage else ""
            late = f" + {_D[stage]!r} * t{n}" if timed and stage < len(_D) else ""
            lines.append(f"b{n} = f{n}{push}{late}")
        lines += [f"b{row} -= m_{last}_{row} * b{last}" for last in reversed(number) for row in range(last)]
        for n in number:
            known = "".join(f" - m_{c}_{n} * u{stage}_{c}" for c in range(n))
            lines.append(f"u{stage}_{n} = (b{n}{known}) * p{n}")
    parts = ", ".join(f"({', '.join(f'u{stage}_{n}' for stage in range(len(_A)))})" for n in number)
    last_stage = f"u{len(_A)}_"
    after = ", ".join(f"q{n} + u{len(_A)}_{n}" for n in number)
    lines.append(f"return [{parts}], [{numbered(last_stage, states)}], [{after}]")
    return compiled("stages(law, start, state, direction, length, slopes, jacobian, drift)", lines)


def rises(steps: Sequence[ImplicitStep]) -> FloatArray:
    """Return how the states rise over each step: coefficients (4, steps, states) of the share that has passed."""
    parts = np.array([step.parts for step in steps])
    bend, twist = np.einsum("ksi,ji->jks", parts, np.array(_DENSE))
    whole = np.array([step.after for step in steps]) - np.array([step.state for step in steps])
    return np.array([whole + bend, twist - bend, -twist, np.zeros_like(whole)])
