"""Places of the ticks on an axis, and their figures."""

import math
from collections.abc import Sequence

_STEPS = (1.0, 2.0, 2.5, 5.0, 10.0)


def ticks(low: float, high: float, most: int, *, whole: bool = False) -> Sequence[float]:
    """Return round values from `low` to `high`, with `most` steps between them at most; whole numbers only where asked for."""
    least = (high - low) / most
    decade = 10.0 ** math.floor(math.log10(least))
    if whole and decade < 1.0:
        decade, least = 1.0, max(least, 1.0)
    fits = (step for step in _STEPS if not (whole and step * decade % 1.0) and step * decade >= least * (1.0 - 1e-9))
    step = decade * next(fits, 10.0)
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return [number * step for number in range(first, last + 1)]


def label_of(value: float, step: float) -> str:
    """Return a tick's figure with as many decimals as its step needs."""
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    if round(step * 10.0**decimals) != round(step * 10.0**decimals, 6):
        decimals += 1
    return f"{value + 0.0:.{decimals}f}".replace("-", "\N{MINUS SIGN}")
