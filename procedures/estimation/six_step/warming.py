"""Temperature rise of a winding at each of several loads, between a temperature read before and one read after."""

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray


def warming_shares(
    heat: ArrayLike, begins: ArrayLike, reads: ArrayLike, end: float, *, warmed: bool
) -> tuple[FloatArray, FloatArray]:
    """Return which share of the whole rise is there when each load is read, and the half-width of what is known of it.

    `heat` is what warms the winding at each load (any unit, shape (n,)), `begins` and `reads` (s, shape (n,)) when the load came and
    when it was read, `end` (s) when the last load went. Where heat only gathers, the share is that of the energy so far; where the
    winding follows at once, that of the present power: a winding with one time constant lies between. One that did not warm
    (`warmed` false) tells nothing of its course. Raises EstimationError for times out of order.
    """
    power, start, read = (
        series(name, v, least=1) for name, v in (("heat", heat), ("begins", begins), ("reads", reads))
    )
    same_length(heat=power, begins=start, reads=read)
    stop = np.append(start[1:], end)
    if np.any(read < start) or np.any(stop < read):
        raise EstimationError("each load must be read between its own beginning and the next one's")
    if not warmed or power.sum() <= 0.0:
        return np.full(len(power), 0.5), np.full(len(power), 0.5)
    whole = power * (stop - start)
    gathered = (np.cumsum(whole) - whole + power * (read - start)) / whole.sum()
    followed = np.minimum(power / power[-1], 1.0)
    low, high = np.minimum(gathered, followed), np.maximum(gathered, followed)
    return 0.5 * (low + high), 0.5 * (high - low)
