"""Tests whether residuals are random: no correlation between neighbours, and no periodic component above the noise."""

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import NDArray

#: Of the standard library, for a page of the panel asks: scipy would be 20 MB more of it.
_NORMAL = NormalDist()
#: Fewer readings than this show no pattern that could be told from chance.
LEAST_READINGS = 16


def chance_of_pattern(residuals: NDArray[np.float64]) -> float | None:
    """Return the p-value of residuals in the order in which they were taken, shape (n,), as noise without any order.

    The smaller of two tests on the ranks' normal scores, doubled: correlation of neighbours (one-sided: what a fit takes away makes it
    negative) and the largest line of the periodogram (R. A. Fisher, Proc. R. Soc. A 125 (1929), 54). None where nothing can be
    judged: fewer than LEAST_READINGS, or all alike.
    """
    n = residuals.size
    if n < LEAST_READINGS or not np.ptp(residuals):
        return None
    _, which, counts = np.unique(residuals, return_inverse=True, return_counts=True)
    # Ranks bound what a few wild readings do; equal readings have one rank.
    quantiles = (np.cumsum(counts) - 0.5 * counts) / n
    scores = np.fromiter(map(_NORMAL.inv_cdf, quantiles.tolist()), np.float64, quantiles.size)[which]
    scores -= np.mean(scores)
    resemblance = float(scores[1:] @ scores[:-1] / (scores @ scores))
    neighbours = 0.5 * math.erfc((resemblance + 1.0 / n) * math.sqrt(0.5 * n))
    # The line at half the sampling rate has one degree of freedom only.
    power = np.abs(np.fft.rfft(scores)[1 : (n + 1) // 2]) ** 2
    share = float(np.max(power) / np.sum(power))
    line = power.size * (1.0 - share) ** (power.size - 1)
    return min(1.0, 2.0 * min(neighbours, line))
