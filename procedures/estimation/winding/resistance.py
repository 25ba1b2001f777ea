"""Stator resistance from line readings, its temperature, and the slope of voltage over current (§3.2)."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Generic, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from procedures.estimation.fitting.checks import Number, estimate_of, positive, same_length, series
from procedures.estimation.fitting.fit import EstimationError, Fit, FloatArray
from procedures.estimation.fitting.linear import least_squares
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.winding.connections import Connection, ReadingConnection, phase_factor
from procedures.estimation.winding.self_heating import allowed_for_heating

#: Copper's temperature coefficient (1/K) and the temperature (°C) at which it holds.
COPPER, COPPER_REFERENCE = 0.00393, 20.0
_SLOPE = ("resistance", "offset", "meter")
#: A voltage drifts where chance alone would do so in this share of records, and so many readings more are left over.
_CHANCE, _LEAST_FREEDOM = 1e-3, 3
#: A drift of which more than this share is its own is seen in the readings.
_SHOWN = 0.1
#: Currents that are nearer (share of the largest) are one level, set again.
_SAME_LEVEL = 0.02
#: At more levels than this one of them has little weight.
_MOST_LEVELS = 8
#: A reading below this share of the largest current is one without a current.
_NONE = 1e-3
#: Readings over for a voltage that bends, and how much more χ² another shape may leave to be as likely.
_LEAST_TO_BEND, _RIVALS = 2, 12.0
#: A shape of which less than this share is its own is the rest of the design.
_TOLD_APART = 1e-6
#: What chance makes of the square of the largest of several scores does not count.
_BY_CHANCE = 4.0
#: Readings agree within this share of the largest; a resistance that one of them moves by more than that is not given.
_AGREE, _MOST_SHIFT = 2e-4, 0.05
#: Scores beyond this are as good as certain, and not infinite.
_MOST = 40.0


class PhaseResistance(NamedTuple, Generic[Number]):
    """Mean resistance (Ω) of a winding, and of one leg of the equivalent wye."""

    winding: Number
    y_equivalent: Number

    def at_temperature(
        self, measured_at: Number | float, to: float, coefficient: float = COPPER, reference: float = COPPER_REFERENCE
    ) -> "PhaseResistance[Number]":
        """Refer both to another temperature (°C), as `at_temperature` does."""
        winding, y_equivalent = (at_temperature(each, measured_at, to, coefficient, reference) for each in self)
        return PhaseResistance(winding, y_equivalent)


def phase_resistances(ab: Number, bc: Number, ca: Number, connection: Connection) -> tuple[Number, Number, Number]:
    """Solve three line-to-line values (Ω) for the three windings: A, B, C of a wye; AB, BC, CA of a delta.

    Raises EstimationError where no three positive resistances give such values.
    """
    for name, value in (("R_AB", ab), ("R_BC", bc), ("R_CA", ca)):
        positive(name, value, "Ω")
    a, b, c = (ab + ca - bc) / 2, (ab + bc - ca) / 2, (bc + ca - ab) / 2
    if not (a > 0 and b > 0 and c > 0):
        raise EstimationError(
            f"R_AB = {estimate_of(ab):g}, R_BC = {estimate_of(bc):g}, R_CA = {estimate_of(ca):g} Ω: one exceeds the sum of the "
            "other two, which no winding does; check contacts and leads and read again"
        )
    phase_factor(connection, ReadingConnection.LINE_TO_LINE)
    if connection == "wye":
        return a, b, c
    products = a * b + b * c + c * a
    return products / c, products / a, products / b


def from_lines(ab: Number, bc: Number, ca: Number, connection: Connection) -> PhaseResistance[Number]:
    """Return winding and equivalent-wye resistance (Ω) from the mean of three line readings (Ω; §3.2.2, erratum E8).

    Raises EstimationError where a reading is not above zero.
    """
    for name, value in (("R_AB", ab), ("R_BC", bc), ("R_CA", ca)):
        positive(name, value, "Ω")
    factor = phase_factor(connection, ReadingConnection.LINE_TO_LINE)
    mean = (ab + bc + ca) / 3
    return PhaseResistance(factor.winding * mean, factor.y_equivalent * mean)


def at_temperature(
    resistance: Number,
    measured_at: Number | float,
    to: float,
    coefficient: float = COPPER,
    reference: float = COPPER_REFERENCE,
) -> Number:
    """Refer a resistance (Ω) from one temperature (°C) to another (§3.2.1, erratum E7).

    `coefficient` (1/K) holds at `reference` (°C); the default is copper's. The note's rule is 0.004 at 25 °C.
    Raises EstimationError where a value is missing or the linear coefficient does not reach so far.
    """
    values = (resistance, measured_at, to, coefficient, reference)
    if not all(np.isfinite(estimate_of(value)) for value in values):
        raise EstimationError("a temperature or the resistance is missing; enter the winding's temperature")
    at_first = 1 + coefficient * (measured_at - reference)
    at_last = 1 + coefficient * (to - reference)
    if at_first <= 0 or at_last <= 0:
        raise EstimationError(
            f"{estimate_of(measured_at):g} °C → {to:g} °C is outside the range of a linear temperature coefficient"
        )
    return resistance * (at_last / at_first)


def slope(voltage: ArrayLike, current: ArrayLike) -> Fit:
    """Fit V = resistance·I + offset − meter·sign(I) to four-wire readings (V, A, shape (n,)).

    `offset` takes thermal EMF and the voltmeter's zero, `meter` the zero of the current's meter, which reads amounts. Readings stand in
    the order of time, evenly spaced: a voltage that drifts along, as thermal EMF of contacts that warm up does, or a resistance that
    changes where the current is larger, is in the model where the readings show it, see `misfit`. So is a reading that contradicts all
    others: it is left out, and what it would change is in the interval. So is what a voltage that does not rise straight would do.
    Raises EstimationError on too few points, currents of one sign or of one amount only, and a voltage that falls or does not change.
    """
    v, i = series("voltage", voltage, least=4), series("current", current, least=4)
    same_length(voltage=v, current=i)
    if not (i.min() < 0 < i.max()):
        raise EstimationError(
            "all currents have one sign, and a thermal voltage that changes then looks like resistance; take readings with both polarities"
        )
    if np.ptp(_carried(i)) <= 1e-9 * np.max(np.abs(i)):
        raise EstimationError("all currents are alike; take readings at several currents")
    if not np.ptp(v) > 0.0:
        raise EstimationError(
            "all voltages are alike, whatever the current: the voltmeter is not connected, or its range is too coarse; "
            "check its leads and choose a finer range"
        )
    order = np.linspace(-1.0, 1.0, v.size)
    odd = _odd(v, i)
    fit = _as_straight(_with_drift(v, i, order), v, i, order) if odd is None else _without(v, i, order, odd)
    if fit.value("resistance") <= 0:
        raise EstimationError(
            "the voltage falls as the current rises: one of the two meters is connected the wrong way round"
        )
    return fit


def _odd(v: FloatArray, i: FloatArray) -> int | None:
    """Return which reading contradicts the line through all others beyond chance, None where none does."""
    plain = _plain(i)
    freedom = v.size - plain.shape[1] - 1
    if freedom < _LEAST_FREEDOM:
        return None
    residuals = least_squares(_SLOPE, plain, v).residuals
    # What is left of its own weight: a reading pulls the line to itself.
    own = np.maximum(1.0 - np.einsum("nk,kn->n", plain, np.linalg.pinv(plain)), 1e-9)
    others = np.sqrt(np.maximum(float(residuals @ residuals) - residuals**2 / own, 0.0) / freedom)
    off = np.abs(residuals) / np.sqrt(own)
    worst = int(np.argmax(off))
    limit = float(special.stdtrit(freedom, 1.0 - 0.5 * _CHANCE / v.size))
    return worst if off[worst] > max(limit * others[worst], _AGREE * float(np.max(np.abs(v)))) else None


def _without(v: FloatArray, i: FloatArray, order: FloatArray, odd: int) -> Fit:
    """Return the fit without a reading that contradicts the others; withheld where it would change the resistance by much."""
    rest = np.arange(v.size) != odd
    fit = _with_drift(v[rest], i[rest], order[rest])
    shift = least_squares(_SLOPE, _plain(i), v).value("resistance") - fit.value("resistance")
    covariance = fit.covariance.copy()
    covariance[0, 0] += shift**2
    share = abs(shift / fit.value("resistance"))
    expected = float((_plain(i) @ fit.values)[odd])
    figures: dict[str, float | str] = {
        "count": float(v.size),
        "current": float(i[odd]),
        "off": float(v[odd] / expected - 1.0) if expected else 0.0,
        "record": "four-wire",
    }
    finding = Finding(Cause.REPEATS_DIFFER, Answer.WITHHELD if share > _MOST_SHIFT else Answer.WIDENED, figures=figures)
    return replace(fit, covariance=covariance, misfit=Misfit.together((Misfit((finding,)), fit.misfit)))


def _plain(i: FloatArray) -> FloatArray:
    return np.column_stack((i, np.ones_like(i), -np.sign(i)))


def _with_drift(v: FloatArray, i: FloatArray, order: FloatArray) -> Fit:
    """Return the fit of the slope, with what drifts in the order of readings where that is more than chance."""
    plain = _plain(i)
    fit = least_squares(_SLOPE, plain, v)
    freedom = v.size - plain.shape[1] - 2
    # Currents that fall evenly through all readings are the order itself.
    if freedom < _LEAST_FREEDOM or not _told_apart(plain, order):
        return fit
    further = least_squares((*_SLOPE, "emf", "change"), np.column_stack((plain, order, order * i)), v)
    t = {name: further.value(name) / max(further.uncertainty(name), 1e-300) for name in ("emf", "change")}
    limit = float(special.stdtrit(freedom, 1.0 - 0.5 * _CHANCE))
    clearest = max(t, key=lambda name: abs(t[name]))
    if abs(t[clearest]) < limit:
        return fit
    covariance = further.covariance[:3, :3].copy()
    # Half of what the two drifts do, and where the resistance itself changes, all that it does: no course of either is known.
    off = 0.5 * (fit.value("resistance") - further.value("resistance"))
    changes = further.value("change") if abs(t["change"]) >= limit else 0.0
    covariance[0, 0] += off**2 + changes**2
    score = min(float(special.ndtri(special.stdtr(freedom, abs(t[clearest])))), _MOST)
    finding = Finding(Cause.SLOPE, Answer.WIDENED, score=score)
    return replace(further, names=_SLOPE, values=further.values[:3], covariance=covariance, misfit=Misfit((finding,)))


def _as_straight(fit: Fit, v: FloatArray, i: FloatArray, order: FloatArray) -> Fit:
    """Return the fit with what a voltage that bends over the current may do to it: by polarity, by amount, or by range."""
    plain = _plain(i) if not fit.misfit else np.column_stack((_plain(i), order, order * i))
    freedom = v.size - plain.shape[1] - 1
    amounts = np.abs(i) / float(np.max(np.abs(i)))
    levels = _levels(_carried(amounts))
    if levels.size < 3:
        return _at_two_amounts(fit, i)
    if freedom < _LEAST_TO_BEND:
        return fit
    shapes = (np.abs(i), i * amounts, i * amounts**2, *_ranges(i, amounts, levels))
    limit = float(special.stdtrit(freedom, 1.0 - 0.5 * _CHANCE / len(shapes)))
    bends = [_bent(plain, shape, v, fit) for shape in shapes if _told_apart(plain, shape)]
    found = [each for each in bends if each.score > limit] or _instead_of_drift(fit, shapes, v, i)
    if not found:
        return allowed_for_heating(fit, plain, v, i, max((_unseen(each, freedom) for each in bends), default=0.0))
    # Which polarity, or which of the currents, shows the resistance is not known: it is between them.
    least = min(each.squares for each in found)
    bend = max(each.by for each in found if each.squares <= least * (1.0 + _RIVALS / freedom))
    covariance = fit.covariance.copy()
    covariance[0, 0] += bend**2 / 3.0
    clearest = max(each.score for each in found)
    score = min(float(special.ndtri(special.stdtr(freedom, clearest))), _MOST)
    figures: dict[str, float | str] = {"bend": abs(bend / fit.value("resistance")), "record": "four-wire"}
    answer = Answer.WITHHELD if bend > _MOST_SHIFT * abs(fit.value("resistance")) else Answer.WIDENED
    finding = Finding(Cause.CURVATURE, answer, score=score, figures=figures)
    return replace(fit, covariance=covariance, misfit=Misfit.together((fit.misfit, Misfit((finding,)))))


def _ranges(i: FloatArray, amounts: FloatArray, levels: FloatArray) -> list[FloatArray]:
    """Return what lower ranges that read differently make: of all readings below a level, and, where a range ends at a level itself, of
    one polarity of that one, too.
    """
    between = 0.5 * (levels[:-1] + levels[1:])
    if levels.size > _MOST_LEVELS:
        return [i * (amounts < border) for border in between]
    borders = [0.0, *between, np.inf]
    lower = [(amounts < below, amounts < above) for below, above in pairwise(borders)]
    masks = [below | (above & (sign * i > 0.0)) for below, above in lower for sign in (1.0, -1.0)]
    return [i * mask for mask in (*(amounts < border for border in between), *masks)]


def _at_two_amounts(fit: Fit, i: FloatArray) -> Fit:
    """Return the fit with what readings at two amounts of current leave open: a contact that changes with the current, or a range that
    reads differently, looks like the zero of the current's meter.
    """
    zero, least = fit.value("meter"), float(np.min(_carried(i)))
    score = abs(zero) / max(fit.uncertainty("meter"), 1e-300)
    bend = _Bend(score, abs(zero) / least, 0.0)
    covariance = fit.covariance.copy()
    covariance[0, 0] += _unseen(bend, i.size - len(_SLOPE))
    share = bend.by / abs(fit.value("resistance"))
    if share <= _MOST_SHIFT or covariance[0, 0] <= 2.0 * fit.covariance[0, 0]:
        return replace(fit, covariance=covariance)
    figures: dict[str, float | str] = {"bend": share, "record": "four-wire"}
    finding = Finding(Cause.CURVATURE, Answer.WITHHELD, score=min(score, _MOST), figures=figures)
    return replace(fit, covariance=covariance, misfit=Misfit.together((fit.misfit, Misfit((finding,)))))


def hidden_drift(current: FloatArray) -> float:
    """Return by how much (1/A) a voltage that drifts by one unit from the first reading to the last changes the slope unseen; 0 where the
    readings' order tells them apart.
    """
    plain, order = _plain(current), np.linspace(0.0, 1.0, current.size)
    moved = np.linalg.pinv(plain) @ order
    left = order - plain @ moved
    seen = float(np.sum(left**2)) > _SHOWN * float(np.sum((order - np.mean(order)) ** 2))
    return 0.0 if seen else abs(float(moved[0]))


def count_of_levels(current: FloatArray) -> int:
    """Return at how many amounts of current (A) readings stand."""
    return int(_levels(_carried(current) / float(np.max(np.abs(current)))).size)


def _carried(current: FloatArray) -> FloatArray:
    """Return the amounts of current (A) without those of readings at no current, which show the voltmeter's zero and no resistance."""
    amounts = np.abs(current)
    return np.asarray(amounts[amounts > _NONE * np.max(amounts)], dtype=np.float64)


