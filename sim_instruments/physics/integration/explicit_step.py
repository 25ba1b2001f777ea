"""Dormand and Prince's method of order 5(4), in plain numbers: at a swing's few states arrays cost more than the arithmetic."""

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

_C = (0.0, 1 / 5, 3 / 10, 4 / 5, 8 / 9, 1.0)
_A = (
    (),
    (1 / 5,),
    (3 / 40, 9 / 40),
    (44 / 45, -56 / 15, 32 / 9),
    (19372 / 6561, -25360 / 2187, 64448 / 6561, -212 / 729),
    (9017 / 3168, -355 / 33, 46732 / 5247, 49 / 176, -5103 / 18656),
)
_B = (35 / 384, 0.0, 500 / 1113, 125 / 192, -2187 / 6784, 11 / 84)
_E = (-71 / 57600, 0.0, 71 / 16695, -71 / 1920, 17253 / 339200, -22 / 525, 1 / 40)
#: Shampine's interpolant. The second stage has no part in it, nor in the result.
_P: FloatArray = np.array(
    (
        (1.0, -8048581381 / 2820520608, 8663915743 / 2820520608, -12715105075 / 11282082432),
        (0.0, 0.0, 0.0, 0.0),
        (0.0, 131558114200 / 32700410799, -68118460800 / 10900136933, 87487479700 / 32700410799),
        (0.0, -1754552775 / 470086768, 14199869525 / 1410260304, -10690763975 / 1880347072),
        (0.0, 127303824393 / 49829197408, -318862633887 / 49829197408, 701980252875 / 199316789632),
        (0.0, -282668133 / 205662961, 2019193451 / 616988883, -1453857185 / 822651844),
        (0.0, 40617522 / 29380423, -110615467 / 29380423, 69997945 / 29380423),
    )
)
#: Close to the 3.3 decays of a step up to which the method is stable.
_STABLE = 1.5
_P_COLUMNS: list[list[float]] = _P.T.tolist()


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

    def tried(self, law: Law, begin: StepStart, length: float) -> tuple[ExplicitStep, float]:
        """Return a step of a length (s), and its error relative to what is allowed."""
        start, state = begin.start, begin.state
        written = _written_out(len(state))
        stages, point, after, watched, errors = written(law, start, state, begin.direction, length, begin.slopes)
        sixth, ended = stages[-2:]
        step = ExplicitStep(start, length, state, after, ended, watched, stages)
        # Shampine's measure, from the two slopes at the step's end: how much of it the quickest current would take alone.
        for number in range(2, len(state)):
            moved = abs(after[number] - point[number])
            if moved * _STABLE < length * abs(ended[number] - sixth[number]):
                step.hurried = True
        return step, relative_error(begin, after, errors)


@cache
def _written_out(states: int) -> Callable[..., Any]:
    """Return the method's stages: the slopes at each, the last point before the end, the end, what is watched there, the errors."""
    number, slopes = range(states), [f"k{stage}_" for stage in range(len(_E))]

    def ahead(weights: Sequence[float]) -> str:
        sums = [weighted(weights, [f"{slope}{n}" for slope in slopes[: len(weights)]]) for n in number]
        return ", ".join(f"y{n} + length * ({total})" for n, total in zip(number, sums, strict=True))

    lines = [f"{numbered('y', states)} = state", f"{numbered('k0_', states)} = k0"]
    for stage in range(1, len(_C)):
        lines += [
            f"point = [{ahead(_A[stage])}]",
            f"k{stage} = law(start + {_C[stage]!r} * length, point, direction)[0]",
            f"{numbered(slopes[stage], states)} = k{stage}",
        ]
    errors = ", ".join(f"length * ({weighted(_E, [f'{slope}{n}' for slope in slopes])})" for n in number)
    lines += [
        f"after = [{ahead(_B)}]",
        "k6, watched, _ = law(start + length, after, direction)",
        f"{numbered('k6_', states)} = k6",
        f"return [k0, k1, k2, k3, k4, k5, k6], point, after, watched, [{errors}]",
    ]
    return compiled("stages(law, start, state, direction, length, k0)", lines)


def rises(steps: Sequence[ExplicitStep]) -> FloatArray:
    """Return how the states rise over each step: coefficients (4, steps, states) of the share that has passed."""
    lengths = np.array([step.length for step in steps])
    stages = np.array([step.stages for step in steps])
    result: FloatArray = np.einsum("kis,ij->jks", stages, _P) * lengths[:, np.newaxis]
    return result
