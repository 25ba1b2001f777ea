"""Cogging that was read at two speeds: what is of the shaft's angle stays, a filter passes more of it, and a vibration moves."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.checks import positive, same_length, series
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import NO_MISFIT, Answer, Cause, Finding, Misfit
from procedures.estimation.mechanics.cogging import Cogging

#: Orders nearer to a larger one than this, or beyond so many, are not read again; nor any smaller than this share of the largest.
_APART, _MOST, _SMALL = 4.0, 3, 0.1
#: Periods and bins that a part has to hold, and the largest part, in turns.
_PERIODS, _BINS, _LARGEST = 4.0, 1.5, 0.5
#: A ratio counts beyond so many standard deviations, and beyond this share.
_BEYOND, _MARGIN = 4.0, 0.05
#: A wave that is new at half the speed counts from this share of the largest order on.
_NEW = 0.3
#: Below this ratio an order is not that of the angle; up to this one a filter's share is made up for.
_GONE, _READABLE = 0.5, 1.6
#: A ratio as large as this is that of a filter too slow for its time constant to be told.
_NEXT_TO_TWICE = 1.95
_DRIFT = 3
#: No more of an order is made up for than 1 over this.
_LEAST_LEFT = 0.2
#: Further waves of the second record, sought up to so many times the highest order.
_WAVES, _WIDE = 2, 5.0


@dataclass(frozen=True)
class AtHalfSpeed:
    """What half the speed tells of a cogging torque: the `factor` on what was found, known to ± `limit`, up to how much `more` there may
    be, peak to peak (N·m), and the `misfit`.
    """

    factor: float = 1.0
    limit: float = 0.0
    more: float = 0.0
    misfit: Misfit = NO_MISFIT


def read_again(orders: FloatArray, amplitudes: FloatArray) -> FloatArray:
    """Return the orders (k,) worth reading again, the largest first, of those that were found with their `amplitudes` (N·m)."""
    chosen: list[float] = []
    for k in np.argsort(amplitudes)[::-1]:
        apart = all(abs(orders[k] - other) >= _APART for other in chosen)
        if apart and len(chosen) < _MOST and amplitudes[k] >= _SMALL * np.max(amplitudes):
            chosen.append(float(orders[k]))
    return np.array(chosen)


def part_of_turn(orders: FloatArray) -> float:
    """Return the part of a turn that tells these orders (k,) from each other and from a drift."""
    gaps = np.diff(np.sort(orders))
    bins = _BINS / float(np.min(gaps)) if gaps.size else 0.0
    return float(min(max(_PERIODS / float(np.min(orders)), bins), _LARGEST))


def compare(
    found: tuple[ArrayLike, ArrayLike],
    again: tuple[ArrayLike, ArrayLike],
    orders: ArrayLike,
    fit: Cogging,
    speed: float,
    averaging: float,
    torque_filter: float = 0.0,
) -> AtHalfSpeed:
    """Compare a record (angle in rad, torque in N·m) at a `speed` (rad/s) with a part of a turn that was read at half of it.

    `orders` are those to look at, the largest first, of all that the first record's `fit` shows. Up to `averaging` (s) of the transducer's
    own mean is expected, or a `torque_filter` (s) that is stated. Raises EstimationError for records that cannot be compared.
    """
    wanted, rate = series("orders", orders, least=1), positive("speed", speed, "rad/s")
    angle, torque = _checked("first", found)
    slow = _checked("second", again)
    part = abs(float(slow[0][-1] - slow[0][0]))
    count = max(int(abs(float(angle[-1] - angle[0])) / part + 0.05), 1)
    number = np.minimum((np.abs(angle - angle[0]) / abs(float(angle[-1] - angle[0])) * count).astype(int), count - 1)
    parts = [_amplitudes(angle[number == k], torque[number == k], wanted) for k in range(count)]
    amplitudes, noises = (np.array([each[k] for each in parts]) for k in (0, 1))
    others = _others(*slow, wanted)
    everything, noise = _amplitudes(*slow, np.concatenate((wanted, others)))
    there, there_noise = everything[: wanted.size], noise[: wanted.size]
    whole = np.mean(amplitudes, axis=0)
    # The slow part is another place of the turn: it may differ as much as the places of the first record do.
    places = np.std(amplitudes, axis=0, ddof=1) if count > 1 else np.zeros(wanted.size)
    sigma = np.sqrt(places**2 * (1.0 + 1.0 / count) + there_noise**2 + np.mean(noises**2, axis=0) / count) / whole
    ratios = there / whole
    for order, ratio, doubt in zip(wanted, ratios, sigma, strict=True):
        if ratio + _BEYOND * doubt < _GONE:
            figures: dict[str, float | str] = {"record": "cogging", "order": float(order), "share": float(ratio)}
            figures["frequency"] = float(order) * rate / (2.0 * math.pi)
            finding = Finding(Cause.VIBRATION, Answer.WITHHELD, score=float((1.0 - ratio) / doubt), figures=figures)
            return AtHalfSpeed(misfit=Misfit((finding,)))
    for order, amplitude, doubt in zip(others, everything[wanted.size :], noise[wanted.size :], strict=True):
        new = np.min(np.abs(order - fit.orders)) >= _APART
        if new and amplitude > max(_NEW * float(whole[0]), _BEYOND * doubt):
            figures = {"record": "cogging-half", "order": float(order), "amplitude": float(amplitude)}
            figures["frequency"] = 0.5 * float(order) * rate / (2.0 * math.pi)
            finding = Finding(Cause.VIBRATION, Answer.WIDENED, score=float(amplitude / doubt), figures=figures)
            return AtHalfSpeed(more=2.0 * float(amplitude), misfit=Misfit((finding,)))
    order, ratio, doubt = float(wanted[0]), float(ratios[0]), float(sigma[0])
    expected = _expected(order * rate, averaging, torque_filter)
    if ratio - _BEYOND * doubt < expected + _MARGIN:
        return AtHalfSpeed()
    return _filtered(order, rate, ratio, doubt, fit)


def _filtered(order: float, speed: float, ratio: float, doubt: float, fit: Cogging) -> AtHalfSpeed:
    """Return how much a filter takes away that lets through `ratio` times as much of an order at half the speed: of first order, or a
    mean. Higher orders lose more.
    """
    lags = _lags(ratio)
    figures: dict[str, float | str] = {"record": "cogging", "time_constant": lags / (order * speed), "order": order}
    figures["share"] = 1.0 - 1.0 / math.hypot(1.0, lags)
    answer = Answer.MODELLED if ratio + doubt <= _READABLE else Answer.WITHHELD
    misfit = Misfit((Finding(Cause.TORQUE_FILTER, answer, score=(ratio - 1.0) / doubt, figures=figures),))
    if answer is Answer.WITHHELD:
        return AtHalfSpeed(misfit=misfit)
    over = fit.orders / order
    bounds = []
    for seen in (max(ratio + way * 2.0 * doubt, 1.0) for way in (-1.0, 1.0)):
        # A mean takes away everything of some orders: what is left of these is noise.
        half = _half_turn(seen) * over
        mean = np.maximum(np.abs(np.sinc(half / math.pi)), _LEAST_LEFT) * np.exp(-1j * half)
        first_order = 1.0 / (1.0 + 1j * _lags(seen) * over)
        bounds += [fit.before(np.asarray(each, dtype=np.complex128)) for each in (first_order, mean)]
    low, high = min(bounds) / fit.peak_to_peak, max(bounds) / fit.peak_to_peak
    return AtHalfSpeed(0.5 * (low + high), 0.5 * (high - low), misfit=misfit)


def _lags(ratio: float) -> float:
    """Return an order's rate times the time constant of a first-order filter that lets `ratio` times as much through at half the rate."""
    seen = min(ratio, _NEXT_TO_TWICE)
    return math.sqrt((seen**2 - 1.0) / (1.0 - 0.25 * seen**2))


