"""Half-width of a coverage interval of a sum whose parts are not all normal (JCGM 101, propagation of distributions)."""

import math
from collections.abc import Sequence

import numpy as np
from scipy import special

from procedures.estimation.fitting.fit import FloatArray

#: A rectangular part below this share of the whole is as good as normal.
_SMALL = 0.1
_CELLS = 600
#: With more degrees of freedom Student's density is the normal one, and its factor would be a difference of large numbers.
_MANY = 1e6
#: A last step of this share of the standard uncertainty.
_PRECISE = 1e-4


def half_width(rectangular: Sequence[float], scattered: Sequence[tuple[float, float]], coverage: float = 0.95) -> float:
    """Return the half-width of the symmetric interval that holds the sum of independent errors with the given probability.

    `rectangular` are half-widths of rectangular distributions, `scattered` standard uncertainties with their degrees of
    freedom (infinite for a normal one), all in the unit of the sum. Where no rectangular part stands out it is Student's
    factor at the effective degrees of freedom (GUM G.4) times the combined standard uncertainty, and less where one does.
    """
    total = math.sqrt(sum(a * a for a in rectangular) / 3.0 + sum(u * u for u, _ in scattered))
    if total == 0.0:
        return 0.0
    large = [a for a in rectangular if a > _SMALL * math.sqrt(3.0) * total]
    rest = math.sqrt(max(total**2 - sum(a * a for a in large) / 3.0, 0.0))
    weight = sum(u**4 / freedom for u, freedom in scattered if math.isfinite(freedom))
    # No sum has fewer degrees of freedom than its worst part; where rounding leaves nothing of the rest it would.
    fewest = min((freedom for _, freedom in scattered), default=math.inf)
    freedom = max(rest**4 / weight, fewest) if weight > 0.0 else math.inf
    tail = 0.5 * (1.0 - coverage)
    if not large:
        return -_quantile(tail, freedom) * total
    cell = 2.0 * sum(large) / _CELLS
    place, share = _sum_of(large, cell)
    spread = math.hypot(rest, cell / math.sqrt(12.0))

    # Newton's method within a bracket, from what a single rectangular part would have.
    low, high, width = 0.0, math.inf, coverage * math.sqrt(3.0) * total
    while True:
        below = (-width - place) / spread
        beyond = float(share @ _cumulative(below, freedom)) - tail
        slope = float(share @ _density(below, freedom)) / spread
        low, high = (width, high) if beyond > 0.0 else (low, width)
        nearer = width + beyond / slope if slope > 0.0 else low
        if abs(nearer - width) < _PRECISE * total:
            return nearer
        width = nearer if low < nearer < high else 0.5 * (low + high)


def _quantile(probability: float, freedom: float) -> float:
    return float(special.stdtrit(freedom, probability) if math.isfinite(freedom) else special.ndtri(probability))


def _cumulative(values: FloatArray, freedom: float) -> FloatArray:
    return np.asarray(special.stdtr(freedom, values) if math.isfinite(freedom) else special.ndtr(values))


def _density(values: FloatArray, freedom: float) -> FloatArray:
    if freedom > _MANY:
        return np.asarray(np.exp(-0.5 * values**2) / math.sqrt(2.0 * math.pi))
    power = 0.5 * (freedom + 1.0)
    highest = math.exp(math.lgamma(power) - math.lgamma(0.5 * freedom)) / math.sqrt(freedom * math.pi)
    return np.asarray(highest * np.exp(-power * np.log1p(values**2 / freedom)))


def _sum_of(half_widths: Sequence[float], cell: float) -> tuple[FloatArray, FloatArray]:
    """Return cells' places and probabilities of a sum of rectangular errors."""
    share = np.ones(1)
    for a in half_widths:
        cells = max(2.0 * a / cell, 1.0)
        whole = 2 * int((cells - 1.0) / 2.0) + 1
        edge = 0.5 * (cells - whole)
        share = np.convolve(share, np.concatenate(([edge], np.ones(whole), [edge])) / cells)
    places = cell * (np.arange(share.size) - (share.size - 1) / 2.0)
    return np.asarray(places, dtype=np.float64), share
