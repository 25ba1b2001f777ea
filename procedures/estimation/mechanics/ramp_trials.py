"""Fits of ramps by trial: with one more term, and by all laws of one cause."""

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import minimize_scalar

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.mechanics.ramp_causes import Family, Look, Periodic, families
from procedures.estimation.mechanics.ramp_model import RampModel, Solved
from procedures.estimation.mechanics.ramp_terms import Terms
from procedures.estimation.mechanics.stribeck_laws import average, fitted, unseen

#: Laws of friction at low speed whose χ² is further from the best one's are not averaged over.
_OPEN = 25.0
#: How often what no parameter stands for is sought closer, and by how much.
_REFINED, _CLOSER = 2, 0.3
#: How closely (of its logarithm) the lowest place is enclosed where that does not find it.
_ENCLOSED = 0.01
#: Terms whose χ² is within so much of the best one's cannot be told from it; none closer to a place of a grid falls by more than so many
#: times what a parabola through its neighbours does.
RIVAL, _OFTEN = 12.0, 4.0
#: No friction drifts by as much as itself while ramps are recorded.
_MOST_DRIFT = 1.0
#: A drift that is seen by less (standard deviations) lowers χ² by too little to be tried.
_SEEN = 2.0
#: A trial is settled where a last step, which is taken, would move an estimate by a hundredth of its uncertainty, and given up after so
#: many rounds: of a hundred trials of a record, those that come nowhere would go on longest.
_SETTLED, _ROUNDS = 1e-4, 12


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


def fits_with_one_more(best: RampTrial, found: Periodic | None, seen: Look) -> list[tuple[Cause, RampTrial]]:
    """Return the best fits with one more term each, those left out that no physics makes, and a drift of which too little is `seen`."""
    drifts = abs(seen.clearest(Cause.FRICTION_DRIFT)) > _SEEN
    tried = [each for each in families(best.model, found) if drifts or each.cause is not Cause.FRICTION_DRIFT]
    searches = [each for family in tried if (each := _Search.over(best, family)) is not None]
    least = min((each.chosen.cost for each in searches), default=np.inf)
    close = {each.family.cause for each in searches if each.expected() < least + RIVAL}
    return [(each.family.cause, each.closer() if each.family.cause in close else each.chosen) for each in searches]


def with_another_clock(best: RampTrial) -> RampTrial | None:
    """Return the fit in which seconds grow longer or shorter along the ramps, which looks much like friction that drifts."""
    model, values = best.model, best.solved.values
    shape = np.empty(model.measured.size)
    for k, turned in enumerate(model.turned):
        late = turned * (1.0 - turned / model.turned[-1][-1])
        shape[model.part(k)] = model.trajectory(k, values).acceleration * late
    return refitted(best, replace(model.terms, added=(*model.terms.added, shape)), values)


def each_by_itself(best: RampTrial) -> list[RampTrial]:
    """Return fits of coast-downs one by one, none where these explain the readings worse than all together do.

    Friction that is another in each record, as on another day, looks much like friction that drifts.
    """
    law, lag, none_moved = best.model.terms.stribeck, best.model.terms.speed_filter, np.zeros(best.moved.size)
    fits = []
    for run in best.model.runs:
        plain = RampModel([run], unit_torque=True)
        tried = []
        for model in (plain, plain.with_terms(Terms(stribeck=law, speed_filter=lag))):
            with suppress(EstimationError):
                solved = model.solve(model.start(best.solved.values[: best.moved.size]))
                tried.append(RampTrial(model, solved, none_moved))
        if not tried:
            return []
        fits.append(min(tried, key=lambda each: each.cost))
    return fits if sum(each.cost for each in fits) < best.cost + RIVAL else []


