"""Two sets of figures of one motor type, parameter by parameter."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol


class FigureLike(Protocol):
    """A value and its standard uncertainty, in a unit."""

    @property
    def value(self) -> float:
        """The value."""

    @property
    def uncertainty(self) -> float:
        """Its standard uncertainty, in the same unit."""

    @property
    def unit(self) -> str:
        """The unit."""


@dataclass(frozen=True)
class Compared:
    """One parameter of both: relative `difference` of the second to the first, and the normalised error E_n.

    E_n is the difference over the expanded uncertainty (k = 2) of the difference, both taken as independent
    (ISO 13528, 9.7); above 1 in size the two disagree. NaN where neither has an uncertainty.
    """

    name: str
    unit: str
    first: float
    second: float
    difference: float
    normalised_error: float

    @property
    def disagree(self) -> bool:
        """True if the two differ by more than their uncertainties allow."""
        return abs(self.normalised_error) > 1.0


def compare(first: Mapping[str, FigureLike], second: Mapping[str, FigureLike]) -> list[Compared]:
    """Return the parameters that both have, in the first one's order; a figure in another unit is not compared."""
    return [
        _compared(name, figure, second[name])
        for name, figure in first.items()
        if name in second and second[name].unit == figure.unit
    ]


def _compared(name: str, first: FigureLike, second: FigureLike) -> Compared:
    difference = second.value - first.value
    spread = 2.0 * math.hypot(first.uncertainty, second.uncertainty)
    # Without any uncertainty, equal figures say nothing and others disagree.
    exact = math.nan if difference == 0.0 else math.copysign(math.inf, difference)
    normalised = difference / spread if spread > 0.0 else exact
    relative = difference / first.value if first.value else math.nan
    return Compared(name, first.unit, first.value, second.value, relative, normalised)
