"""The result of an integration step of a swing, whatever the method."""

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

from sim_instruments.physics.integration.swing_equations import Law

_RELATIVE = 1e-6
# A creeping rotor's speed is small against nothing but itself: errors of 1e-5 rad/s would stop it.
_ANGLE, _SPEED, _CURRENT = 3e-7, 1e-8, 1e-6


@dataclass
class IntegrationStep(ABC):
    """From `state` at `start` (s) over `length` (s); `after`, `slopes` and `watched` hold at its end."""

    start: float
    length: float
    state: list[float]
    after: list[float]
    slopes: list[float]
    watched: float

    @abstractmethod
    def course(self, number: int) -> Callable[[float], float]:
        """Return one state over the share of the step that has passed."""

    def at(self, share: float) -> list[float]:
        """Return the state a share of the step on."""
        return [self.course(number)(share) for number in range(len(self.state))]


@dataclass(frozen=True)
class StepStart:
    """The start of a step: time (s), state and its slopes, the direction of the friction, and the largest speed (rad/s) so far."""

    start: float
    state: list[float]
    slopes: list[float]
    direction: int
    fastest: float


class Method(Protocol):
    """A way to integrate: `exponent` says how its error grows with the step's length."""

    exponent: float

    def tried(self, law: Law, begin: StepStart, length: float) -> tuple[IntegrationStep, float]:
        """Return a step of a length (s), and its error relative to what is allowed."""


def relative_error(begin: StepStart, after: Sequence[float], errors: Sequence[float]) -> float:
    """Return the root mean square of the states' errors, relative to what is allowed."""
    total = (errors[0] / _ANGLE) ** 2
    before, new = abs(begin.state[1]), abs(after[1])
    total += (errors[1] / (_SPEED + _RELATIVE * (begin.fastest + (before if before > new else new)))) ** 2
    for number in range(2, len(errors)):
        before, new = abs(begin.state[number]), abs(after[number])
        total += (errors[number] / (_CURRENT + _RELATIVE * (before if before > new else new))) ** 2
    return math.sqrt(total / len(errors))