def _half_turn(ratio: float) -> float:
    """Return half the angle (rad) over which a mean is taken that lets `ratio` times as much through at half the rate."""
    return 2.0 * math.acos(1.0 / ratio)


def _expected(rate: float, averaging: float, torque_filter: float) -> float:
    """Return by how much more the transducer lets through at half of an order's `rate` (rad/s)."""
    if torque_filter:
        return math.hypot(1.0, rate * torque_filter) / math.hypot(1.0, 0.5 * rate * torque_filter)
    half = min(0.25 * rate * averaging, 0.45 * math.pi)
    return 1.0 / math.cos(half)


def _checked(name: str, record: tuple[ArrayLike, ArrayLike]) -> tuple[FloatArray, FloatArray]:
    angle, torque = series(f"{name} angle", record[0], least=16), series(f"{name} torque", record[1], least=16)
    same_length(angle=angle, torque=torque)
    return angle, torque


def _others(angle: FloatArray, torque: FloatArray, orders: FloatArray) -> FloatArray:
    """Return the strongest waves (m,), in periods a turn, beside the orders: what does not go with the angle is elsewhere now."""
    bin_width = 2.0 * math.pi / abs(float(angle[-1] - angle[0]))
    grid = np.arange(_DRIFT * bin_width, _WIDE * float(np.max(orders)), 0.25 * bin_width)
    seen = orders
    for _ in range(_WAVES):
        left = torque - _fitted(angle, torque, seen)[0]
        free = grid[np.min(np.abs(grid[:, None] - seen[None, :]), axis=1) > bin_width]
        power = np.abs(np.exp(-1j * np.outer(free, angle)) @ left)
        seen = np.append(seen, free[int(np.argmax(power))])
    return seen[orders.size :]


def _fitted(angle: FloatArray, torque: FloatArray, orders: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the fit of orders beside a drift, its design (n, m), and what it solved (m,)."""
    along = np.interp(angle, (angle.min(), angle.max()), (-1.0, 1.0))
    waves = np.outer(orders, angle)
    design = np.vstack((along ** np.arange(_DRIFT + 1)[:, None], np.cos(waves), np.sin(waves))).T
    solved, *_ = np.linalg.lstsq(design, torque, rcond=None)
    return design @ solved, design, solved


def _amplitudes(angle: FloatArray, torque: FloatArray, orders: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the orders' amplitudes (N·m, shape (k,)) beside a drift, and their standard uncertainties from the scatter."""
    model, design, solved = _fitted(angle, torque, orders)
    left = torque - model
    noise = float(np.sqrt(left @ left / max(angle.size - design.shape[1], 1)))
    first, second = np.split(solved[_DRIFT + 1 :], 2)
    spread = np.sqrt(np.diag(np.linalg.pinv(design.T @ design)))[_DRIFT + 1 :].reshape(2, -1)
    return np.hypot(first, second), noise * np.sqrt(np.mean(spread**2, axis=0))
