"""Cogging torque from readings of a slowly, evenly turned shaft."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from procedures.estimation.fitting.checks import positive, same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Misfit
from procedures.estimation.mechanics.cogging_causes import blurred, examine
from procedures.estimation.mechanics.cogging_spectrum import Orders, Turn, peak_to_peak, standing

#: Orders up to this one are looked at.
_HIGHEST_ORDER = 400
#: At most so many orders of all that the readings could show are looked at: the rest tells the noise.
_SHARE = 0.3
#: Of a known order so many multiples are looked at, and what drifts over a part of a turn is a polynomial of this degree and so many
#: more for a whole turn: run-out of twice a turn is in it.
_MULTIPLES, _BEND, _BENDS = 3, 3, 9
#: From this part of a turn on, run-out is told by its own orders, up to the second.
_PART, _RUN_OUT = 0.5, 2
#: From so many turns on a drift is told from what repeats itself, and so is all else that does not.
_AGAIN = 1.2
#: Readings for each of the highest order looked at, and in all, that a record with many more keeps: more only take time and memory.
_READINGS, _FEWEST = 8, 4096


@dataclass(frozen=True)
class Cogging:
    """Torque that repeats itself every turn: `peak_to_peak` (N·m) with its standard `uncertainty` from the scatter.

    `orders` (k,) periods a turn that stand out of the noise and their `phasors` (k,), N·m; without any, `peak_to_peak` is 0.
    `hidden` (N·m, peak to peak) is what the scatter may hide: where the order is not known, one so high that it looks like noise, else
    the order's multiples. `above` (N·m) is by how much more an order beside the known one may make it. `mean` (N·m) is the drag that
    all this lies upon, `noise` (N·m) one reading's scatter; `misfit` what the readings show beyond all this.
    """

    peak_to_peak: float
    uncertainty: float
    hidden: float
    orders: FloatArray
    phasors: NDArray[np.complex128]
    mean: float
    noise: float
    above: float = 0.0
    misfit: Misfit = NO_MISFIT

    @property
    def amplitudes(self) -> FloatArray:
        """Amplitudes (k,) of the orders, N·m."""
        return np.abs(self.phasors)

    def before(self, passed: NDArray[np.complex128]) -> float:
        """Return the peak-to-peak torque (N·m) before something that let the orders through by these factors (k,)."""
        return peak_to_peak(self.orders.astype(int), self.phasors / passed, None)


def fit_cogging(
    angle: ArrayLike,
    torque: ArrayLike,
    *,
    time: ArrayLike | None = None,
    order: int | None = None,
    lowest_order: int = 6,
    resolution: float = 0.0,
    torque_filter: float = 0.0,
) -> Cogging:
    """Return the torque that repeats itself over a turn, from readings (N·m) at mechanical angles (rad).

    `order` is its periods a turn: then some periods suffice, and its multiples are looked at. Without it the readings cover
    whole turns, two for what does not repeat itself to be seen; orders below `lowest_order` are a coupling's run-out and not the
    magnets'. `time` (s) of the readings shows mains hum and undoes a first-order `torque_filter` (s). `resolution` (N·m) is one step
    of the readings. Raises EstimationError on less than a turn (or than two periods) or too few readings.
    """
    theta, values = series("angle", angle, least=16), series("torque", torque, least=16)
    same_length(angle=theta, torque=values)
    times = None if time is None else series("time", time, least=16)
    turns = abs(float(theta[-1] - theta[0])) * theta.size / (theta.size - 1) / (2.0 * math.pi)
    orders = (
        _whole(turns, theta.size, lowest_order, _HIGHEST_ORDER)
        if order is None
        else _known(turns, theta.size, int(positive("order", order, "")))
    )
    block = _block(theta.size, turns, float(orders.orders[-1]))
    seen = examine(
        Turn(_means(theta, block), _means(values, block), None if times is None else _means(times, block), resolution),
        orders,
    )
    solved = seen.solved
    speed = abs(float(theta[-1] - theta[0])) / float(times[-1] - times[0]) if times is not None else 0.0
    passed = np.asarray(1.0 + 1j * orders.orders * speed * torque_filter, dtype=np.complex128)
    # The means of blocks lost some of the orders.
    left_by_means = np.sinc(orders.orders * turns * block / theta.size) / np.sinc(orders.orders * turns / theta.size)
    phasors, axis = solved.phasors * passed / left_by_means, solved.axis * np.abs(passed) / left_by_means
    stand = standing(solved.phasors, solved.axis, orders)
    kept, mean = orders.orders[stand], float(np.mean(values))
    beside, noise = 2.0 * seen.beside, solved.noise * math.sqrt(block)
    # Where no order is known, any beyond those looked at is scatter.
    unseen = math.sqrt(2.0) * solved.noise if order is None else float(np.max(axis[orders.counted])) * orders.least
    result = Misfit.together((seen.misfit, blurred(orders.orders[stand], phasors[stand], passed[stand], torque_filter)))
    if not kept.size:
        none = np.zeros(0)
        return Cogging(0.0, 0.0, 2.0 * unseen + beside, none, none.astype(complex), mean, noise, 0.0, result)
    # Beside an order that is seen, its multiples may lie within their noise; where the last one looked at stands out, others follow it.
    missed = (
        phasors[orders.counted & (~stand | (orders.orders == orders.orders[-1]))]
        if order is not None
        else np.array([unseen])
    )
    return Cogging(
        peak_to_peak(kept, phasors[stand], order),
        # Crest and trough are half a period or more apart, where noise is another.
        math.hypot(math.sqrt(2.0 * float(np.sum(axis[stand] ** 2))), seen.unrepeated),
        2.0 * float(np.sqrt(np.sum(np.abs(missed) ** 2))),
        kept.astype(float),
        phasors[stand],
        mean,
        noise,
        beside,
        result,
    )


def _block(readings: int, turns: float, highest: float) -> int:
    """Return how many neighbouring readings are averaged."""
    return max(int(min(readings / (turns * highest * _READINGS), readings / _FEWEST)), 1)


def _means(values: FloatArray, block: int) -> FloatArray:
    """Return the means of blocks of readings; what is left over at the end belongs to none."""
    return np.asarray(values[: values.size // block * block].reshape(-1, block).mean(axis=1))


def _whole(turns: float, readings: int, lowest: int, highest: int) -> Orders:
    """Return the orders to fit over whole turns, and which of them are cogging."""
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
    again = turns >= _AGAIN
    between = orders.astype(np.float64) + 0.5 if again else np.zeros(0)
    return Orders(orders, orders >= lowest, 1 if again else 0, between, 1.0, whole=True)


def _known(turns: float, readings: int, order: int) -> Orders:
    """Return likewise an order and its multiples; run-out is a slow bend over a small part of a turn, else the first orders."""
    if turns * order < 2.0:
        raise EstimationError(
            f"the readings cover {turns * order:.1f} periods of cogging, two are needed; turn further"
        )
    multiples = min(_MULTIPLES, int(0.4 * readings / (turns * order)))
    if multiples < 1:
        raise EstimationError(f"{readings} readings over {turns * order:.1f} periods are too few; take more readings")
    own = order * np.arange(1, multiples + 1)
    bend = _BEND + math.ceil(_BENDS * turns)
    # What a polynomial of the drift's degree takes up, and what lies beside the multiples by a bin or more.
    bins = np.arange(bend, max(int(turns * order * (multiples + 0.5)), bend)) / turns
    between = bins[np.min(np.abs(bins[:, None] - own[None, :]), axis=1) > 0.99 / turns]
    if turns < _PART:
        return Orders(own, np.ones(multiples, dtype=bool), bend, between, float(order))
    below = np.arange(1, min(_RUN_OUT + 1, order))
    between = between[between > _RUN_OUT + 0.99 / turns]
    counted = np.repeat([False, True], [below.size, multiples])
    return Orders(np.concatenate((below, own)), counted, 1, between, float(order))