@dataclass(frozen=True)
class _Search:
    """Fits of a `family` over its grid, None where there is none, their χ² (`costs`), and the `chosen` one at its `place`."""

    best: RampTrial
    family: Family
    fits: list[RampTrial | None]
    costs: list[float]
    place: int
    chosen: RampTrial

    @classmethod
    def over(cls, best: RampTrial, family: Family) -> "_Search | None":
        """Fit a family at all places of its grid; None where none of them is possible."""
        fits = _refitted_each(best, family, family.grid, best.solved.values)
        costs = [each.cost if each is not None and _possible(family.cause, each) else np.inf for each in fits]
        place = int(np.argmin(costs))
        chosen = fits[place]
        if chosen is None or not np.isfinite(costs[place]):
            return None
        tried = tuple(each for each, cost in zip(fits, costs, strict=True) if each is not None and np.isfinite(cost))
        return cls(best, family, fits, costs, place, replace(chosen, trial=tried))

    @property
    def _inside(self) -> bool:
        """Whether there are possible fits on both sides of the chosen one."""
        around = self.costs[max(self.place - 1, 0) : self.place + 2]
        return len(around) == 3 and bool(np.all(np.isfinite(around)))

    def expected(self) -> float:
        """Return what χ² may be closer to the best place of the grid, several times over."""
        if not self._inside:
            return self.chosen.cost
        low, at, high = self.costs[self.place - 1 : self.place + 2]
        return at - _OFTEN * (low - high) ** 2 / (8.0 * max(low + high - 2.0 * at, 1e-9))

    def closer(self) -> RampTrial:
        """Return the best fit, sought closer than the grid; what is left open moves the estimates."""
        chosen, place, shared = self.chosen, self.place, self.best.moved.size
        before = self.fits[place - 1] if place > 0 else None
        if before is not None and place == len(self.costs) - 1:
            # What lies beyond the grid may be likelier still.
            return replace(chosen, moved=chosen.solved.values[:shared] - before.solved.values[:shared])
        if not self._inside:
            return chosen
        grid, tried = self.family.grid, list(chosen.trial)
        costs = self.costs[place - 1 : place + 2]
        ends = float(np.log(grid[place - 1])), float(np.log(grid[place + 1]))
        # A parabola through three, and once more through closer ones.
        step, middle = float(np.log(grid[place + 1] / grid[place])), float(np.log(grid[place]))
        three: list[RampTrial] = []
        for times in range(_REFINED + 1):
            if times < _REFINED:
                low, at, high = costs
                middle += 0.5 * step * float(np.clip((low - high) / max(low + high - 2.0 * at, 1e-9), -1.0, 1.0))
                step *= _CLOSER
            elif chosen is three[1]:
                break
            else:
                # Where χ² is no parabola over so coarse a grid, its lowest place is enclosed.
                found = minimize_scalar(self._cost, bounds=ends, method="bounded", options={"xatol": _ENCLOSED})
                middle, step = float(found.x), _ENCLOSED
            near = _refitted_each(
                self.best, self.family, np.exp(middle + step * np.array((-1.0, 0.0, 1.0))), chosen.solved.values
            )
            three = [each for each in near if each is not None]
            if len(three) < 3:
                return replace(chosen, trial=tuple(tried))
            tried += three
            chosen = min((chosen, *three), key=lambda each: each.cost)
            costs = [each.cost for each in three]
        bend = max((costs[0] + costs[2] - 2.0 * costs[1]) / step**2, 1e-9)
        slope = (three[2].solved.values[:shared] - three[0].solved.values[:shared]) / (2.0 * step)
        return replace(chosen, moved=slope * min(float(np.sqrt(2.0 / bend)), 1.0), trial=tuple(tried))

    def _cost(self, logarithm: float) -> float:
        fit = refitted(self.best, self.family.at(float(np.exp(logarithm))), self.chosen.solved.values)
        return np.inf if fit is None else fit.cost


def _refitted_each(best: RampTrial, family: Family, grid: FloatArray, start: FloatArray) -> list[RampTrial | None]:
    """Return the fits at places of a family's grid, side by side from one start; where that is too far, from the place before."""
    terms = [family.at(float(value)) for value in grid]
    if len(terms) == 1:
        return [refitted(best, terms[0], start)]
    fits = _side_by_side(best, family.at(grid[:, None]), terms, start)
    for place in range(1, len(fits)):
        before = fits[place - 1]
        if fits[place] is None and before is not None:
            fits[place] = refitted(best, terms[place], before.solved.values)
    return fits


