"""I(∞), L_q and R from short-circuit currents: every value that explains them is weighted by its likelihood.

With y = ω·L_d/R and ξ = L_q/L_d the current is I(∞)·y·√(1 + ξ²y²)/(1 + ξy²). Its derivative by ξ is zero at ξ = 1: within their noise
the same currents belong to one ξ above 1 and one below, and no fit with one minimum has the right interval.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy import optimize, special

from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: What is known of L_q/L_d beforehand: a value, and the standard deviation of its logarithm.
USUAL_SALIENCY, SALIENCY_SPREAD = 1.5, 0.8
_SALIENCIES = (math.log(USUAL_SALIENCY) - 3.0 * SALIENCY_SPREAD, math.log(USUAL_SALIENCY) + 3.0 * SALIENCY_SPREAD)
#: A winding that warms along the rows gains a share of its resistance: of any size up to 0.4, sizes beyond the small one alike in their
#: logarithms. The magnets lose up to half as much of their flux linkage (ferrite −0.2 %/K, neodymium −0.1 %/K, copper +0.39 %/K).
_SMALL = 0.01
_WARMING, _SHARES = (math.log(_SMALL), math.log(0.4 + _SMALL)), (0.0, 0.5)
#: The torques' noise over the currents', of any size between these (logarithms).
_TORQUES = (math.log(0.1), math.log(10.0))
#: What is within so much of χ² of the best explanation is in the interval too.
_RIVAL = 12.0
#: Values tried at once, and at last; rounds that close in; how many must count at least; kernels, and their width in shares of what counts.
_TRIED, _LAST, _ROUNDS, _LEAST, _KERNELS, _WIDTH = 500, 1500, 12, 100.0, 150, 0.5
_STEPS, _LONGEST = 25, 0.7
#: The same table gives the same figures.
_SEED = 1


@dataclass(frozen=True)
class Weighed:
    """Logarithms (n,) of a quantity, each with its scale and weight: a mixture of Student's distributions."""

    centre: FloatArray
    scale: FloatArray
    weight: FloatArray
    degrees_of_freedom: float

    def quantile(self, share: float) -> float:
        """Return the logarithm below which this share of the weight lies."""

        def beyond(at: float) -> float:
            each = special.stdtr(self.degrees_of_freedom, (at - self.centre) / self.scale)
            return float(self.weight @ each) - share

        reach = 50.0 * float(np.max(self.scale))
        low, high = float(np.min(self.centre)) - reach, float(np.max(self.centre)) + reach
        return float(optimize.brentq(beyond, low, high, xtol=1e-9))


@dataclass(frozen=True)
class ShortCurrents:
    """Logarithms of I(∞) (A), L_q over the flux linkage, and R (Ω) at the first row and at `row` of the rows."""

    limit: Weighed
    q_axis: Weighed
    resistance: Weighed
    mean_resistance: Weighed


def weigh(
    speed: FloatArray,
    current: FloatArray,
    flux_linkage: float,
    floor: float,
    torque_power: FloatArray | None = None,
    row: float = 0.5,
) -> tuple[ShortCurrents, ...]:
    """Return what currents (A) at electrical speeds (rad/s) tell, in the order in which they were read: each explanation that may hold.

    The first is that nothing warmed along the rows, unless that explains them far worse; the last, that it did.
    `floor` is the least relative noise of a current; `torque_power` (n,) in Ω·A² is T·ω_mech/1.5 of each row, where it is to count;
    `row` is the place, 0 … 1 along the rows, for which `mean_resistance` holds. Raises EstimationError where R and I(∞) are not told apart.
    """
    rows = _Rows(speed, current, flux_linkage, torque_power)
    freedom = float(rows.count - 2)
    explained: list[ShortCurrents] = []
    likeliest: list[float] = []
    for warms in (False, True):
        ends = [_SALIENCIES, *([_TORQUES] if torque_power is not None else []), *([_WARMING, _SHARES] if warms else [])]

        def odds(tried: FloatArray, warms: bool = warms) -> tuple[FloatArray, _Fitted]:
            found = rows.fitted(*_unknowns(tried, warms, torque_power is not None))
            likely = -0.5 * freedom * np.log(found.cost + current.size * floor**2)
            if torque_power is not None:
                likely -= current.size * tried[1]
            likeliest.append(float(np.max(likely)))
            likely -= 0.5 * np.log(found.determinant)
            return likely - 0.5 * ((tried[0] - math.log(USUAL_SALIENCY)) / SALIENCY_SPREAD) ** 2, found

        tried, weight, found = _sampled(odds, np.array(ends))
        risen = _unknowns(tried, warms, torque_power is not None)[1]
        scale = np.sqrt((found.cost + current.size * floor**2) / freedom / found.determinant)
        of_limit, of_resistance = scale * np.sqrt(found.by_resistance), scale * np.sqrt(found.by_limit)
        explained.append(
            ShortCurrents(
                Weighed(found.limit, of_limit, weight, freedom),
                Weighed(tried[0] - found.limit, of_limit, weight, freedom),
                Weighed(found.resistance, of_resistance, weight, freedom),
                Weighed(found.resistance + np.log1p(row * risen), of_resistance, weight, freedom),
            )
        )
        if not warms:
            without = max(likeliest)
    return tuple(explained) if 2.0 * (max(likeliest) - without) < _RIVAL else (explained[1],)


