"""Test of values for a normal distribution: the test by Anderson and Darling."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from bench.eol.statistics.capability import ALIKE

#: Fewer values than this tell nothing of their distribution (D'Agostino and Stephens, 1986, 4.8.5).
FEWEST = 8


@dataclass(frozen=True)
class Normality:
    """The test of `count` values: A² (corrected for the count), and the p value; NaN for values that are too few or all alike."""

    count: int
    statistic: float
    p: float

    def rejected(self, alpha: float) -> bool:
        """Tell whether the values are not those of a normal distribution, at a level of significance."""
        return self.p < alpha


def anderson_darling(values: ArrayLike) -> Normality:
    """Return the test of normality with mean and standard deviation estimated from the values.

    Source: D'Agostino and Stephens, Goodness-of-Fit Techniques (1986), table 4.7 and 4.9.
    """
    # scipy.stats takes a second to load.
    from scipy.special import log_ndtr

    data = np.sort(np.asarray(values, dtype=np.float64))
    spread = float(data.std(ddof=1)) if data.size > 1 else 0.0
    if data.size < FEWEST or not spread > ALIKE * float(np.max(np.abs(data))):
        return Normality(int(data.size), math.nan, math.nan)
    scores = (data - data.mean()) / spread
    odd = 2.0 * np.arange(data.size) + 1.0
    plain = -data.size - float(np.mean(odd * (log_ndtr(scores) + log_ndtr(-scores[::-1]))))
    statistic = plain * (1.0 + 0.75 / data.size + 2.25 / data.size**2)
    return Normality(int(data.size), statistic, _p(statistic))


def bulk(values: ArrayLike) -> NDArray[np.float64]:
    """Return the values without those far off (4.5 standard deviations by the median deviation): a chart is to show these."""
    data = np.asarray(values, dtype=np.float64)
    if not data.size:
        return data
    off = np.abs(data - np.median(data))
    return data[off <= 4.5 * 1.4826 * float(np.median(off))]


def _p(a: float) -> float:
    if a >= 13.0:
        # Below 1e-23; the formula turns up again far beyond.
        return 0.0
    if a >= 0.6:
        return math.exp(1.2937 - 5.709 * a + 0.0186 * a**2)
    if a >= 0.34:
        return math.exp(0.9177 - 4.279 * a - 1.38 * a**2)
    if a >= 0.2:
        return 1.0 - math.exp(-8.318 + 42.796 * a - 59.938 * a**2)
    return 1.0 - math.exp(-13.436 + 101.14 * a - 223.73 * a**2)