def _side_by_side(
    best: RampTrial, together: Terms, terms: Sequence[Terms], start: FloatArray
) -> list[RampTrial | None]:
    """Return the fits with other terms, which are also given `together`; None where the record does not determine them."""
    further = best.model.with_terms(together)
    try:
        fits = further.solve_each(_start(best, further, start), least=_SETTLED, rounds=_ROUNDS)
    except EstimationError:
        return [None] * len(terms)
    none_moved = np.zeros(best.moved.size)
    return [
        None if each is None else RampTrial(best.model.with_terms(own), each, none_moved)
        for own, each in zip(terms, fits, strict=True)
    ]


def _start(best: RampTrial, further: RampModel, start: FloatArray) -> FloatArray:
    """Return where a fit begins: without terms, at the other values of a `start`."""
    values = further.start(start[: best.moved.size])
    count = best.moved.size + len(best.model.runs)
    values[:count] = start[:count]
    return values


def refitted(best: RampTrial, terms: Terms, start: FloatArray) -> RampTrial | None:
    """Return a fit with other terms; None where the record does not determine them."""
    further = best.model.with_terms(terms)
    try:
        solved = further.solve(_start(best, further, start), least=_SETTLED, rounds=_ROUNDS)
    except EstimationError:
        return None
    return RampTrial(further, solved, np.zeros(best.moved.size))


def counting_late_scatter(found: RampTrial) -> RampTrial:
    """Return a fit with a torque filter whose speeds count with the scatter of the torque that the filter's undoing makes larger."""
    model, solved = found.model.with_late_scatter(found.solved)
    # Where something else is amiss, the next term may begin here.
    with suppress(EstimationError):
        solved = model.solve(solved.values, least=_SETTLED, rounds=_ROUNDS)
    return replace(found, model=model, solved=solved)


def _possible(cause: Cause, fitted: RampTrial) -> bool:
    """Return whether a term has the sign that its cause gives it."""
    if cause is Cause.STRIBECK:
        return fitted.model.amount("stribeck", fitted.solved.values) > 0.0
    if cause is Cause.TORQUE_FILTER:
        return fitted.model.amount("torque_filter", fitted.solved.values) > 0.0
    if cause is Cause.SPEED_FILTER:
        return fitted.model.lags(fitted.solved)
    if cause is Cause.FRICTION_DRIFT:
        return abs(fitted.model.drifted(fitted.solved.values)) < _MOST_DRIFT
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
        of_power = [
            (float(law.speed), each) for each in tried if (law := each.model.terms.stribeck) and law.power == power
        ]
        of_power.sort(key=lambda each: each[0])
        speeds = np.log([speed for speed, _ in of_power])
        edges = np.concatenate((speeds[:1], 0.5 * (speeds[1:] + speeds[:-1]), speeds[-1:]))
        least = min(each.cost for each in tried)
        open_still = [
            (each, float(width))
            for (_, each), width in zip(of_power, np.diff(edges), strict=True)
            if width > 0.0 and each.cost <= least + _OPEN
        ]
        again = _again(best, [each for each, _ in open_still])
        yield from ((each, width) for each, (_, width) in zip(again, open_still, strict=True) if each is not None)


def _again(best: RampTrial, fits: Sequence[RampTrial]) -> list[RampTrial | None]:
    """Return fits of one law's speeds with what else is in the model now."""
    terms = [replace(best.model.terms, stribeck=each.model.terms.stribeck) for each in fits]
    other = [k for k, each in enumerate(fits) if best.model.size != each.model.size or terms[k] != each.model.terms]
    result: list[RampTrial | None] = list(fits)
    laws = [law for k in other if (law := terms[k].stribeck)]
    if laws:
        together = replace(best.model.terms, stribeck=replace(laws[0], speed=np.array([[law.speed] for law in laws])))
        start = best.solved.values
        for k, each in zip(other, _side_by_side(best, together, [terms[k] for k in other], start), strict=True):
            result[k] = each
    return result
