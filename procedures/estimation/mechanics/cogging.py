"""Cogging torque from readings of a slowly, evenly turned shaft."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from procedures.estimation.fitting.checks import positive, same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: An order counts where noise alone would reach its size at this probability, all orders looked at taken together.
_CHANCE = 0.01
#: At most so many orders of all that the readings could show are looked at: the rest tells the noise.
_SHARE = 0.3
#: Points of the curve that the peaks are sought on, for each period of its highest order.
_FINE = 128
#: Of a known order so many multiples are looked at, and what drifts over the part of a turn is a polynomial of this degree.
_MULTIPLES, _BEND = 3, 3
#: From this part of a turn on, run-out is told by its own orders, up to the second.
_PART, _RUN_OUT = 0.5, 2


@dataclass(frozen=True)
class Cogging:
    """What repeats itself every turn: `peak_to_peak` (N·m) with its standard `uncertainty` from the scatter.

    `orders` (k,) periods a turn that stand out of the noise and their `amplitudes` (k,), N·m; without any, `peak_to_peak` is 0.
    `hidden` (N·m, peak to peak) is what the scatter may hide: where the order is not known, one so high that it looks like
    noise. `mean` (N·m) is the drag that all this lies upon, `noise` (N·m) one reading's scatter.
    """

    peak_to_peak: float
    uncertainty: float
    hidden: float
    orders: FloatArray
    amplitudes: FloatArray
    mean: float
    noise: float


def fit_cogging(
    angle: ArrayLike,
    torque: ArrayLike,
    *,
    order: int | None = None,
    lowest_order: int = 6,
    highest_order: int = 400,
    resolution: float = 0.0,
) -> Cogging:
    """Return the torque that repeats itself over a turn, from readings (N·m) at mechanical angles (rad).

    `order` is its periods a turn: then some periods suffice, and its multiples are looked at. Without it the readings cover
    whole turns; orders below `lowest_order` are a coupling's run-out and not the magnets'. `resolution` (N·m) is one step of
    the readings. Raises EstimationError on less than a turn (or than two periods) or too few readings.
    """
    theta, values = series("angle", angle, least=16), series("torque", torque, least=16)
    same_length(angle=theta, torque=values)
    turns = abs(float(theta[-1] - theta[0])) * theta.size / (theta.size - 1) / (2.0 * math.pi)
    orders, counted, drift = (
        _whole(turns, theta.size, lowest_order, highest_order)
        if order is None
        else _known(turns, theta.size, int(positive("order", order, "")))
    )
    turning = np.exp(1j * np.outer(orders, theta))
    x = 2.0 * (theta - theta[0]) / (theta[-1] - theta[0]) - 1.0
    design = np.vstack((*(x**k for k in range(drift + 1)), turning.real, turning.imag))
    solved = np.linalg.solve(design @ design.T, design @ values)
    left = values - solved @ design
    noise = max(math.sqrt(float(left @ left) / (theta.size - design.shape[0])), resolution / math.sqrt(12.0))
    real, imaginary = solved[drift + 1 :].reshape(2, -1)
    phasors = real - 1j * imaginary
    # An amplitude of noise alone is Rayleigh's, each axis having this deviation.
    axis = noise * math.sqrt(2.0 / theta.size)
    threshold = axis * math.sqrt(2.0 * math.log(orders.size / _CHANCE))
    standing = counted & (np.abs(phasors) > threshold)
    kept, mean = orders[standing], float(np.mean(values))
    hidden = 2.0 * threshold if order is not None else 2.0 * math.sqrt(2.0) * noise
    if not kept.size:
        return Cogging(0.0, 0.0, hidden, kept.astype(float), np.zeros(0), mean, noise)
    fine = np.linspace(0.0, 2.0 * math.pi, int(_FINE * kept[-1]) + 1)
    # All orders known to be multiples of one repeat themselves within its period.
    fine = fine[: _FINE * int(kept[-1] // (order or 1)) + 1] if order else fine
    curve = np.real(phasors[standing] @ np.exp(1j * np.outer(kept, fine)))
    # Crest and trough are half a period or more apart, where noise is another.
    uncertainty = axis * math.sqrt(2.0 * kept.size)
    return Cogging(
        float(np.ptp(curve)), uncertainty, hidden, kept.astype(float), np.abs(phasors[standing]), mean, noise
    )


_Orders = tuple[NDArray[np.int64], NDArray[np.bool_], int]


def _whole(turns: float, readings: int, lowest: int, highest: int) -> _Orders:
    """Return the orders to fit over whole turns, which of them are cogging, and the degree of what drifts beside."""
    if turns < 0.98:
        raise EstimationError(
            f"the readings cover {turns:.2f} of a turn; without a known order cogging is that of a whole turn, turn further"
        )
    reach = min(highest, int(_SHARE * readings / max(turns, 1.0)))
    if reach < lowest:
        raise EstimationError(
            f"{readings} readings over {turns:.1f} turns show orders up to {reach} a turn, from {lowest} on they are cogging; "
            "take more readings"
        )
    orders = np.arange(1, reach + 1)
    return orders, orders >= lowest, 0


def _known(turns: float, readings: int, order: int) -> _Orders:
    """Return likewise an order and its multiples; run-out is a slow bend over a small part of a turn, else the first orders."""
    if turns * order < 2.0:
        raise EstimationError(
            f"the readings cover {turns * order:.1f} periods of cogging, two are needed; turn further"
        )
    multiples = min(_MULTIPLES, int(0.4 * readings / (turns * order)))
    if multiples < 1:
        raise EstimationError(f"{readings} readings over {turns * order:.1f} periods are too few; take more readings")
    own = order * np.arange(1, multiples + 1)
    if turns < _PART:
        return own, np.ones(multiples, dtype=bool), _BEND
    below = np.arange(1, min(_RUN_OUT + 1, order))
    return np.concatenate((below, own)), np.repeat([False, True], [below.size, multiples]), 0
