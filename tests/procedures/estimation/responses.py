"""Responses of first order, for tests that make their own records."""

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.first_order import Decay


def respond(
    time: NDArray[np.float64], drive: NDArray[np.float64], rate: float, start: float = 0.0
) -> NDArray[np.float64]:
    """Return y(t), shape (n,), of y' = drive − rate·y with y = `start` at the first sample; the drive runs straight between samples."""
    steps = np.diff(time)
    return Decay(steps, rate * steps).respond(drive, start)
