"""Samples of a posterior by a population that goes from the prior to it in steps (sequential Monte Carlo).

Source: Del Moral, Doucet and Jasra, "Sequential Monte Carlo samplers", J. R. Stat. Soc. B 68 (2006); moves by differences of two
members: ter Braak, "A Markov chain Monte Carlo version of the genetic algorithm differential evolution", Stat. Comput. 16 (2006).
"""

import math
from collections.abc import Callable

import numpy as np

from procedures.estimation.fitting.fit import FloatArray

#: So many members; of them this share must count after each step; steps at most.
_MEMBERS, _COUNTING, _STEPS = 1000, 0.7, 200
#: Moves after each step, and at the end; of the latter each so-many-th population is kept.
_MOVES, _LAST, _KEPT = 20, 60, 5
#: Of all moves this share goes the whole difference of two members, from one maximum to another.
_WHOLE = 0.1
#: A move takes each unknown along with one of these probabilities.
_TAKEN = np.array([0.3, 0.6, 1.0])

Density = Callable[[FloatArray], FloatArray]


def sampled(drawn: FloatArray, prior: Density, likelihood: Density, random: np.random.Generator) -> FloatArray:
    """Return samples (m, n) of the posterior from such of the prior (m, k) for m unknowns.

    `prior` and `likelihood` return logarithms of densities (k,) for values (m, k); minus infinity where a value is not possible.
    """
    members = drawn[:, :_MEMBERS]
    likely, before = likelihood(members), prior(members)
    power, kept = 0.0, []
    for _ in range(_STEPS):
        step = _step(likely, 1.0 - power)
        weight = np.exp(step * (likely - np.max(likely)))
        chosen = _resampled(weight / float(np.sum(weight)), random)
        members, likely, before = members[:, chosen], likely[chosen], before[chosen]
        power = min(power + step, 1.0)
        last = power > 1.0 - 1e-9
        for move in range(_LAST if last else _MOVES):
            members, likely, before = _moved(members, likely, before, power, prior, likelihood, random)
            if last and move % _KEPT == _KEPT - 1:
                kept.append(members)
        if last:
            break
    return np.hstack(kept) if kept else members


def _step(likely: FloatArray, left: float) -> float:
    """Return the largest step of the power at which enough members count."""
    away = likely - np.max(likely)

    def counting(step: float) -> float:
        weight = np.exp(step * away)
        return float(np.sum(weight)) ** 2 / float(np.sum(weight**2))

    least = _COUNTING * likely.size
    if counting(left) >= least:
        return left
    low, high = 0.0, left
    for _ in range(40):
        middle = math.sqrt(low * high) if low > 0.0 else 1e-3 * high
        low, high = (middle, high) if counting(middle) >= least else (low, middle)
    return max(low, 1e-12)


def _resampled(weight: FloatArray, random: np.random.Generator) -> np.ndarray:
    """Return the members' places, each about as often as its weight says (systematic resampling)."""
    places = (np.arange(weight.size) + random.random()) / weight.size
    return np.minimum(np.searchsorted(np.cumsum(weight), places), weight.size - 1)


def _moved(
    members: FloatArray,
    likely: FloatArray,
    before: FloatArray,
    power: float,
    prior: Density,
    likelihood: Density,
    random: np.random.Generator,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return each member moved by the difference of two others in some of its unknowns, where that is likely enough."""
    unknowns, count = members.shape
    places = np.arange(count)
    first, second = ((places + random.integers(1, count, count)) % count for _ in range(2))
    taken = random.random((unknowns, count)) < _TAKEN[random.integers(0, _TAKEN.size, count)]
    moving = np.maximum(taken.sum(0), 1.0)
    length = np.where(
        random.random(count) < _WHOLE, 1.0, 2.38 / np.sqrt(2.0 * moving) * random.uniform(0.4, 1.1, count)
    )
    spread = random.standard_normal(members.shape)
    spread *= 1e-3 * np.std(members, axis=1)[:, None]
    tried = members.take(first, axis=1)
    tried -= members.take(second, axis=1)
    tried *= length
    tried += spread
    tried *= taken
    tried += members
    prior_tried = prior(tried)
    possible = np.flatnonzero(np.isfinite(prior_tried))
    likely_tried = np.full(count, -np.inf)
    likely_tried[possible] = likelihood(tried.take(possible, axis=1))
    better = power * (likely_tried - likely) + prior_tried - before
    accepted = np.log(random.random(count)) < better
    return (
        np.where(accepted, tried, members),
        np.where(accepted, likely_tried, likely),
        np.where(accepted, prior_tried, before),
    )