def _unknowns(
    tried: FloatArray, warms: bool, torques: bool
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray | None]:
    """Return logarithm of the saliency, warming, the magnets' share of it, and the logarithm of the torques' noise over the currents'."""
    none = np.zeros_like(tried[0])
    risen, share = (np.exp(tried[-2]) - _SMALL, tried[-1]) if warms else (none, none)
    return tried[0], risen, share, tried[1] if torques else None


def _sampled(
    odds: Callable[[FloatArray], "tuple[FloatArray, _Fitted]"], ends: FloatArray
) -> "tuple[FloatArray, FloatArray, _Fitted]":
    """Return values (k, n) between `ends` (k, 2), their weights, and what fits beside each, by population Monte Carlo."""
    count = ends.shape[0]
    random = np.random.default_rng(_SEED)
    tried = ends[:, :1] + (ends[:, 1:] - ends[:, :1]) * random.random((count, 2 * _TRIED))
    proposed = np.zeros(tried.shape[1])
    last = False
    for left in reversed(range(_ROUNDS)):
        likely, found = odds(tried)
        logs = likely - proposed
        weight = _normal(logs)
        if last or not left:
            break
        # While few values count, the differences are flattened until enough of them do.
        flat = 1.0
        while 1.0 / float(np.sum(weight**2)) < _LEAST:
            flat *= 0.7
            weight = _normal(flat * logs)
        last = flat == 1.0
        centre = tried[:, random.choice(weight.size, _KERNELS, p=weight)]
        least = 1e-12 * np.diag((ends[:, 1] - ends[:, 0]) ** 2)
        root = np.linalg.cholesky(_WIDTH**2 * np.atleast_2d(np.cov(tried, aweights=weight)) + least)
        number = _LAST if last else _TRIED
        drawn = centre[:, random.integers(_KERNELS, size=number)] + root @ random.standard_normal((count, number))
        tried = drawn[:, np.all((drawn > ends[:, :1]) & (drawn < ends[:, 1:]), axis=0)]
        away = np.linalg.inv(root) @ (tried[:, :, None] - centre[:, None, :]).reshape(count, -1)
        proposed = np.log(np.exp(-0.5 * (away**2).sum(0)).reshape(-1, _KERNELS).sum(1))
    return tried, weight, found


def _normal(logs: FloatArray) -> FloatArray:
    weight = np.exp(logs - np.max(logs))
    return np.asarray(weight / float(np.sum(weight)))


@dataclass(frozen=True)
class _Fitted:
    """Logarithms of I(∞) and R for each value tried, sum of squares left, and the normal matrix."""

    limit: FloatArray
    resistance: FloatArray
    cost: FloatArray
    by_limit: FloatArray
    by_resistance: FloatArray
    determinant: FloatArray


class _Rows:
    """The rows of a table, fitted by I(∞) and R for many values of everything else at once."""

    def __init__(self, speed: FloatArray, current: FloatArray, flux: float, power: FloatArray | None) -> None:
        self._along = np.linspace(0.0, 1.0, speed.size)
        self._emf, self._current = np.log(speed * flux), np.log(current)
        self._power = None if power is None else np.log(power)
        self.count = speed.size * (1 if power is None else 2)
        slowest = int(np.argmin(speed))
        self._start = float(np.max(self._current)), float(self._emf[slowest] - self._current[slowest])

    def fitted(self, saliency: FloatArray, risen: FloatArray, share: FloatArray, torques: FloatArray | None) -> _Fitted:
        """Return the fits beside what `_unknowns` names, (n,) each."""
        xi = np.exp(saliency)[:, None]
        warmer, weaker = (np.log1p(each[:, None] * self._along) for each in (risen, -share * risen))
        limit, resistance = (np.full(saliency.size, each) for each in self._start)
        for _ in range(_STEPS):
            y = np.exp(np.clip(self._emf - warmer - (limit + resistance)[:, None], -40.0, 40.0))
            across, reach = (xi * y) ** 2, 1.0 + xi * y**2
            size = limit[:, None] + weaker + np.log(y) + 0.5 * np.log1p(across) - np.log(reach)
            slope = 1.0 + across / (1.0 + across) - 2.0 * xi * y**2 / reach
            left, rises, falls = size - self._current, 1.0 - slope, -slope
            if self._power is not None and torques is not None:
                # By the model's current, not the one read: its noise would stand in both.
                weight = np.exp(-torques)[:, None]
                beside = resistance[:, None] + warmer + 2.0 * size - self._power
                left = np.hstack((left, weight * beside))
                rises, falls = (
                    np.hstack((rises, weight * 2.0 * rises)),
                    np.hstack((falls, weight * (1.0 + 2.0 * falls))),
                )
            aa, bb, ab = (rises**2).sum(1), (falls**2).sum(1), (rises * falls).sum(1)
            a, b, cost = (rises * left).sum(1), (falls * left).sum(1), (left**2).sum(1)
            determinant = np.maximum(aa * bb - ab**2, 1e-12 * (aa + bb) ** 2)
            steps = (bb * a - ab * b) / determinant, (aa * b - ab * a) / determinant
            if max(float(np.max(np.abs(each))) for each in steps) < 1e-7:
                break
            limit = limit - np.clip(steps[0], -_LONGEST, _LONGEST)
            resistance = resistance - np.clip(steps[1], -_LONGEST, _LONGEST)
        if not np.all(np.isfinite(cost)):
            raise EstimationError("the currents do not tell I(∞) and R apart: read at low speeds too")
        return _Fitted(limit, resistance, cost, aa, bb, determinant)
