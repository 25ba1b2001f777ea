"""A motor turned with its terminals shorted: inductances, resistance, drop and braking torque from currents and torques over speed."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray, coverage_interval
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.flux.flux_map import MapFigure
from procedures.estimation.flux.short_currents import CurrentSamples, ShortRows, told
from procedures.estimation.flux.short_limits import (
    INDUCTANCE,
    LIMIT,
    Q_INDUCTANCE,
    RESISTANCE,
    SharedErrors,
    ShortLimits,
)

#: A condition number beyond which currents do not tell the unknowns apart.
_UNDETERMINED = 1e7
#: A resistance is not told by currents from which its 95 % interval is so long (logarithm).
_UNKNOWN = 2.0
#: Logarithms beyond this are of no motor.
_FAR = 25.0
_LEAST = 5
#: Resistances from currents and from torque that differ by more than so many standard uncertainties, and this share, are an alarm.
_ALARM, _ALARM_SHARE = 3.0, 0.01
#: So far apart no saturation takes the two: currents, speeds or flux linkage are of another scale, and L_d with them.
_SCALED = 1.3
#: What is taken for noise where the residuals show less, in shares of the largest value.
_FLOOR = 1e-4
#: A flux linkage that falls from row to row by so many standard uncertainties gives no L_d; fewer rows do not tell a fall from scatter.
_FALLS, _FALL_ROWS = 4.0, 7
#: While a magnet loses 1 % by warming (−0.11 %/K), copper as warm gains this many per cent.
_COPPER = 3.6
#: Ends of a 95 % interval.
_ENDS = (0.025, 0.975)
#: A term whose size is none in fewer samples than this share is surely there.
_ABSENT, _SURE = 1e-12, 0.002
#: Torques that scatter up to this times as much as the currents (logarithm) are explained as well as they are.
_AS_WELL = math.log(3.0)
_TORQUE_NAMES = ("q_axis_inductance", "stator_resistance")
#: What the terms are called, and the estimates that they concern.
_CAUSES: dict[str, tuple[Cause, Answer, tuple[str, ...]]] = {
    # By which law is not known, and L_q depends on it.
    "saturation_q": (Cause.SATURATION, Answer.WITHHELD, ("q_axis_inductance",)),
    "drop": (Cause.CONTACT, Answer.MODELLED, _TORQUE_NAMES),
    "iron": (Cause.IRON_LOSS, Answer.MODELLED, _TORQUE_NAMES),
    "friction": (Cause.FRICTION_LEFT, Answer.MODELLED, _TORQUE_NAMES),
    "viscous": (Cause.FRICTION_LEFT, Answer.MODELLED, _TORQUE_NAMES),
}
_RIVALS = (("saturation_q",), ("drop",), ("iron", "friction", "viscous"))


@dataclass(frozen=True)
class ShortCircuitFit:
    """Characteristics at shorted terminals; currents in A peak, torque of braking in N·m, R in Ω, inductances in H.

    `limit_current` is I(∞) = λ/L_d, `chord_inductance` L_d from 0 to −I(∞), `q_axis_inductance` L_q from 0 to the largest i_q of the rows;
    `resistance_by_current` is that of the currents alone, `resistance` that of currents and torques together, with saturation, iron loss,
    friction and a `drop` (V, peak) beside it. Torque's figures are None where no torque was read, those that need λ where it is not known.
    """

    limit_current: MapFigure
    chord_inductance: MapFigure | None
    q_axis_inductance: MapFigure | None
    resistance_by_current: MapFigure | None
    resistance: MapFigure | None
    drop: MapFigure | None
    misfit: Misfit


def fit_short_circuit(
    electrical_speed: ArrayLike,
    current: ArrayLike,
    torque: ArrayLike | None = None,
    *,
    pole_pairs: float = 1.0,
    flux_linkage: float | None = None,
    u_flux_linkage: float = 0.0,
    friction: ArrayLike | None = None,
    limits: ShortLimits | None = None,
) -> ShortCircuitFit:
    """Fit short-circuit currents (A, peak) and braking torques (N·m, above 0) over the electrical speed (rad/s).

    `flux_linkage` λ (V·s, peak) is that of the open circuit at the same magnet temperature: without it currents tell ratios only.
    `friction` (n,) in N·m is what the shaft takes without current, at the same speeds; where it is not given it may be in the torques.
    `limits` are the instruments' limits of error, none where not given, and whether inductances may depend on the current.
    Raises EstimationError for fewer than five speeds, or currents that show no resistance because all speeds are high.
    """
    speed, i = series("electrical speed", electrical_speed, least=_LEAST), series("current", current, least=_LEAST)
    same_length(speed=speed, current=i)
    speed = np.abs(speed)
    if np.any(speed == 0.0) or np.any(i <= 0.0):
        raise EstimationError("speeds and currents of a short circuit are above zero; leave out readings at standstill")
    braking = None
    if torque is not None:
        braking = np.abs(series("torque", torque, least=_LEAST))
        same_length(speed=speed, torque=braking)
        if friction is not None:
            braking = braking - np.abs(series("friction", friction, least=_LEAST))
    lam = 1.0 if flux_linkage is None else flux_linkage
    if not lam > 0.0:
        raise EstimationError(f"a flux linkage of {lam:g} V·s: above zero is needed; measure the open circuit first")
    shared = SharedErrors(limits or ShortLimits(), u_flux_linkage / lam)
    plain = _Plain(speed, i, lam)
    solution = plain.solve()
    with_flux = flux_linkage is not None

    along = np.linspace(0.0, 1.0, speed.size)
    row = float(along @ i**2) / float(np.sum(i**2))
    rows = ShortRows(speed, i, lam, unequal=shared.limits.unequal, saturating=shared.limits.saturation > 0.0)
    alone = told(rows, _FLOOR, row)
    if _width(alone.resistance) > _UNKNOWN:
        raise EstimationError(
            "the currents do not tell I(∞), L_q and R apart: read at low speeds too, where the current still grows with the speed"
        )
    misfit = _fall(plain, solution, speed, i) if with_flux else []
    joint = drop = None
    best = alone
    if braking is not None and pole_pairs > 0.0:
        power = braking * (speed / pole_pairs) / 1.5
        if with_flux:
            largest = float(np.max(np.abs(braking)))
            zero = shared.limits.torque_zero / largest if largest > 0.0 else 0.0
            both = told(
                replace(rows, power=power, offset=shared.offset, zero=zero, friction=friction is None), _FLOOR, row
            )
            terms = _terms(both)
            if terms and float(np.median(both.others["noise"])) < _AS_WELL:
                power = _of_heat(power, speed, both)
            by_current = shared.figure(RESISTANCE, alone.mean_resistance, 1.0, alone)
            without = _by_torque(power / i**2, i, shared.limits.of_torque)
            differing = _contradiction(by_current, without, shared.limits.of_torque)
            misfit += differing
            if not differing:
                best = both
                joint = shared.figure(RESISTANCE, best.resistance, 1.0, best)
                drop = _of_samples(best.others["drop"] * np.exp(best.resistance + best.limit))
                misfit += terms
    if _width(best.limit) > _UNKNOWN:
        raise EstimationError(
            "the currents do not tell I(∞) and L_d: read at higher speeds too, where the current hardly grows with the speed any more"
        )
    limit = shared.figure(LIMIT, best.limit, 1.0, best)
    chord = q_axis = currents = None
    if with_flux:
        chord = shared.figure(INDUCTANCE, -best.limit, lam, best)
        q_axis = shared.figure(Q_INDUCTANCE, best.q_axis, lam, best)
        currents = shared.figure(RESISTANCE, alone.resistance, 1.0, alone)
    return ShortCircuitFit(
        limit,
        chord,
        q_axis,
        currents,
        joint,
        drop,
        Misfit(tuple(misfit)),
    )


class _Plain:
    """I = λω·√(R² + ω²L_q²)/(R² + ω²L_d·L_q) with constants."""

    def __init__(self, speed: FloatArray, current: FloatArray, flux_linkage: float) -> None:
        self._speed, self._current, self._flux = speed, current, flux_linkage

    def current(self, speed: FloatArray, p: FloatArray) -> FloatArray:
        limit, l_q, r = np.exp(np.clip(p, -_FAR, _FAR))
        l_d = self._flux / limit
        reach = r**2 + speed**2 * l_d * l_q
        return np.asarray(self._flux * speed * np.sqrt(r**2 + (speed * l_q) ** 2) / reach)

    def solve(self) -> "_Solved":
        top = float(np.max(self._current))
        l_d = self._flux / top
        half = float(np.interp(0.5 * top, np.sort(self._current), self._speed[np.argsort(self._current)]))
        best: _Solved | None = None
        for saliency in (1.0, 2.0, 4.0):
            start = np.log([top, saliency * l_d, max(half * l_d, 1e-9)])
            solution = _least_squares(self._residuals, start)
            if best is None or solution.cost < best.cost:
                best = solution
        if best is None:
            raise EstimationError("the currents are not those of a short circuit")
        return best

    def _residuals(self, p: FloatArray) -> FloatArray:
        return np.asarray(self.current(self._speed, p) / self._current - 1.0)


@dataclass(frozen=True)
class _Solved:
    values: FloatArray
    covariance: FloatArray
    cost: float


def _least_squares(residuals: Callable[[FloatArray], FloatArray], start: FloatArray) -> _Solved:
    solution = optimize.least_squares(residuals, start, jac="3-point", x_scale=0.1, max_nfev=200)
    slopes = np.asarray(solution.jac, dtype=np.float64)
    if np.linalg.cond(slopes) > _UNDETERMINED:
        return _Solved(solution.x, np.full((start.size, start.size), np.inf), 2.0 * float(solution.cost))
    return _Solved(
        solution.x, np.asarray(np.linalg.inv(slopes.T @ slopes), dtype=np.float64), 2.0 * float(solution.cost)
    )


def _by_torque(each: FloatArray, current: FloatArray, limit: float) -> MapFigure:
    """Return R of T·ω over 1.5·I², the speeds with large currents counting for more; gains take it by up to `limit` (relative)."""
    weight = current**2 / float(np.sum(current**2))
    mean = float(weight @ each)
    spread = math.sqrt(float(weight @ (each - mean) ** 2) * float(weight @ weight))
    spread = math.hypot(max(spread, _FLOOR * abs(mean)), limit * mean / math.sqrt(3.0))
    return MapFigure(mean, spread, coverage_interval(mean, spread, float(each.size - 1)))


def _of_heat(power: FloatArray, speed: FloatArray, best: CurrentSamples) -> FloatArray:
    """Return what of the power (Ω·A²) is the heat of the resistance: friction, zero and iron loss taken off."""
    middle = {name: float(np.median(values)) for name, values in best.others.items()}
    relative = speed / float(np.max(speed))
    torque = (middle["zero"] + middle["friction"] + middle["viscous"] * relative) * float(np.max(np.abs(power) / speed))
    return np.asarray((power - torque * speed) / (1.0 + middle["iron"] * relative**2))


def _width(samples: FloatArray) -> float:
    low, high = np.quantile(samples, _ENDS)
    return float(high - low)


def _of_samples(values: FloatArray) -> MapFigure:
    low, middle, high = (float(each) for each in np.quantile(values, (_ENDS[0], 0.5, _ENDS[1])))
    return MapFigure(middle, float(np.std(values)), (low, high))


def _terms(best: CurrentSamples) -> list[Finding]:
    """Return which terms beside constants the rows need; of such that may stand for each other the likeliest."""
    found = []
    for rivals in _RIVALS:
        absent = {name: np.abs(best.others[name]) <= _ABSENT for name in rivals}
        if float(np.mean(np.all(list(absent.values()), axis=0))) >= _SURE:
            continue
        likeliest = min(rivals, key=lambda name: float(np.mean(absent[name])))
        for name in rivals:
            if name == likeliest or float(np.mean(absent[name])) < _SURE:
                cause, answer, names = _CAUSES[name]
                middle = float(np.median(best.others[name]))
                figures: dict[str, float | str] = {"size": middle, "factor": 1.0 + middle, "record": "short-circuit"}
                found.append(Finding(cause, answer, names, 0.0, figures))
    return found


def _fall(plain: _Plain, solved: _Solved, speed: FloatArray, current: FloatArray) -> list[Finding]:
    """Return the finding of a flux linkage that surely falls along the rows."""
    count = current.size
    if count < _FALL_ROWS:
        return []
    order = np.linspace(0.0, 1.0, count)

    def residuals(p: FloatArray) -> FloatArray:
        # k times the resistance at a speed is the same as the resistance itself at a k-th of the speed.
        warmer = np.maximum(1.0 - _COPPER * p[3] * order, 0.1)
        return np.asarray(plain.current(speed / warmer, p[:3]) * (1.0 + p[3] * order) / current - 1.0)

    starts = (0.0, -0.03, -0.1)
    fallen = min(
        (_least_squares(residuals, np.append(solved.values, each)) for each in starts), key=lambda fit: fit.cost
    )
    noise = max(math.sqrt(fallen.cost / (count - 4.0)), _FLOOR)
    spread = noise * math.sqrt(float(fallen.covariance[3, 3]))
    change = float(fallen.values[3])
    # Magnets warm while they are braked: a rise is something else.
    if not 0.0 < spread < math.inf or change > -_FALLS * spread:
        return []
    figures: dict[str, float | str] = {"change": change, "record": "short-circuit"}
    names = ("d_axis_inductance", "q_axis_inductance", "stator_resistance")
    return [Finding(Cause.SLOPE, Answer.WITHHELD, names, change / spread, figures)]


def _contradiction(by_current: MapFigure, by_torque: MapFigure, limit: float) -> list[Finding]:
    ratio = by_torque.value / by_current.value
    spread = math.hypot(by_torque.standard_uncertainty, by_current.standard_uncertainty)
    score = (by_torque.value - by_current.value) / spread
    if abs(score) < _ALARM or abs(ratio - 1.0) < max(_ALARM_SHARE, limit):
        return []
    figures = {"ratio": ratio, "by_current": by_current.value, "by_torque": by_torque.value}
    names: tuple[str, ...] = ("stator_resistance", "q_axis_inductance")
    if not 1.0 / _SCALED < ratio < _SCALED:
        names = ("d_axis_inductance", *names)
    record: dict[str, float | str] = {**figures, "record": "saturating" if ratio > 1.0 else "dropping"}
    return [Finding(Cause.RESISTANCES_DIFFER, Answer.WITHHELD, names, score, record)]
