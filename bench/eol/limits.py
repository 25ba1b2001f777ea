"""Limits on a parameter, and how its uncertainty guards them."""

import math
from dataclasses import dataclass
from enum import Enum

from bench.eol.verdict import Verdict
from drivers.interfaces.text import text
from procedures.core.parameter_definition import Bounds


class GuardBand(Enum):
    """Decision on a figure that lies near a limit.

    `strict` accepts only what lies inside by at least the expanded uncertainty (ISO 14253-1, proof of conformity);
    `shared` takes the limits as they are, a risk both sides share (JCGM 106, 8.2.1, simple acceptance); `lenient` rejects only what lies
    outside by at least the expanded uncertainty (ISO 14253-1, proof of non-conformity).
    """

    STRICT = "strict"
    SHARED = "shared"
    LENIENT = "lenient"


@dataclass(frozen=True)
class ParameterLimits:
    """The interval in which a parameter must lie, in its unit; an open side is infinite."""

    low: float = -math.inf
    high: float = math.inf

    def __post_init__(self) -> None:
        if math.isnan(self.low) or math.isnan(self.high) or self.low > self.high:
            raise ValueError(text("limits {low:g} … {high:g} are reversed", low=self.low, high=self.high))

    @property
    def tolerance(self) -> float:
        """The interval's width; infinite where a side is open."""
        return self.high - self.low

    def within(self, bounds: Bounds) -> "ParameterLimits":
        """Return the limits with what no figure of the parameter can be in place of an open side."""
        high = math.inf if bounds.high is None else bounds.high
        return ParameterLimits(
            bounds.low if math.isinf(self.low) else self.low, high if math.isinf(self.high) else self.high
        )


def limits_of(low: float | None, high: float | None) -> ParameterLimits:
    """Return the limits of a stored figure, of which an open side is nothing."""
    return ParameterLimits(-math.inf if low is None else low, math.inf if high is None else high)


def least_ratio(guard: GuardBand, minimum: float, limits: ParameterLimits) -> float:
    """Return how many widths of the 95 % interval the accepted figures must span at the least.

    `minimum` of two limits, and where strict guard bands meet no motor could pass; of one limit 1, as each figure is judged by it and the
    other end is only where no figure can be.
    """
    if math.isinf(limits.tolerance):
        return 1.0
    return max(minimum, 1.0) if guard is GuardBand.STRICT else minimum


@dataclass(frozen=True)
class LimitJudgement:
    """The verdict on a figure, and how well the limits can be decided.

    `ratio` is the tolerance over the expanded uncertainty's double; infinite where either is nothing.
    """

    verdict: Verdict
    ratio: float


def judge(value: float, expanded: float, limits: ParameterLimits, guard: GuardBand) -> LimitJudgement:
    """Return the verdict on a value with its expanded uncertainty (95 %, half the interval; 0 for a count).

    A value that is no number is an error. GuardBand bands that meet leave nothing to accept.
    """
    band = 0.0 if guard is GuardBand.SHARED else expanded if guard is GuardBand.STRICT else -expanded
    low, high = limits.low + band, limits.high - band
    ratio = limits.tolerance / (2.0 * expanded) if expanded > 0.0 else math.inf
    if math.isnan(value) or math.isnan(expanded) or expanded < 0.0:
        return LimitJudgement(Verdict.ERROR, ratio)
    return LimitJudgement(Verdict.PASS if low <= value <= high else Verdict.FAIL, ratio)
