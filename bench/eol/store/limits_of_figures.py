"""Limits as a database keeps them: an open side is nothing."""

import math

from bench.eol.limits import ParameterLimits


def limits_of(low: float | None, high: float | None) -> ParameterLimits:
    """Return the limits of a stored figure."""
    return ParameterLimits(-math.inf if low is None else low, math.inf if high is None else high)
