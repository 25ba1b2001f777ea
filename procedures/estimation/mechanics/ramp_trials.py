"""Fits of ramps by trial: with one more term, and by all laws of one cause."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics.ramp_causes import Family, Periodic, families
from procedures.estimation.mechanics.ramp_model import RampModel, Solved
from procedures.estimation.mechanics.ramp_terms import Terms
from procedures.estimation.mechanics.stribeck_laws import average, fitted, unseen

#: Laws of friction at low speed whose χ² is further from the best one's are not averaged over.
_OPEN = 25.0
#: How often what no parameter stands for is sought closer, and by how much.
_REFINED, _CLOSER = 2, 0.3
#: A trial is settled where a round would move an estimate by a thousandth of its uncertainty, and given up after so many rounds: a
#: hundred trials of a record that no term explains would go on for long.
_SETTLED, _ROUNDS = 1e-6, 30


@dataclass(frozen=True)
class RampTrial:
    """A fit, what its estimates move (k,) for a standard deviation of what was found by trial, and all fits of that trial."""

    model: RampModel
    solved: Solved
    moved: FloatArray
    trial: tuple["RampTrial", ...] = ()

    @property
    def cost(self) -> float:
        """χ²."""
        return self.solved.cost


def fits_with_one_more(best: RampTrial, found: Periodic | None) -> list[tuple[Cause, RampTrial]]:
    """Return the best fits with one more term each, those left out that no physics makes."""
    fits = [(family.cause, _best_of(best, family)) for family in families(best.model, found)]
    return [(cause, each) for cause, each in fits if each is not None]


def _best_of(best: RampTrial, family: Family) -> RampTrial | None:
    """Return the best fit of a family; what its grid leaves open moves the estimates."""
    shared = best.moved.size
    last, costs, fits = best.solved.values, [], []
    for value in family.grid:
        fitted = refitted(best, family.at(float(value)), last)
        possible = fitted is not None and _possible(family.cause, fitted)
        costs.append(fitted.cost if possible and fitted is not None else np.inf)
        fits.append(fitted)
        last = last if fitted is None else fitted.solved.values
    place = int(np.argmin(costs))
    chosen = fits[place]
    if chosen is None or not np.isfinite(costs[place]):
        return None
    tried = [each for each, cost in zip(fits, costs, strict=True) if each is not None and np.isfinite(cost)]
    chosen = replace(chosen, trial=tuple(tried))
    inner = 0 < place < len(costs) - 1
    before = fits[place - 1] if place > 0 else None
    if before is not None and place == len(costs) - 1:
        # What lies beyond the grid may be likelier still.
        return replace(chosen, moved=chosen.solved.values[:shared] - before.solved.values[:shared])
    if not inner or not np.all(np.isfinite(costs[place - 1 : place + 2])):
        return chosen
    # A parabola through three, and once more through closer ones.
    step, middle = float(np.log(family.grid[place + 1] / family.grid[place])), float(np.log(family.grid[place]))
    for _ in range(_REFINED):
        low, at, high = costs[place - 1 : place + 2]
        middle += 0.5 * step * float(np.clip((low - high) / max(low + high - 2.0 * at, 1e-9), -1.0, 1.0))
        step *= _CLOSER
        three_near = np.exp(middle + step * np.array((-1.0, 0.0, 1.0)))
        near = [refitted(best, family.at(float(value)), last) for value in three_near]
        if any(each is None for each in near):
            return replace(chosen, trial=tuple(tried))
        three = [each for each in near if each is not None]
        tried += three
        chosen = min((chosen, *three), key=lambda each: each.cost)
        costs, place = [each.cost for each in three], 1
    bend = max((costs[0] + costs[2] - 2.0 * costs[1]) / step**2, 1e-9)
    slope = (three[2].solved.values[:shared] - three[0].solved.values[:shared]) / (2.0 * step)
    return replace(chosen, moved=slope * min(float(np.sqrt(2.0 / bend)), 1.0), trial=tuple(tried))


def refitted(best: RampTrial, terms: Terms, start: FloatArray) -> RampTrial | None:
    """Return a fit with other terms; None where the record does not determine them."""
    further = best.model.with_terms(terms)
    shared = best.moved.size
    values = further.start(start[:shared])
    count = shared + len(best.model.runs)
    values[:count] = start[:count]
    try:
        solved = further.solve(values, least=_SETTLED, rounds=_ROUNDS)
    except EstimationError:
        return None
    return RampTrial(further, solved, np.zeros(shared))


def _possible(cause: Cause, fitted: RampTrial) -> bool:
    """Return whether a term has the sign that its cause gives it."""
    if cause is Cause.STRIBECK:
        return fitted.model.amount("stribeck", fitted.solved.values) > 0.0
    if cause is Cause.TORQUE_FILTER:
        return fitted.model.amount("torque_filter", fitted.solved.values) > 0.0
    if cause is Cause.SPEED_FILTER:
        return fitted.model.lags(fitted.solved)
    return True


def averaged(best: RampTrial, tried: Sequence[RampTrial], shared: int) -> tuple[FloatArray, FloatArray]:
    """Return what the laws of friction that grows at low speed move the estimates by (k,), and how far off they may be then (k,).

    Where one is in the model, all that were tried count, with what else is in the model now.
    """
    model, solved = best.model, best.solved
    values, law = solved.values[:shared], model.terms.stribeck
    coulomb = abs(float(values[-3]))
    air = (coulomb / model.top + abs(float(values[-2]))) / model.top + abs(float(values[-1]))
    if law is None:
        laws = unseen(model, solved, shared)
    else:
        coulomb += model.amount("stribeck", solved.values)
        laws = [fitted(each.model, each.solved, shared, width) for each, width in _with_widths(best, tried)]
    if not laws:
        return np.zeros(shared), np.zeros(shared)
    mean, variance = average(laws, coulomb, air)
    return mean - values, np.sqrt(np.maximum(variance - np.diag(solved.covariance)[:shared], 0.0))


def _with_widths(best: RampTrial, tried: Sequence[RampTrial]) -> Iterator[tuple[RampTrial, float]]:
    """Give the fits of laws that the record leaves open, and the part of the logarithm of the speeds that each stands for."""
    for power in {law.power for each in tried if (law := each.model.terms.stribeck)}:
        of_power = [(law.speed, each) for each in tried if (law := each.model.terms.stribeck) and law.power == power]
        of_power.sort(key=lambda each: each[0])
        speeds = np.log([speed for speed, _ in of_power])
        edges = np.concatenate((speeds[:1], 0.5 * (speeds[1:] + speeds[:-1]), speeds[-1:]))
        least = min(each.cost for each in tried)
        for (_, each), width in zip(of_power, np.diff(edges), strict=True):
            if width <= 0.0 or each.cost > least + _OPEN:
                continue
            terms = replace(best.model.terms, stribeck=each.model.terms.stribeck)
            same = best.model.size == each.model.size and terms == each.model.terms
            again = each if same else refitted(best, terms, best.solved.values)
            if again is not None:
                yield again, float(width)
