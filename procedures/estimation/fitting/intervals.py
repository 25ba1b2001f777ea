"""Intervals of values, for decisions that must hold for every value within them."""

import math
from dataclasses import dataclass


@dataclass(frozen=True)
class Interval:
    """All figures from `low` to `high`; both may be infinite."""

    low: float
    high: float

    def overlaps(self, other: "Interval") -> bool:
        """Tell whether one figure may lie in both."""
        return self.low <= other.high and other.low <= self.high

    def scaled(self, factor: float) -> "Interval":
        """Return it multiplied by a finite factor of either sign."""
        ends = (self.low * factor, self.high * factor)
        return Interval(min(ends), max(ends))

    def plus(self, other: "Interval") -> "Interval":
        """Return the sums of one figure of each."""
        return Interval(self.low + other.low, self.high + other.high)

    def over(self, divisor: "Interval") -> "Interval":
        """Return the quotients by a divisor that is not negative; ANY where it may be zero."""
        if divisor.low <= 0.0:
            return ANY
        ends = [end / by for end in (self.low, self.high) for by in (divisor.low, divisor.high)]
        return Interval(min(ends), max(ends))


#: Every figure: says nothing.
ANY = Interval(-math.inf, math.inf)


def around(value: float, gain: float = 0.0, offset: float = 0.0) -> Interval:
    """Return a value with what a relative and an absolute error may make of it, both given as half-widths."""
    half = abs(value) * gain + offset
    return Interval(value - half, value + half)
