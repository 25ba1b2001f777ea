"""The fit of ramps, with terms for effects beyond inertia and friction, and intervals that include what no term explains."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import ALARM, Answer, Cause, Finding, Misfit, none_explains
from procedures.estimation.fitting.noise import undithered
from procedures.estimation.mechanics.coarse_speed import counted_pulses, held_readings
from procedures.estimation.mechanics.ramp_causes import (
    Look,
    Periodic,
    excess,
    look,
    periodic,
    scatter_of_parts,
)
from procedures.estimation.mechanics.ramp_model import RampModel, noise_of
from procedures.estimation.mechanics.ramp_trials import (
    RIVAL,
    RampTrial,
    averaged,
    counting_late_scatter,
    each_by_itself,
    fits_with_one_more,
    with_another_clock,
)
from procedures.estimation.mechanics.turning import Run, dropouts

#: A term is one where χ² falls by so much.
_ACCEPTED = 9.0
_MOST_TERMS = 3
#: Sums over parts beyond what this share of clean records show are the sign of something unknown.
_CHANCE = 3e-4
#: What is told whether terms explain a record or not.
_IN_ANY_CASE = (Cause.WINDAGE, Cause.TOO_COARSE)
#: No grease follows a law: this share of a drift is a standard uncertainty of the friction that drifts.
_NO_LAW = 0.02
#: Standard uncertainties that an interval reaches to each side.
_REACHES = 1.96
#: By how much more than the parts of a record differ its figures may be off.
_PARTS_GROW = 1.5


@dataclass(frozen=True)
class ExplainedRamps:
    """Estimates (k,) and covariance (k, k) of inertia, the three frictions and the initial speeds, and what was found."""

    values: FloatArray
    covariance: FloatArray
    speeds: FloatArray
    freedom: int
    misfit: Misfit


def explain(runs: Sequence[Run], start: FloatArray, *, unit_torque: bool) -> ExplainedRamps:
    """Fit ramps, add what they show as long as it explains them, and widen what nothing explains."""
    model = RampModel(runs, unit_torque=unit_torque)
    shared = 3 if unit_torque else 4
    best = RampTrial(model, model.solve(model.start(start)), np.zeros(shared))
    findings: list[Finding] = []
    rivals: list[RampTrial] = []
    laws: list[RampTrial] = []
    sticking: list[RampTrial] = []
    moved = [best.moved]
    seen, found = look(best.model, best.solved), periodic(best.model, best.solved)
    for _ in range(_MOST_TERMS):
        if not (np.any(seen.score.alarms) or found):
            break
        tried = fits_with_one_more(best, found, seen)
        if not tried:
            break
        cause, further = min(tried, key=lambda each: each[1].cost)
        added = further.model.size - best.model.size
        if best.cost - further.cost < _ACCEPTED + 2.0 * (added - 1):
            break
        rivals = [each for _, each in tried if each is not further and each.cost < further.cost + RIVAL]
        if cause is Cause.STRIBECK:
            # A real bearing follows neither law: what lies between them is as likely as either.
            laws += [each for other, each in tried if other is cause and each is not further]
            sticking = [each for other, best_of in tried if other is cause for each in best_of.trial]
        if cause is Cause.FRICTION_DRIFT:
            # Nor does grease follow one: whatever time constant is as likely is in the interval.
            drifts = [each for other, best_of in tried if other is cause for each in best_of.trial]
            clock = with_another_clock(best)
            drifts += [clock] if clock else []
            laws += [each for each in drifts if each.cost < further.cost + RIVAL]
        moved.append(further.moved)
        findings.append(_finding(cause, best, further, found, seen))
        best = counting_late_scatter(further) if cause is Cause.TORQUE_FILTER else further
        seen, found = look(best.model, best.solved), periodic(best.model, best.solved)
    unexplained = bool(np.any(seen.score.alarms) or found) or scatter_of_parts(best.model, best.solved) < _CHANCE
    values, covariance = best.solved.values, best.solved.covariance.copy()
    count = shared + len(runs)
    covariance += _coarse(best, runs)
    for each in moved:
        covariance[:shared, :shared] += np.outer(each, each)
    covariance = _grown(_spanned(covariance, best.solved.values, [*rivals, *laws], shared), _of_drift(best, shared))
    if unexplained:
        score = seen.clearest() if np.any(seen.score.alarms) else 0.0
        freedom = best.model.measured.size - best.model.size
        covariance = covariance * max(1.0, best.cost / freedom)
    if findings or unexplained:
        # What explains one record may have taken the place of what is not known here.
        covariance = _grown(covariance, _from_parts(best, shared))
    likely, off = averaged(best, sticking, shared)
    covariance, values = _grown(covariance, off), values.copy()
    values[:shared] += likely
    if unit_torque and len(runs) > 1 and (unexplained or best.model.terms.drift is not None):
        # Where friction drifts, the figures are those at the beginning.
        alone = each_by_itself(best)[: None if unexplained else 1]
        covariance = _spanned(covariance, values, alone, shared)
    growth = seen.growth()
    scale = np.ones(values.size)
    scale[: growth.size] = np.sqrt(growth[: values.size])
    scale[shared:] = 1.0
    covariance = covariance * np.outer(scale, scale)
    findings, lost = _windage(best, covariance, shared) + findings, dropouts(runs)
    findings = counted_pulses(runs, best.model.top) + findings
    if unexplained:
        given = _brakes(best.model, values, covariance)
        unknown = Finding(Cause.UNEXPLAINED, Answer.WIDENED if given else Answer.WITHHELD, score=score)
        if given:
            # Terms that leave the record unexplained are no causes that were found; what the fan takes is in every model.
            in_vain = [each for each in findings if each.cause not in _IN_ANY_CASE]
            findings = [each for each in findings if each.cause in _IN_ANY_CASE]
            findings.append(none_explains(unknown, in_vain, "ramp"))
        else:
            coarse = held_readings(runs, best.solved.speeds)
            findings = [coarse or none_explains(unknown, findings, "ramp")]
            # Where readings are held, those beside a jump look wild.
            lost = lost if coarse is None else []
    findings += lost
    return ExplainedRamps(
        values[:count],
        covariance[:count, :count],
        best.solved.speeds,
        best.model.measured.size - count,
        Misfit(tuple(findings)),
    )


def _brakes(model: RampModel, values: FloatArray, covariance: FloatArray) -> bool:
    """Whether the Coulomb friction may be one at all, and a coast-down's is known by less than the whole friction in its middle.

    Where it is not so, what slowed the shaft down was no friction of the model: a hand or a belt came in.
    """
    at = 0 if model.unit_torque else 1
    middle = float(np.median(np.concatenate([run.speed for run in model.runs])))
    whole = float(values[at : at + 3] @ np.array([1.0, middle, middle**2]))
    u = math.sqrt(float(covariance[at, at]))
    return float(values[at]) + 2.0 * u > 0.0 and (u < whole or not model.unit_torque)


def _finding(cause: Cause, before: RampTrial, after: RampTrial, found: Periodic | None, seen: Look) -> Finding:
    terms, values = after.model.terms, after.solved.values
    figures: dict[str, float | str] = {}
    score = seen.clearest(cause) or float(np.sqrt(max(before.cost - after.cost, 0.0)))
    if cause is Cause.STRIBECK and terms.stribeck is not None:
        coulomb = values[0 if after.model.unit_torque else 1]
        figures = {
            "share": after.model.amount("stribeck", values) / abs(float(coulomb)),
            "speed": float(terms.stribeck.speed),
        }
    elif cause is Cause.FRICTION_DRIFT and terms.drift is not None:
        figures = {"share": after.model.drifted(values), "time": terms.drift.end}
    elif cause is Cause.SPEED_FILTER:
        figures = {"time_constant": float(terms.speed_filter)}
    elif cause is Cause.TORQUE_FILTER:
        figures = {"time_constant": after.model.amount("torque_filter", values)}
    elif found is not None:
        score, figures = found.score, {"order": float(found.order)}
        if found.between * found.order > math.pi:
            figures["record"] = "ramp-seldom"
    return Finding(cause, Answer.MODELLED, score=score, figures=figures)


def _windage(best: RampTrial, covariance: FloatArray, shared: int) -> list[Finding]:
    """Return what is to be told of friction that grows with the square of speed; the term is in every fit."""
    place = shared - 1
    quadratic, uncertainty = float(best.solved.values[place]), float(np.sqrt(covariance[place, place]))
    if not quadratic > ALARM * uncertainty:
        return []
    top = best.model.top
    braking = float(best.solved.values[place - 2] + top * best.solved.values[place - 1] + top**2 * quadratic)
    figures: dict[str, float | str] = {"share": quadratic * top**2 / braking, "speed": top}
    return [Finding(Cause.WINDAGE, Answer.MODELLED, score=quadratic / uncertainty, figures=figures)]


def _coarse(best: RampTrial, runs: Sequence[Run]) -> FloatArray:
    """Return the covariance (k, k) that speeds leave which jump in steps larger than their noise: off for a good part of a ramp."""
    model, solved = best.model, best.solved
    gain = solved.covariance @ solved.slopes
    covariance = np.zeros_like(solved.covariance)
    for k, run in enumerate(runs):
        steps = max(float(np.ptp(run.speed)) / run.resolution, 1.0) if run.resolution > 0 else 1.0
        shift = gain[:, model.part(k)].sum(axis=1) * undithered(noise_of(run), run.resolution) / noise_of(run)
        covariance += np.outer(shift, shift) / steps
    return covariance


def _of_drift(best: RampTrial, shared: int) -> FloatArray:
    """Return how far off the estimates (k,) may be for what friction that drifts does otherwise than its laws, and before the ramps."""
    off, drift = np.zeros(shared), best.model.terms.drift
    if drift is not None:
        amplitude = _NO_LAW * abs(best.model.amount("drift", best.solved.values))
        off[shared - 2 if drift.top else shared - 3] = amplitude / (drift.top or 1.0)
    return off


def _spanned(covariance: FloatArray, values: FloatArray, rivals: Sequence[RampTrial], shared: int) -> FloatArray:
    """Return the covariance of `values` (k,) grown until the intervals hold those of terms that cannot be told from the best one."""
    own = np.sqrt(np.diag(covariance))[:shared]
    reach = _REACHES * own
    for each in rivals:
        off = np.abs(each.solved.values[:shared] - values[:shared])
        reach = np.maximum(reach, off + _REACHES * np.sqrt(np.diag(each.solved.covariance))[:shared])
    return _scaled(covariance, reach / (_REACHES * np.where(own > 0.0, own, 1.0)))


def _grown(covariance: FloatArray, off: FloatArray) -> FloatArray:
    """Return the covariance (k, k) grown by what estimates (m,) may be off."""
    own = np.sqrt(np.diag(covariance))[: off.size]
    return _scaled(covariance, np.sqrt(1.0 + (off / np.where(own > 0.0, own, 1.0)) ** 2))


def _scaled(covariance: FloatArray, factors: FloatArray) -> FloatArray:
    scale = np.ones(len(covariance))
    scale[: factors.size] = factors
    return np.asarray(covariance * np.outer(scale, scale))


def _from_parts(best: RampTrial, shared: int) -> FloatArray:
    """Return how far off the estimates (k,) may be by what they are without a fifth of each ramp."""
    values, variances = [], []
    for fifth in range(5):
        model, start = best.model.without(best.solved, fifth)
        try:
            solved = model.solve(start)
        except EstimationError:
            continue
        values.append(solved.values[:shared])
        variances.append(np.diag(solved.covariance)[:shared])
    own = np.diag(best.solved.covariance)[:shared]
    return _PARTS_GROW * excess(values, variances, best.solved.values[:shared], own)
