"""Association of failures with other figures of the same motors."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike


@dataclass(frozen=True)
class Association:
    """The distance of the motors that failed at `failure` from all motors in `parameter`, in standard deviations of all of them.

    `interval` holds it with the confidence asked for, all associations of one table together.
    """

    failure: str
    parameter: str
    count: int
    offset: float
    interval: tuple[float, float]

    @property
    def certain(self) -> bool:
        """Tell whether the interval leaves out zero."""
        return self.interval[0] > 0.0 or self.interval[1] < 0.0


def association(
    failure: str, parameter: str, failed: ArrayLike, mean: float, spread: float, confidence: float, tests: int
) -> Association | None:
    """Return the association of one failure and one parameter; None for fewer than three failed motors, or no spread at all.

    `failed` are the failed motors' values, `mean` and `spread` those of all motors. The interval is Student's, with the error
    shared among `tests` (Bonferroni), and no narrower than by the spread of all: a few motors of one socket, whose figures its
    instruments shift alike, would stand out.
    """
    from scipy.special import ndtri, stdtrit

    values = np.asarray(failed, dtype=np.float64)
    if values.size < 3 or not spread > 0.0:
        return None
    offset = (float(values.mean()) - mean) / spread
    error = (1.0 - confidence) / (2.0 * max(1, tests))
    own = float(stdtrit(values.size - 1, 1.0 - error)) * float(values.std(ddof=1)) / spread
    half = max(own, float(ndtri(1.0 - error))) / math.sqrt(values.size)
    return Association(failure, parameter, int(values.size), offset, (offset - half, offset + half))
