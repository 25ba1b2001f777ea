"""What the torque does just after a shaft began to turn: behind a slow filter it comes to its mean only by and by."""

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.noise import white_noise

#: Time constants that are tried: from this many intervals of the readings to this share of the record, beyond which it is a drift.
_LEAST, _MOST, _TRIED = 1.0, 0.1, 24
#: χ² by which an approach must explain the torque better.
_CLEAR = 25.0


def lag_at_start(time: ArrayLike, torque: ArrayLike, resolution: float = 0.0) -> float:
    """Return the time constant (s) with which torques (N·m) read at times (s), from the start of a turn on, approach their mean; 0 where
    noise, or a change in a straight line, explains them as well.

    `resolution` (N·m) is a step of the sensor. Raises EstimationError for arrays of several lengths.
    """
    at, read = series("times", time, least=8), series("torques", torque, least=8)
    same_length(times=at, torques=read)
    at = at - at[0]
    noise = white_noise(read, resolution)
    if not noise > 0.0:
        return 0.0
    straight = np.column_stack((np.ones_like(at), at))
    left = read - straight @ np.linalg.lstsq(straight, read, rcond=None)[0]
    best, gained = 0.0, _CLEAR
    for constant in np.geomspace(_LEAST * at[-1] / at.size, _MOST * at[-1], _TRIED):
        approach = np.exp(-at / constant)
        approach -= straight @ np.linalg.lstsq(straight, approach, rcond=None)[0]
        explained = float(approach @ left) ** 2 / float(approach @ approach) / noise**2
        if explained > gained:
            best, gained = float(constant), explained
    return best
