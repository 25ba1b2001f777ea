"""Errors of the units that are in use: few are as bad as their maker allows."""

import numpy as np

#: Of the units in use, so many are well within their limits, so many anywhere within them, the rest at their ends.
_WELL_WITHIN, _ANYWHERE = 0.75, 0.17
#: How far within (share of the limit), and how close to its end the last ones lie.
_WELL, _AT_END = 1.0 / 3.0, 0.95


def as_sold(generator: np.random.Generator, limit: float) -> float:
    """Draw an error as a user meets it: makers adjust most units to a third of the limit, and some are old or hot and at its end."""
    kind = float(generator.uniform())
    if kind < _WELL_WITHIN:
        return _WELL * limit * float(generator.uniform(-1.0, 1.0))
    if kind < _WELL_WITHIN + _ANYWHERE:
        return float(generator.uniform(-limit, limit))
    return float(generator.choice([-1.0, 1.0]) * generator.uniform(_AT_END * limit, limit))
