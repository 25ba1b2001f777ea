"""Disturbances in the torque of a slow turn, beside the part that repeats, and their effect on the cogging torque."""

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import special

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.fitting.noise import MAINS
from procedures.estimation.mechanics.cogging_losses import gross, without_cut, without_lost
from procedures.estimation.mechanics.cogging_modulation import modulated
from procedures.estimation.mechanics.cogging_spectrum import (
    OrderFit,
    Orders,
    Turn,
    coloured,
    peak_to_peak,
    powers,
    solve,
    square_left,
    standing,
)

#: A term is taken into the model where chance alone does as much once in so many records, three terms at most.
_CHANCE, _TERMS = 2e-4, 3
#: A wave that repeats itself otherwise counts where chance shows it once in so many records.
_LINE = 1e-3
#: One that chance shows in one of so many asks for another scale of the angle.
_DOUBT = 0.1
#: Uncertainties of the orders beyond so many times those of readings all round the turn: too many are gone in one place.
_GAP = 3.0
#: How far (share) a speed's scale may be off, and by how much of it the angle is searched.
_SCALE, _SCALES = 0.02, 41
#: A wave beside the order given, larger than this share of what was found, says that the order is another.
_ANOTHER = 0.5
#: Parts left out in turn once anything was found, the factor on what that changes, and the most that an interval takes (share).
_PARTS, _UNLIKE, _LIMIT = 5, 1.5, 0.2
#: A filter that leaves less than this share cannot be undone.
_LEFT = 0.3

_Taken = dict[Cause, FloatArray]


@dataclass(frozen=True)
class Seen:
    """The fit that the readings ask for and their `misfit`; `beside` (N·m) is the amplitude of a wave of another order, `unrepeated`
    (N·m) by how much the peak-to-peak value differs between parts of the way beyond chance, or of the turn.
    """

    solved: OrderFit
    misfit: Misfit
    beside: float
    unrepeated: float


def examine(turn: Turn, orders: Orders) -> Seen:
    """Fit a turn, and put into the model or tell what does not belong to what repeats itself."""
    # Hum first, and the angle's scale before single readings are judged: by an angle that is wrong all of them are wild.
    rough = turn.without(gross(turn))
    taken, hum = _with_hum(rough, orders)
    turn = replace(turn, angle=_scaled(rough, orders, _rows(taken)).angle)
    turn, findings = without_lost(turn, orders, _rows(taken))
    turn, cut = without_cut(turn, orders, _rows(taken))
    findings += cut
    turn = _warped(turn, orders, _rows(taken), 1)
    turn, taken, more = _with_terms(turn, orders, taken)
    extra = _rows(taken)
    solved = solve(turn, orders, extra)
    power = powers(turn, solved, orders.between)
    beside, line = _beside(turn, orders, solved, power)
    share, uneven = modulated(turn, orders, solved)
    findings += [*hum, *more, *line, *uneven]
    even = solved.noise * math.sqrt(2.0 / float(np.sum(turn.counting)))
    if findings and float(np.median(solved.axis[orders.counted])) > _GAP * even:
        findings.append(Finding(Cause.UNEXPLAINED, Answer.WITHHELD))
    solved = coloured(solved, orders, power)
    unrepeated = 0.0
    if findings and np.any(standing(solved.phasors, solved.axis, orders)):
        unrepeated, unlike = _unlike(turn, orders, solved, extra)
        findings += unlike
    if share:
        stand = standing(solved.phasors, solved.axis, orders)
        whole = peak_to_peak(orders.orders[stand], solved.phasors[stand], int(orders.step))
        unrepeated = math.hypot(unrepeated, share * whole)
    return Seen(solved, Misfit.together((Misfit(tuple(findings)),)), beside, unrepeated)


def blurred(
    orders: NDArray[np.int64], phasors: NDArray[np.complex128], passed: NDArray[np.complex128], torque_filter: float
) -> Misfit:
    """Return that a filter of the torque takes away so much of the largest order that it cannot be undone, where it does.

    `passed` are the factors that undo it.
    """
    if not orders.size:
        return Misfit()
    largest = int(np.argmax(np.abs(phasors / passed)))
    share = 1.0 / abs(complex(passed[largest]))
    if share > _LEFT:
        return Misfit()
    figures: dict[str, float | str] = {
        "record": "cogging",
        "time_constant": torque_filter,
        "share": 1.0 - share,
        "order": float(orders[largest]),
    }
    return Misfit((Finding(Cause.TORQUE_FILTER, Answer.WITHHELD, figures=figures),))


