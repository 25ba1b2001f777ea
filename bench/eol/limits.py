"""Limits on a parameter, and how its uncertainty guards them."""

import math
from dataclasses import dataclass
from enum import Enum

from bench.eol.verdict import Verdict
from bench.i18n.errors import InputError
from drivers.interfaces.text import text


class Guard(Enum):
    """What becomes of a figure that lies near a limit.

    `strict` accepts only what lies inside by at least the expanded uncertainty (ISO 14253-1, proof of conformity);
    `shared` takes the limits as they are, a risk both sides share (JCGM 106, 8.2.1, simple acceptance); `lenient` rejects only what lies
    outside by at least the expanded uncertainty (ISO 14253-1, proof of non-conformity).
    """

    STRICT = "strict"
    SHARED = "shared"
    LENIENT = "lenient"


@dataclass(frozen=True)
class Limits:
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


@dataclass(frozen=True)
class Judgement:
    """What a figure was held against: the limits, those that its guard band left, and the verdict.

    `ratio` is the tolerance over the expanded uncertainty's double; infinite where either is nothing.
    """

    verdict: Verdict
    accept_low: float
    accept_high: float
    ratio: float


def judge(value: float, expanded: float, limits: Limits, guard: Guard) -> Judgement:
    """Return the verdict on a value with its expanded uncertainty (95 %, half the interval; 0 for a count).

    A value that is no number is an error. Guard bands that meet leave nothing to accept.
    """
    band = 0.0 if guard is Guard.SHARED else expanded if guard is Guard.STRICT else -expanded
    low, high = limits.low + band, limits.high - band
    ratio = limits.tolerance / (2.0 * expanded) if expanded > 0.0 else math.inf
    if math.isnan(value) or math.isnan(expanded) or expanded < 0.0:
        return Judgement(Verdict.ERROR, low, high, ratio)
    return Judgement(Verdict.PASS if low <= value <= high else Verdict.FAIL, low, high, ratio)


def check_ratio(parameter: str, limits: Limits, expanded: float, minimum: float, source: str) -> None:
    """Refuse a limit that the measurement cannot decide.

    Raises InputError where the tolerance is less than `minimum` times the width of the 95 % interval.
    """
    if expanded <= 0.0 or math.isinf(limits.tolerance):
        return
    ratio = limits.tolerance / (2.0 * expanded)
    if ratio < minimum:
        raise InputError(
            text(
                "{source}: {parameter}: the limits {low:g} … {high:g} are {ratio:.2g} times as wide as the measurement's "
                "95 % interval (± {expanded:.3g}), and the plan asks for {minimum:g} at least; widen the limits, measure it "
                "by a more certain procedure, or lower plan.minimum_ratio",
                source=source,
                parameter=parameter,
                low=limits.low,
                high=limits.high,
                ratio=ratio,
                expanded=expanded,
                minimum=minimum,
            )
        )
