"""Non-linear least squares of a few parameters, from good start values."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray

_ROUNDS = 200
#: A step below this share of the standard uncertainty is the last one.
_LAST_STEP = 3e-5
#: Share of the curvature that is added to it where a step leads too far.
_LEAST_DAMPING = 1e-3
#: A fit is given up that so many times fell short by more than so many times what it promised.
_PROSPECT, _VOTES = 5.0, 3
#: So too is one that would not come there in the rounds that are left at so many times the pace of its last ones.
_HASTE, _LAST_ONES = 3.0, 4
#: Share of a normal matrix's diagonal that is rounding.
_NOTHING = 1e-14

IntArray = NDArray[np.intp]

#: Gives the residuals (n,) for parameters (k,), and their derivatives (k, n).
Evaluate = Callable[[FloatArray], tuple[FloatArray, FloatArray]]


@dataclass(frozen=True)
class Solution:
    """Optimum: `values` (k,), `covariance` (k, k) for residuals of unit variance, `gain` (k, n) = J⁺, `cost` = Σr²."""

    values: FloatArray
    covariance: FloatArray
    gain: FloatArray
    cost: float


class Minimum(NamedTuple):
    """The minimum of a sum of squares: `values` (k,), `residuals` (n,) and their `slopes` (k, n), `cost` = Σr²; `settled` if no step
    would reduce it further.
    """

    values: FloatArray
    residuals: FloatArray
    slopes: FloatArray
    cost: float
    settled: bool


def minimise(
    evaluate: Evaluate,
    start: FloatArray,
    scale: FloatArray,
    *,
    least: float,
    floor: float,
    rounds: int,
    enough: float = np.inf,
) -> Minimum:
    """Minimise Σ residuals(p)² from `start` by Levenberg's and Marquardt's method; `scale` (k,) is a typical size of a change.

    It has settled where a step would bring the squares down by no more than `least` in units of what a residual leaves on average,
    which counts as no less than `floor`. It is given up where it has little prospect of squares as low as `enough`. Residuals that are
    infinite say that values are none to go to.
    """
    values, damping, hopeless = start, 0.0, 0
    residuals, slopes = evaluate(values)
    cost = float(residuals @ residuals)
    costs: list[float] = []
    for left in range(rounds, 0, -1):
        costs.append(cost)
        if cost > enough and len(costs) > _LAST_ONES + 1:
            pace = (costs[-1 - _LAST_ONES] - cost) / _LAST_ONES
            if cost - enough > _HASTE * left * pace:
                break
        normal, gradient = scale * (slopes @ slopes.T) * scale[:, None], scale * (slopes @ residuals)
        sizes = np.diag(normal)
        step = _newton_step(normal + damping * np.diag(sizes + _NOTHING * np.sum(sizes)), gradient)
        if step is None:
            damping = max(10.0 * damping, _LEAST_DAMPING)
            continue
        fall = float(-gradient @ step)
        if fall <= least * max(floor, cost / residuals.size):
            # So small a last step does what the derivatives say.
            return Minimum(values + step * scale, residuals + (step * scale) @ slopes, slopes, cost - fall, True)
        further = values + step * scale
        tried = evaluate(further)
        reached = float(tried[0] @ tried[0])
        if reached < cost:
            values, cost = further, reached
            residuals, slopes = tried
            damping = 0.1 * damping if damping > _LEAST_DAMPING else 0.0
            # What the derivatives promise without damping, several times over, is the most to hope for.
            hopeless += cost > enough and cost - _PROSPECT * _promised(residuals, slopes) > enough
            if hopeless >= _VOTES:
                break
        else:
            damping = max(10.0 * damping, _LEAST_DAMPING)
    return Minimum(values, residuals, slopes, cost, False)


def minimise_each(
    evaluate: Callable[[FloatArray, IntArray], tuple[FloatArray, FloatArray]],
    starts: FloatArray,
    scale: FloatArray,
    *,
    least: float,
    floor: float,
    rounds: int,
) -> list[Minimum]:
    """Minimise several sums of squares side by side, each from its own of `starts` (m, k), as `minimise` does one.

    `evaluate` gives for parameters (j, k) of those `places` (j,) among the m that have not settled their residuals (j, n), and their
    derivatives (j, k, n).
    """
    places: IntArray = np.arange(len(starts))
    found: dict[int, Minimum] = {}
    values, damping = starts, np.zeros(len(starts))
    residuals, slopes = evaluate(values, places)
    cost = _squares(residuals)
    for _ in range(rounds):
        normal = scale * (slopes @ slopes.swapaxes(-1, -2)) * scale[:, None]
        gradient = scale * (slopes @ residuals[..., None])[..., 0]
        sizes = np.diagonal(normal, axis1=-2, axis2=-1)
        damped = normal.copy()
        np.einsum("jkk->jk", damped)[...] += damping[:, None] * (
            sizes + _NOTHING * np.sum(sizes, axis=-1, keepdims=True)
        )
        step, possible = _newton_steps(damped, gradient)
        fall = -np.einsum("jk,jk->j", gradient, step)
        moved = step * scale
        last = possible & (fall <= least * np.maximum(floor, cost / residuals.shape[-1]))
        for k in map(int, np.flatnonzero(last)):
            # So small a last step does what the derivatives say.
            found[int(places[k])] = Minimum(
                values[k] + moved[k], residuals[k] + moved[k] @ slopes[k], slopes[k], float(cost[k] - fall[k]), True
            )
        if last.any():
            left = ~last
            places, values, moved, damping = places[left], values[left], moved[left], damping[left]
            residuals, slopes, cost = residuals[left], slopes[left], cost[left]
            if not places.size:
                break
        tried_residuals, tried_slopes = evaluate(values + moved, places)
        reached = _squares(tried_residuals)
        better = reached < cost
        damping = np.where(
            better,
            np.where(damping > _LEAST_DAMPING, 0.1 * damping, 0.0),
            np.maximum(10.0 * damping, _LEAST_DAMPING),
        )
        if better.all():
            values, residuals, slopes, cost = values + moved, tried_residuals, tried_slopes, reached
        else:
            values = np.where(better[:, None], values + moved, values)
            residuals[better], slopes[better], cost[better] = (
                tried_residuals[better],
                tried_slopes[better],
                reached[better],
            )
    for k in range(places.size):
        found[int(places[k])] = Minimum(values[k], residuals[k], slopes[k], float(cost[k]), False)
    return [found[place] for place in range(len(starts))]


def _squares(residuals: FloatArray) -> FloatArray:
    return np.asarray(np.einsum("jn,jn->j", residuals, residuals))


def _newton_steps(normal: FloatArray, gradient: FloatArray) -> tuple[FloatArray, NDArray[np.bool_]]:
    """Return −normal⁻¹·gradient (j, k) of each, and which there is; 0 where there is none."""
    try:
        pivots = np.diagonal(np.linalg.cholesky(normal), axis1=-2, axis2=-1)
        possible = ~np.any(pivots**2 < _NOTHING * np.diagonal(normal, axis1=-2, axis2=-1), axis=-1)
        if possible.all():
            return np.asarray(np.linalg.solve(normal, -gradient[..., None])[..., 0]), possible
    except np.linalg.LinAlgError:
        pass
    steps = [_newton_step(own, down) for own, down in zip(normal, gradient, strict=True)]
    possible = np.array([step is not None for step in steps])
    return np.array([np.zeros(gradient.shape[-1]) if step is None else step for step in steps]), possible


def _promised(residuals: FloatArray, slopes: FloatArray) -> float:
    """Return by how much Σ residuals² would fall if they were linear."""
    gradient = slopes @ residuals
    sizes = np.sqrt(np.maximum(np.einsum("kn,kn->k", slopes, slopes), 1e-300))
    normal = slopes @ slopes.T / np.outer(sizes, sizes)
    return float(gradient / sizes @ np.linalg.lstsq(normal, gradient / sizes, rcond=_NOTHING)[0])


def _newton_step(normal: FloatArray, gradient: FloatArray) -> FloatArray | None:
    """Return −normal⁻¹·gradient; None where a parameter does, but for rounding, what others do together."""
    try:
        pivots = np.diag(np.linalg.cholesky(normal))
    except np.linalg.LinAlgError:
        return None
    if np.any(pivots**2 < _NOTHING * np.diag(normal)):
        return None
    return np.asarray(np.linalg.solve(normal, -gradient), dtype=np.float64)


def solve(
    evaluate: Evaluate,
    start: FloatArray,
    scale: FloatArray,
    names: Sequence[str],
    *,
    rounds: int = _ROUNDS,
    last_step: float = _LAST_STEP,
    enough: float = np.inf,
) -> Solution:
    """Minimise Σ residuals(p)² from `start`; `scale` (k,) is a typical size of a change, residuals are of unit variance.

    It ends with a step below `last_step` standard uncertainties, after at most so many `rounds`. Raises EstimationError where it does not
    converge, has little prospect of squares as low as `enough`, or the data leave a parameter undetermined.
    """
    fitted = ", ".join(names)
    # The squares fall by a step's own square in units of its variance.
    solution = minimise(evaluate, start, scale, least=last_step**2, floor=1.0, rounds=rounds, enough=enough)
    if not (solution.settled and np.all(np.isfinite(solution.values))):
        raise EstimationError(f"the fit of {fitted} does not converge; check that the record shows what it should")
    q, r = np.linalg.qr((solution.slopes * scale[:, None]).T)
    sizes = np.linalg.svd(r, compute_uv=False)
    if not sizes[-1] > 1e-10 * sizes[0]:
        raise EstimationError(f"the record does not determine {fitted} apart; take a longer or livelier one")
    inverse = (scale[:, None] * np.linalg.inv(r)) @ q.T
    return Solution(solution.values, inverse @ inverse.T, inverse, solution.cost)