def _with_hum(turn: Turn, orders: Orders) -> tuple[_Taken, list[Finding]]:
    """Return the mains hum that the readings' instants show."""
    if turn.time is None:
        return {}, []
    fitted = solve(turn, orders)
    best = max(((_falls(turn, fitted, rows), mains, rows) for mains, rows in _hums(turn)), key=lambda each: each[0])
    if float(special.chdtrc(2, best[0])) > _CHANCE:
        return {}, []
    fell, mains, rows = best
    kept = turn.counting
    across = rows[:, kept] - (rows @ fitted.basis.T) @ fitted.basis[:, kept]
    both, *_ = np.linalg.lstsq(across.T, fitted.left[kept], rcond=None)
    figures: dict[str, float | str] = {"record": "cogging", "frequency": mains, "amplitude": float(np.hypot(*both))}
    return {Cause.HUM: rows}, [Finding(Cause.HUM, Answer.MODELLED, score=math.sqrt(fell), figures=figures)]


def _hums(turn: Turn) -> list[tuple[float, FloatArray]]:
    """Return the mains frequencies (Hz) with their rows (2, n)."""
    time = turn.time if turn.time is not None else np.zeros(0)
    swings = [2.0 * math.pi * mains * (time - time[0]) for mains in MAINS]
    return [(mains, np.vstack((np.cos(s), np.sin(s)))) for mains, s in zip(MAINS, swings, strict=True)]


def _rows(taken: _Taken) -> FloatArray | None:
    """Return all further rows of the model, (m, n)."""
    return np.vstack([*taken.values()]) if taken else None


def _scaled(turn: Turn, orders: Orders, extra: FloatArray | None) -> Turn:
    """Return the turn with the angle's scale that the readings fit best: a speed's reading is known to some per cent only."""
    plain = solve(turn, orders, extra)
    power = powers(turn, plain, orders.between)
    if power.size and float(np.max(power)) > math.log(power.size / _DOUBT):
        way = turn.angle - turn.angle[0]
        # Half a radian of the highest order at the end from one trial to the next.
        count = min(_SCALES, 2 * math.ceil(2.0 * _SCALE * float(orders.orders[-1]) * abs(float(way[-1]))) + 1)
        scales = np.linspace(-_SCALE, _SCALE, count)
        tried = [square_left(turn.turned(s * way), orders, extra) for s in scales]
        if plain.square - min(tried) > 16.0 * plain.noise**2:
            turn = turn.turned(float(scales[int(np.argmin(tried))]) * way)
    return _warped(turn, orders, extra, 1)


def _warped(turn: Turn, orders: Orders, extra: FloatArray | None, degree: int) -> Turn:
    """Return the turn with its angle bent by a polynomial of the way, by Gauss and Newton's method."""
    if orders.whole and orders.drift == 0:
        return turn
    fitted = solve(turn, orders, extra)
    for _ in range(6):
        if not np.any(standing(fitted.phasors, fitted.axis, orders)):
            return turn
        rows = _bends(turn, degree)
        kept = turn.counting
        slopes = rows * fitted.slope
        across = slopes[:, kept] - (slopes @ fitted.basis.T) @ fitted.basis[:, kept]
        step, *_ = np.linalg.lstsq(across.T, fitted.left[kept], rcond=None)
        further = turn.turned(step @ rows)
        again = solve(further, orders, extra)
        if again.square >= fitted.square * (1.0 - 1e-6):
            return turn
        turn, fitted = further, again
    return turn


def _bends(turn: Turn, degree: int) -> FloatArray:
    """Return the powers of the way, (degree, n), that a shaft may be ahead by."""
    return np.vstack([turn.along**k for k in range(1, degree + 1)])


def _with_terms(turn: Turn, orders: Orders, taken: _Taken) -> tuple[Turn, _Taken, list[Finding]]:
    """Take into the model what else the residuals show: a drift that bends, a speed that is not even."""
    findings: list[Finding] = []
    for _ in range(_TERMS):
        fitted = solve(turn, orders, _rows(taken))
        told = {finding.cause for finding in findings}
        falls = [
            (_falls(turn, fitted, rows), cause, rows)
            for cause, rows in _candidates(turn, orders, fitted)
            if cause not in told
        ]
        likely = [one for one in falls if float(special.chdtrc(one[2].shape[0], one[0])) < _CHANCE]
        if not likely:
            break
        fell, cause, rows = max(likely, key=lambda one: one[0])
        if cause is Cause.UNEVEN_SPEED:
            turn = _warped(turn, orders, _rows(taken), 4)
        else:
            taken = {**taken, cause: rows}
        findings.append(Finding(cause, Answer.MODELLED, score=math.sqrt(fell)))
    return turn, taken, findings