def _levels(amounts: FloatArray) -> FloatArray:
    """Return the levels of current (shares of the largest, ascending) that readings stand at; of a sweep, every hundredth that it has."""
    ordered = np.sort(amounts)
    groups = np.split(ordered, np.flatnonzero(np.diff(ordered) > _SAME_LEVEL) + 1)
    if any(np.ptp(group) > 3.0 * _SAME_LEVEL for group in groups):
        return np.unique(np.round(amounts, 2))
    return np.array([np.mean(group) for group in groups])


class _Bend(NamedTuple):
    """A shape of the voltage over the current beside a straight line: |t|, what it does to the resistance (Ω), and χ² that is left (V²)."""

    score: float
    by: float
    squares: float


def _told_apart(plain: FloatArray, shape: FloatArray) -> bool:
    """Return whether readings tell a shape from the rest of the design."""
    left = shape - plain @ (np.linalg.pinv(plain) @ shape)
    return float(np.linalg.norm(left)) > _TOLD_APART * float(np.linalg.norm(shape))


def _bent(plain: FloatArray, shape: FloatArray, v: FloatArray, fit: Fit) -> _Bend:
    names = tuple(str(k) for k in range(plain.shape[1] + 1))
    bent = least_squares(names, np.column_stack((plain, shape)), v)
    size, moved = float(bent.values[-1]), float(bent.values[0]) - fit.value("resistance")
    score = abs(size) / max(bent.uncertainty(names[-1]), 1e-300)
    return _Bend(score, max(abs(size), abs(moved)), float(np.sum(bent.residuals**2)))


