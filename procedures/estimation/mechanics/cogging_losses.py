"""Detects invalid torque readings of a slow turn: spikes, repeated values, an end of the range."""

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.mechanics.cogging_spectrum import OrderFit, Orders, Turn, solve, standing

#: A reading so many deviations from the fit is none of the shaft's; beyond this share of them nothing is told any more.
_WILD, _MOST_LOST = 6.0, 0.2
#: Readings that stand still so often while the torque goes on by more than so many of their deviations are frozen.
_FROZEN, _GOES_ON = 5, 4.0
#: So many readings at one extreme and above this share are looked at as cut off.
_CUT, _CUT_SHARE = 4, 0.01
#: Readings that all lie within so many steps of the sensor show its steps, and no wave.
_FEW_STEPS = 3.0
#: More than chance puts at an end once in so many records, beside the readings within so much of the noise below it, are cut off.
_BY_CHANCE, _BELOW = 1e-5, 2.0
#: Orders up to this may be run-out.
_LOW = 2


def gross(turn: Turn) -> NDArray[np.bool_]:
    """Return which readings, (n,), no torque that swings about a drag can be."""
    off = np.abs(turn.torque - float(np.median(turn.torque)))
    return np.asarray(off > _WILD * max(1.4826 * float(np.median(off)), turn.resolution))


def _few(orders: Orders, fitted: OrderFit) -> Orders:
    """Return the orders that stand out, with those that are not counted: of two turns at one place a fit of all believes neither."""
    stand = standing(fitted.phasors, fitted.axis, orders) | (orders.orders <= _LOW)
    return replace(orders, orders=orders.orders[stand], counted=orders.counted[stand])


def without_lost(turn: Turn, orders: Orders, extra: FloatArray | None) -> tuple[Turn, list[Finding]]:
    """Leave out spikes and readings that stand still while the torque goes on."""
    wild = gross(turn)
    for _ in range(6):
        few = _few(orders, solve(turn.without(wild), orders, extra))
        left = solve(turn.without(wild), few, extra).left
        spread = 1.4826 * float(np.median(np.abs(left[~wild])))
        again = np.abs(left) > _WILD * max(spread, turn.resolution)
        if np.array_equal(again, wild) or np.mean(again) > _MOST_LOST:
            break
        wild = again
    fitted = solve(turn.without(wild), few, extra)
    frozen = _frozen(turn, fitted)
    burst = _burst(wild)
    findings = []
    if np.any(burst):
        findings.append(Finding(Cause.UNEXPLAINED, Answer.WIDENED))
    count = int(np.sum((wild & ~burst) | frozen))
    if count:
        figures: dict[str, float | str] = {
            "record": "cogging",
            "count": float(count),
            "readings": float(turn.angle.size),
            "frozen": float(np.sum(frozen)),
        }
        answer = Answer.WITHHELD if count > _MOST_LOST * turn.angle.size else Answer.MODELLED
        findings.append(Finding(Cause.DROPOUTS, answer, figures=figures))
    lost = wild | frozen | burst
    return turn if np.mean(lost) > 0.5 else turn.without(lost), findings


def _burst(wild: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return where readings beside each other are wild, as no spike makes them, and as many to either side."""
    near = np.convolve(wild, np.ones(5), mode="same") >= 3.0
    edges = np.flatnonzero(np.diff(np.concatenate(([0], near.astype(int), [0]))))
    burst = np.zeros(wild.size, dtype=bool)
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        long = int(end - begin)
        burst[max(begin - long, 0) : end + long] = True
    return burst


def _frozen(turn: Turn, fitted: OrderFit) -> NDArray[np.bool_]:
    """Return which readings, (n,), repeat the one before them while the fit goes on."""
    frozen = np.zeros(turn.torque.size, dtype=bool)
    edges = np.flatnonzero(np.diff(turn.torque) != 0.0)
    begins, ends = np.concatenate(([0], edges + 1)), np.concatenate((edges + 1, [turn.torque.size]))
    for begin, end in zip(begins, ends, strict=True):
        moved = float(np.ptp(fitted.model[begin:end])) if end - begin >= _FROZEN else 0.0
        if moved > max(_GOES_ON * fitted.noise, 2.0 * turn.resolution):
            frozen[begin + 1 : end] = True
    return frozen


def _crowded(torque: FloatArray, end: float, resolution: float, noise: float) -> bool:
    """Return whether more readings lie at the end than chance puts there beside those within the noise below it."""
    below = end - torque
    at = int(np.sum(below <= 0.25 * resolution))
    near = int(np.sum((below > 0.25 * resolution) & (below <= _BELOW * noise)))
    cells = _BELOW * noise / max(resolution, 1e-9 * noise)
    return bool(cells > 1.0 and float(special.pdtrc(at - 1, max(near, 1) / cells)) < _BY_CHANCE)


def _standing_still(turn: Turn, share: float) -> Finding:
    """Return why so large a share of the readings are the same at an end of what was read."""
    span = float(np.ptp(turn.torque[turn.counting]))
    if span <= (_FEW_STEPS + 0.25) * turn.resolution:
        figures: dict[str, float | str] = {"record": "cogging", "span": span, "resolution": turn.resolution}
        return Finding(Cause.TOO_COARSE, Answer.WITHHELD, figures=figures)
    return Finding(Cause.CLIPPED, Answer.WITHHELD, figures={"channel": "torque", "lost": share})


def without_cut(turn: Turn, orders: Orders, extra: FloatArray | None) -> tuple[Turn, list[Finding]]:
    """Leave out, by the fit's value, what lies beyond an end at which the readings stand."""
    findings: list[Finding] = []
    for sign in (1.0, -1.0):
        kept = turn.counting
        end = float(np.max(sign * turn.torque[kept]))
        at = kept & (sign * turn.torque >= end - 0.25 * turn.resolution)
        if int(np.sum(at)) < max(_CUT, _CUT_SHARE * int(np.sum(kept))):
            continue
        if np.mean(at) > 0.45:
            return turn, [*findings, _standing_still(turn, float(np.mean(at)))]
        if end == 0.0 and not np.any(at[1:] & at[:-1]):
            # A range ends at no torque for longer than a reading; a sensor that drops out gives single zeros.
            figures: dict[str, float | str] = {
                "record": "cogging",
                "count": float(np.sum(at)),
                "readings": float(at.size),
            }
            findings.append(Finding(Cause.DROPOUTS, Answer.MODELLED, figures={**figures, "frozen": 0.0}))
            turn = turn.without(at)
            continue
        lost = at
        few = _few(orders, solve(turn, orders, extra))
        for _ in range(3):
            fitted = solve(turn.without(lost), few, extra)
            lost = at | (kept & (sign * fitted.model > end + 0.5 * turn.resolution))
        beyond = sign * fitted.model[at] - end
        reached = float(np.mean(beyond)) >= 0.5 * turn.resolution + 4.0 * fitted.noise / math.sqrt(float(np.sum(at)))
        if not (reached or _crowded(sign * turn.torque[kept], end, turn.resolution, fitted.noise)):
            continue
        share = float(np.mean(lost))
        answer = Answer.WITHHELD if share > _MOST_LOST else Answer.WIDENED
        findings.append(Finding(Cause.CLIPPED, answer, figures={"channel": "torque", "lost": share}))
        turn = turn.without(lost)
    return turn, findings
