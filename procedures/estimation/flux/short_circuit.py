"""A motor turned with its terminals shorted: inductances, resistance, drop and braking torque from currents and torques over speed."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from procedures.estimation.fitting.checks import same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray, coverage_interval
from procedures.estimation.fitting.misfit import Answer, Cause, Finding, Misfit
from procedures.estimation.flux.flux_map import MapFigure
from procedures.estimation.flux.short_currents import Weighed, weigh

#: Step of a numerical derivative in shares of the current, and rounds that settle the currents of a saturating motor.
_STEP, _SETTLING = 1e-5, 30
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
#: Less than this of χ² gained by saturation, drop and iron (four terms, 95 %) shows none of them.
_NOTHING_GAINED = 9.5
#: A flux linkage that falls from row to row by so many standard uncertainties gives no L_d; fewer rows do not tell a fall from scatter.
_FALLS, _FALL_ROWS = 4.0, 7
#: Half the width of a 95 % interval in standard uncertainties.
_COVERAGE = 1.96
#: While a magnet loses 1 % by warming (−0.11 %/K), copper as warm gains this many per cent.
_COPPER = 3.6
#: What is known beforehand of saturation (shares) and of the drop (shares of R·I∞), standard deviations.
_SATURATION, _DROP = 0.5, 0.1


@dataclass(frozen=True)
class ShortCircuitFit:
    """Characteristics at shorted terminals; currents in A peak, torque of braking in N·m, R in Ω, inductances in H.

    `limit_current` is I(∞) = λ/L_d, `chord_inductance` L_d from 0 to −I(∞); `resistance_by_current` and `resistance_by_torque` are those
    of the plain model, which differ where something is not in it; `resistance` is that of currents and torques together, with saturation
    and a `drop` (V, peak) beside it. Torque's figures are None where no torque was read, those that need λ where it is not known.
    `peak_speed` is electrical, rad/s.
    """

    limit_current: MapFigure
    chord_inductance: MapFigure | None
    q_axis_inductance: MapFigure | None
    resistance_by_current: MapFigure | None
    resistance_by_torque: MapFigure | None
    resistance: MapFigure | None
    drop: MapFigure | None
    peak_speed: float | None
    peak_torque: float | None
    current_residual: float
    misfit: Misfit


def peak_ratio(saliency: float) -> float:
    """Return x of the speed x·R/√(L_d·L_q) at which the braking torque is largest, for ξ = L_q/L_d: 1, 1.33, 1.54 for 1, 2, 4."""
    root = math.sqrt((3.0 * saliency - 3.0) ** 2 + 4.0 * saliency)
    return math.sqrt((3.0 * saliency - 3.0 + root) / (2.0 * saliency))


def fit_short_circuit(
    electrical_speed: ArrayLike,
    current: ArrayLike,
    torque: ArrayLike | None = None,
    *,
    pole_pairs: float = 1.0,
    flux_linkage: float | None = None,
    u_flux_linkage: float = 0.0,
    friction: ArrayLike | None = None,
) -> ShortCircuitFit:
    """Fit short-circuit currents (A, peak) and braking torques (N·m, above 0) over the electrical speed (rad/s).

    `flux_linkage` λ (V·s, peak) is that of the open circuit at the same magnet temperature: without it currents tell ratios only.
    `friction` (n,) in N·m is what the shaft takes without current, at the same speeds.
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
    plain = _Plain(speed, i, lam)
    solution = plain.solve()
    freedom = float(speed.size - 3)
    noise = max(math.sqrt(solution.cost / freedom), _FLOOR) if freedom > 0 else _FLOOR
    relative = u_flux_linkage / lam

    with_flux = flux_linkage is not None
    along = np.linspace(0.0, 1.0, speed.size)
    currents = weigh(speed, i, lam, _FLOOR, row=float(along @ i**2) / float(np.sum(i**2)))
    known = currents[0].resistance
    if known.quantile(0.975) - known.quantile(0.025) > _UNKNOWN:
        raise EstimationError(
            "the currents do not tell I(∞), L_q and R apart: read at low speeds too, where the current still grows with the speed"
        )
    misfit = _fall(plain, solution, speed, i) if with_flux else []
    by_torque = joint = drop = saturating_q = None
    peak: tuple[float, float] | None = None
    shown = currents
    if braking is not None and pole_pairs > 0.0:
        power = braking * (speed / pole_pairs) / 1.5
        by_torque = _by_torque(power / i**2, i)
        if with_flux:
            differing = _contradiction(_weighed([each.mean_resistance for each in currents], 1.0, relative), by_torque)
            together = _Joint(speed, i, braking, lam, pole_pairs, plain, noise)
            joint, drop, saturating_q, peak = together.figures(relative)
            if saturating_q is None and not differing and np.all(power > 0.0):
                # Constants explain both: the torque then tells R, and L_q with it.
                shown = weigh(speed, i, lam, _FLOOR, power)
                joint = _weighed([each.resistance for each in shown], 1.0, 0.0)
            misfit += differing
    reached = shown[0].limit
    if reached.quantile(0.975) - reached.quantile(0.025) > _UNKNOWN:
        raise EstimationError(
            "the currents do not tell I(∞) and L_d: read at higher speeds too, where the current hardly grows with the speed any more"
        )
    limit = _weighed([each.limit for each in shown], 1.0, 0.0)
    chord = _weighed([each.limit for each in shown], lam, relative, inverse=True) if with_flux else None
    by_current = _weighed([each.resistance for each in currents], 1.0, relative) if with_flux else None
    q_axis = (saturating_q or _weighed([each.q_axis for each in shown], lam, relative)) if with_flux else None
    if peak is None and with_flux:
        l_d, l_q, r = lam / limit.value, math.exp(solution.values[1]), math.exp(solution.values[2])
        at = peak_ratio(l_q / l_d) * r / math.sqrt(l_d * l_q)
        amplitude = float(plain.current(np.array([at]), solution.values)[0])
        peak = at, 1.5 * r * amplitude**2 * pole_pairs / at
    residual = math.sqrt(solution.cost / speed.size)
    return ShortCircuitFit(
        limit,
        chord,
        q_axis,
        by_current,
        by_torque,
        joint,
        drop,
        peak and peak[0],
        peak and peak[1],
        residual,
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


class _Joint:
    """Currents and torques with a saturating flux on both axes, a switch's drop and iron's loss.

    Unknowns: logarithms of L_d (to −I∞), L_q, R; how much larger L_d is at zero; how fast L_q falls; drop in shares of R·I∞; iron's
    conductance in shares of 1/R.
    """

    _PRIOR = np.array([np.inf, np.inf, np.inf, _SATURATION, _SATURATION, _DROP, 0.02])

    def __init__(
        self,
        speed: FloatArray,
        current: FloatArray,
        torque: FloatArray,
        flux: float,
        poles: float,
        plain: _Plain,
        noise: float,
    ) -> None:
        self._speed, self._current, self._torque, self._flux, self._poles = speed, current, torque, flux, poles
        start = plain.solve().values
        self._limit = math.exp(float(start[0]))
        self._start = np.concatenate(([math.log(flux) - start[0], start[1], start[2]], np.zeros(4)))
        self._noise = noise

    def figures(self, relative: float) -> tuple[MapFigure, MapFigure, MapFigure | None, tuple[float, float]]:
        """Return R, drop, L_q where constants do not explain the readings as well, and the torque's peak with its speed."""
        known = np.isfinite(self._PRIOR)
        count, weights = self._speed.size, np.full(2 * self._speed.size, self._noise)

        def residuals(p: FloatArray) -> FloatArray:
            return np.concatenate((self._residuals(p) / weights, p[known] / self._PRIOR[known]))

        def of_constants(p: FloatArray) -> FloatArray:
            shortened: FloatArray = self._residuals(np.concatenate((p, np.zeros(4)))) / weights
            return shortened

        solution = _least_squares(residuals, self._start)
        # The torque counts by its own scatter.
        left = self._residuals(solution.values)[count:]
        weights[count:] = max(math.sqrt(float(left @ left) / (count - 1.5)), _FLOOR)
        solution = _least_squares(residuals, solution.values)
        freedom = 2.0 * count - 3.0
        grown = math.sqrt(max(solution.cost / freedom, 1.0))
        constants = _least_squares(of_constants, solution.values[:3])
        # Terms that the readings do not show would leave L_q unknown where the currents alone tell it.
        plain_enough = constants.cost - solution.cost < _NOTHING_GAINED * grown**2
        r, l_q = math.exp(solution.values[2]), math.exp(solution.values[1])

        def figure(place: int, value: float, slope: float, power: float) -> MapFigure:
            spread = grown * abs(slope) * math.sqrt(solution.covariance[place, place])
            return _figure(value, math.hypot(spread, power * relative * value), freedom)

        scale = r * self._limit
        grid = np.geomspace(0.2 * float(np.min(self._speed)), float(np.max(self._speed)), 400)
        i_d, i_q, effective = self._currents(grid, solution.values)
        torque = 1.5 * effective * (i_d**2 + i_q**2) * self._poles / grid
        best = int(np.argmax(torque))
        return (
            figure(2, r, r, 0.0),
            figure(5, float(solution.values[5]) * scale, scale, 0.0),
            None if plain_enough else figure(1, l_q, l_q, 1.0),
            (float(grid[best]), float(torque[best])),
        )

    def _currents(self, speed: FloatArray, p: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return i_d and i_q (A), and R with what the drop adds to it (Ω)."""
        l_chord, l_q0, r = np.exp(np.clip(p[:3], -_FAR, _FAR))
        limit = self._limit

        def resistance(size: FloatArray) -> FloatArray:
            return np.asarray(r + p[5] * r * limit / np.hypot(size, 1e-3 * limit))

        def voltage(i: FloatArray) -> FloatArray:
            """Return what is left of the voltages, in shares of ωλ (2, n)."""
            effective = resistance(np.hypot(i[0], i[1]))
            psi_d = self._flux + l_chord * i[0] * (1.0 + p[3] * (1.0 - np.hypot(i[0] / limit, 1e-6)))
            psi_q = l_q0 * i[1] / (1.0 + max(float(p[4]), -0.5) * np.hypot(i[1] / limit, 1e-6))
            left = np.stack((effective * i[0] - speed * psi_q, effective * i[1] + speed * psi_d))
            return np.asarray(left / (speed * self._flux))

        reach = r**2 + speed**2 * l_chord * l_q0
        i = np.stack((-(speed**2) * self._flux * l_q0 / reach, -speed * self._flux * r / reach))
        step = _STEP * limit
        along = step * np.eye(2)[:, :, None]
        for _ in range(_SETTLING):
            left = voltage(i)
            slopes = [(voltage(i + each) - voltage(i - each)) / (2.0 * step) for each in along]
            change = np.linalg.solve(np.stack(slopes, axis=1).transpose(2, 0, 1), left.T[:, :, None])[:, :, 0].T
            # Never further than the currents are large, where the start was poor.
            i = i - np.clip(change, -0.5 * limit, 0.5 * limit)
            if float(np.max(np.abs(change))) < 1e-10 * limit:
                break
        return i[0], i[1], resistance(np.hypot(i[0], i[1]))

    def _residuals(self, p: FloatArray) -> FloatArray:
        i_d, i_q, effective = self._currents(self._speed, p)
        size = np.hypot(i_d, i_q)
        # The EMF across the iron is what the winding's resistance and the drop take.
        iron = p[6] * 1.5 * (effective * size) ** 2 / math.exp(float(np.clip(p[2], -_FAR, _FAR)))
        torque = (1.5 * effective * size**2 + iron) * self._poles / self._speed
        return np.concatenate((size / self._current - 1.0, torque / self._torque - 1.0))


def _least_squares(residuals: Callable[[FloatArray], FloatArray], start: FloatArray) -> _Solved:
    solution = optimize.least_squares(residuals, start, jac="3-point", x_scale=0.1, max_nfev=200)
    slopes = np.asarray(solution.jac, dtype=np.float64)
    if np.linalg.cond(slopes) > _UNDETERMINED:
        return _Solved(solution.x, np.full((start.size, start.size), np.inf), 2.0 * float(solution.cost))
    return _Solved(
        solution.x, np.asarray(np.linalg.inv(slopes.T @ slopes), dtype=np.float64), 2.0 * float(solution.cost)
    )


def _by_torque(each: FloatArray, current: FloatArray) -> MapFigure:
    """Return R of T·ω over 1.5·I², the speeds with large currents counting for more."""
    weight = current**2 / float(np.sum(current**2))
    mean = float(weight @ each)
    spread = math.sqrt(float(weight @ (each - mean) ** 2) * float(weight @ weight))
    return _figure(mean, max(spread, _FLOOR * mean), float(each.size - 1))


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


def _contradiction(by_current: MapFigure, by_torque: MapFigure) -> list[Finding]:
    ratio = by_torque.value / by_current.value
    spread = math.hypot(by_torque.standard_uncertainty, by_current.standard_uncertainty)
    score = (by_torque.value - by_current.value) / spread
    if abs(score) < _ALARM or abs(ratio - 1.0) < _ALARM_SHARE:
        return []
    figures = {"ratio": ratio, "by_current": by_current.value, "by_torque": by_torque.value}
    names: tuple[str, ...] = ("stator_resistance", "q_axis_inductance")
    if not 1.0 / _SCALED < ratio < _SCALED:
        names = ("d_axis_inductance", *names)
    record: dict[str, float | str] = {**figures, "record": "saturating" if ratio > 1.0 else "dropping"}
    return [Finding(Cause.RESISTANCES_DIFFER, Answer.WITHHELD, names, score, record)]


def _figure(value: float, spread: float, freedom: float) -> MapFigure:
    return MapFigure(value, spread, coverage_interval(value, spread, max(freedom, 1.0)))


def _weighed(rivals: Sequence[Weighed], scale: float, relative: float, *, inverse: bool = False) -> MapFigure:
    """Return the median of the first with an interval that spans 95 % of each; `scale` (over it, where `inverse`) is known to a share
    `relative`.
    """

    def at(logarithm: float) -> float:
        size = min(max(logarithm, -_FAR), _FAR)
        return scale * math.exp(-size if inverse else size)

    value, common = at(rivals[0].quantile(0.5)), _COVERAGE * relative
    ends = [at(each.quantile(share)) for each in rivals for share in (0.025, 0.975)]
    low = value - math.hypot(max(value - min(ends), 0.0), common * value)
    high = value + math.hypot(max(max(ends) - value, 0.0), common * value)
    return MapFigure(value, (high - low) / (2.0 * _COVERAGE), (low, high))