def _unseen(bend: _Bend, freedom: int) -> float:
    """Return what a shape that is not beyond chance adds to the resistance's variance (Ω²), as far as its score is more than chance."""
    z = -float(special.ndtri(max(2.0 * special.stdtr(freedom, -bend.score), 1e-300) / 2.0))
    return max(0.0, 1.0 - _BY_CHANCE / z**2) * bend.by**2 / 3.0 if z > 0.0 else 0.0


def _instead_of_drift(fit: Fit, shapes: Sequence[FloatArray], v: FloatArray, i: FloatArray) -> list[_Bend]:
    """Return shapes that explain the readings as well as the drift that was found: where both polarities of a current follow each other
    and the currents only fall, a contact that rectifies looks like it.
    """
    if not any(finding.cause is Cause.SLOPE for finding in fit.misfit.findings):
        return []
    most = float(np.sum(fit.residuals**2)) * (1.0 + _RIVALS / fit.degrees_of_freedom)
    return [each for each in (_bent(_plain(i), shape, v, fit) for shape in shapes) if each.squares <= most]


def drift(blocks: Sequence[tuple[FloatArray, FloatArray, FloatArray]]) -> Fit:
    """Fit how fast the resistances of several pairs of terminals change together (`drift`, relative, 1/s).

    A block is one pair's time (s), current (A) and voltage (V), each of shape (n,). Every pair has its own resistance, thermal
    voltage and offset of the current's meter. Raises EstimationError on too few points.
    """
    names, columns, changing = [], [], []
    sizes = [len(time) for time, _, _ in blocks]
    places = np.cumsum([0, *sizes])
    for k, (time, current, voltage) in enumerate(blocks):
        whole = np.zeros((places[-1], 3))
        whole[places[k] : places[k + 1]] = np.column_stack((current, np.ones_like(current), -np.sign(current)))
        columns.append(whole)
        names += [f"resistance {k}", f"offset {k}", f"meter {k}"]
        changing.append(slope(voltage, current).value("resistance") * current * (time - blocks[0][0][0]))
    design = np.column_stack((np.concatenate(changing), *columns))
    return least_squares(("drift", *names), design, np.concatenate([voltage for _, _, voltage in blocks]))