def _candidates(turn: Turn, orders: Orders, fitted: OrderFit) -> list[tuple[Cause, FloatArray]]:
    """Return what may lie beside what repeats itself, with its rows (m, n)."""
    if orders.whole and orders.drift == 0:
        # One turn alone: what bends slowly is not to be told from its orders.
        return []
    rows = [(Cause.SLOPE, np.vstack([turn.along ** (orders.drift + k) for k in (1, 2)]))]
    if np.any(standing(fitted.phasors, fitted.axis, orders)):
        rows.append((Cause.UNEVEN_SPEED, _bends(turn, 4)[1:] * fitted.slope))
    return rows


def _falls(turn: Turn, fitted: OrderFit, rows: FloatArray) -> float:
    """Return by how much rows (m, n) in the model would lower the sum of squares, in that of the noise without them."""
    kept = turn.counting
    across = rows[:, kept] - (rows @ fitted.basis.T) @ fitted.basis[:, kept]
    length = np.sqrt(np.sum(across**2, axis=1))
    told = length > 1e-3 * np.sqrt(np.sum(rows[:, kept] ** 2, axis=1))
    if not np.any(told):
        return 0.0
    orthogonal, _ = np.linalg.qr((across[told] / length[told, None]).T)
    square = float(np.sum((orthogonal.T @ fitted.left[kept]) ** 2))
    freedom = max(int(np.sum(kept)) - fitted.basis.shape[0] - rows.shape[0], 1)
    rest = max((fitted.square - square) / freedom, turn.resolution**2 / 12.0, 1e-300)
    return float(square / rest)


def _beside(turn: Turn, orders: Orders, solved: OrderFit, power: FloatArray) -> tuple[float, list[Finding]]:
    """Return the amplitude (N·m) of a wave between the orders that stands out, and what is told of it."""
    if not power.size:
        return 0.0, []
    strongest = int(np.argmax(power))
    if float(power[strongest]) < math.log(power.size / _LINE):
        return 0.0, []
    amplitude = solved.noise * math.sqrt(4.0 * float(power[strongest]) / float(np.sum(turn.counting)))
    stand = standing(solved.phasors, solved.axis, orders)
    found = float(np.max(np.abs(solved.phasors[stand]))) if np.any(stand) else 0.0
    figures: dict[str, float | str] = {
        "record": "cogging",
        "order": _finer(turn, solved, float(orders.between[strongest])),
        "amplitude": amplitude,
    }
    score = math.sqrt(2.0 * float(power[strongest]))
    if orders.whole:
        return 0.0, [Finding(Cause.UNEXPLAINED, Answer.WIDENED, score=score)]
    answer = Answer.WITHHELD if amplitude > _ANOTHER * found else Answer.WIDENED
    return amplitude, [Finding(Cause.WRONG_PERIOD, answer, score=score, figures=figures)]


def _finer(turn: Turn, solved: OrderFit, order: float) -> float:
    """Return where about an order, within a bin, the residuals' power is largest."""
    turns = abs(float(turn.angle[-1] - turn.angle[0])) / (2.0 * math.pi)
    near = order + np.linspace(-1.0, 1.0, 41) / turns
    return float(near[int(np.argmax(powers(turn, solved, near)))])


def _unlike(turn: Turn, orders: Orders, solved: OrderFit, extra: FloatArray | None) -> tuple[float, list[Finding]]:
    """Return by how much (N·m) the figure changes beyond chance where a part of the way is left out, and whether that is too much."""
    stand = standing(solved.phasors, solved.axis, orders)
    few = replace(orders, orders=orders.orders[stand], counted=np.ones(int(np.sum(stand)), dtype=bool))
    order = int(orders.step) if not orders.whole else None
    figures, expected = [], 0.0
    for part in range(_PARTS):
        out = np.floor((turn.along + 1.0) * 0.5 * _PARTS).astype(int).clip(0, _PARTS - 1) == part
        again = solve(turn.without(out), few, extra)
        figures.append(peak_to_peak(few.orders, again.phasors, order))
        expected += 2.0 * float(np.sum(again.axis**2)) / _PARTS / (_PARTS - 1)
    whole = peak_to_peak(few.orders, solve(turn, few, extra).phasors, order)
    spread = float(np.mean((np.array(figures) - whole) ** 2))
    excess = _UNLIKE * math.sqrt(max(0.0, spread - expected) * (_PARTS - 1))
    if 2.0 * excess > _LIMIT * whole:
        return excess, [Finding(Cause.UNEXPLAINED, Answer.WITHHELD)]
    return excess, []
