"""Effects in a current step beside resistance and inductance: found by a score test, modelled, or reported."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import ALARM, Answer, Cause, Finding, Score, none_explains, score_test
from procedures.estimation.fitting.noise import MAINS
from procedures.estimation.winding.current_step.bends import bend_in
from procedures.estimation.winding.current_step.divider import Divider, divider_in
from procedures.estimation.winding.current_step.fit import Fitted, Problem, fit_with, scale_of
from procedures.estimation.winding.current_step.hum import HumOfBoth, hum_of_voltage
from procedures.estimation.winding.current_step.large_hum import LargeHum, seen_before
from procedures.estimation.winding.current_step.lost_samples import LostSamples, elsewhere, lost_in, soon_lost
from procedures.estimation.winding.current_step.ringing import Resonance, RingingEdge, ringing_in
from procedures.estimation.winding.current_step.saturation import BentChannel, bent, lost, rises
from procedures.estimation.winding.current_step.term import StepModel, StepScale, Term, figures_of
from procedures.estimation.winding.current_step.terms import TERMS, Direction, directions, hum_on_current
from procedures.estimation.winding.current_step.unexplained import no_figure, of_parts, structured
from procedures.estimation.winding.current_step.variance import StepVariance

#: A term is accepted where χ² falls by so much; what is within so much of the best is as likely. In units of the noise's variance.
_ACCEPTED, _AS_LIKELY, _MOST_TERMS = 9.0, 12.0, 3
#: A term is tried again in place of an earlier one where it left no more than so many times as much unexplained in that round.
_NEAR = 10.0
#: A gap is sought closer, and an inductance that rises is as likely as a bend, where it explains this share of what the best term does.
_HALF = 0.5
#: Families whose terms are one direction, so that each has to be fitted.
_SEVERAL = ("skew", "saturation", "coupling")
#: Families with terms that their direction does not stand for.
_HIDDEN = ("saturation", Divider.family)
#: A term is fitted where its direction is seen by so much, and by this share of what is seen best.
_WORTH, _WORTH_SHARE = 2.0, 0.3
#: Where rounding is not hidden by noise, the test says little; what counts is seen by so much.
COARSE_ALARM = 10.0
#: So much of a direction's square is chance. Where no cause was found it is of many directions the one seen best: as much as keeps
#: intervals of clean records below 1.5 times the plain fit's on average.
_CHANCE, _CHANCE_OF_NONE = 1.0, 2.0
#: Of two explanations that no record tells apart the truth is at one end of what they span: the interval reaches so much further, for
#: limits of gain are added to it as a root of squares, which does not move an end by as much as they do.
_TWO_ENDS = 1.35
#: A bend may be the cause where it leaves no more than this share of what others explain: probes follow no law.
_OF_ANOTHER = 0.02
#: But no more than so many times what those leave.
_AS_NOISY = 2.0
#: Families of what is read beside the current.
_BESIDE = ("hum", "third", "slope")
#: Lateness, in the winding's time constants, from which a channel's second order may show, and the damping that is tried for it.
_LATE, _DAMPED = 0.005, 0.6
#: Dampings that are tried for a channel that is late and rings.
_RINGING = (0.2, 0.6)


@dataclass(frozen=True)
class StepJudgement:
    """A fit after the search: resistance and inductance (2,) with their `covariance` factor, and what was found.

    `values` are those of the fitted parameters, `growth` (k,) is by what the variances of their noise grow, `apart` (k,) a standard
    uncertainty beside them, from other explanations.
    """

    fitted: Fitted
    values: FloatArray
    growth: FloatArray
    apart: FloatArray
    findings: tuple[Finding, ...]
    named: tuple[Direction, ...]
    score: Score


def tested(step: Problem, fitted: Fitted, scale: StepScale) -> tuple[list[Direction], Score]:
    """Return the directions that a record was tested for, and what was seen of them."""
    record = step.record
    # Channel and circuit as they were found; what is read beside the current does not flow.
    flowing = StepModel(record, fitted.terms, scale).unread(fitted.current, fitted.full, fitted.figures)
    named, rows = directions(record, fitted.full, flowing, scale)
    white = np.zeros((len(rows), fitted.residuals.size))
    white[:, : record.time.size] = step.white.apply(rows)
    score = score_test(fitted.residuals, fitted.slopes, white, StepVariance(step, fitted))
    return named, score


def judge(step: Problem, plain: Fitted, *, alarm: float) -> StepJudgement:
    """Search for what a plain fit does not hold, and return the fit with it, with what it does to the uncertainties.

    A direction counts as seen beyond `alarm` standard deviations. Where `plain` has a term, it is that of large hum.
    """
    scale = scale_of(step.record, plain)
    accepted = min(_ACCEPTED, _ACCEPTED * (alarm / ALARM) ** 2)
    fitted, seen, rounds = plain, {}, [[plain]]
    hums = hum_of_voltage(step, plain, scale)
    large = [LargeHum(frequency) for frequency in MAINS] if plain.terms else []
    certain = hums.certain or bool(large)
    begun: list[tuple[Term, ...]] = [(hum,) for hum in (*large, *hums.terms)] if certain else []
    if found := list(_possible(step, begun, fitted, scale, np.inf)):
        # What voltage or current show before the step is there, whatever else is.
        rounds.append(found)
        fitted = min(found, key=lambda f: f.cost)
        by_frequency = (seen_before(step.record, f) for f in MAINS) if large else ()
        seen[fitted.terms[0]] = max((hums.score, *by_frequency))
    named, score = tested(step, fitted, scale)
    ring, lost = ringing_in(step, fitted, scale, alarm=alarm), lost_in(step, fitted, scale, alarm=alarm)
    while len(fitted.terms) < _MOST_TERMS:
        if ring is None and lost is None and not any(abs(z) > alarm for z in _left(fitted, named, score)):
            break
        gaps = list(_possible(step, [(*fitted.terms, lost)] if lost else [], fitted, scale, fitted.cost + _AS_LIKELY))
        found = list(_candidates(step, fitted, named, score, scale, ring, hums.terms))
        least = min((f.cost for f in found), default=np.inf)
        # Its own place is looked for where a gap explains as much as half of what something else does.
        gaps = [gap for gap in gaps if fitted.cost - gap.cost > _HALF * (fitted.cost - least)]
        found = [*(other for gap in gaps for other in elsewhere(step, gap, scale, _AS_LIKELY)), *found]
        rounds.append(found)
        if not found:
            break
        best = min(found, key=lambda f: f.cost + f.terms[-1].asked)
        if fitted.cost - best.cost < accepted + best.terms[-1].asked:
            break
        fell = float(np.sqrt(fitted.cost - best.cost))
        of_search = best.terms[-1].cause in (Cause.RINGING, Cause.DROPOUTS)
        seen[best.terms[-1]] = fell if of_search else _clearest(best.terms[-1].family, named, score)
        fitted = best
        named, score = tested(step, fitted, scale)
        rings = any(isinstance(term, RingingEdge) for term in fitted.terms)
        ring = None if rings else ringing_in(step, fitted, scale, alarm=alarm)
        lost = lost_in(step, fitted, scale, alarm=alarm)
    # What was accepted first was so without knowing of what came later.
    tried = [f for found in rounds for f in found] + list(_exchanged(step, fitted, rounds[1:], scale))
    tried += elsewhere(step, fitted, scale, _AS_LIKELY)
    if of_both := [t for t in fitted.terms if isinstance(t, HumOfBoth)]:
        kept = [t for t in fitted.terms if t not in of_both]
        others = [(hum, *kept) for hum in hums.terms if hum not in of_both]
        tried += _possible(step, others, fitted, scale, fitted.cost + _AS_LIKELY)
    findings = [Finding(t.cause, Answer.MODELLED, (), seen[t], _figures(fitted, t, scale)) for t in fitted.terms]
    modelled = {t.family for t in fitted.terms}
    # A model that holds the accepted one and is hardly better explains nothing else.
    # Nor does a gap that something else explains better: one is rare.
    rivals = [
        f
        for f in tried
        if fitted.terms
        and (LostSamples.family in modelled or not any(isinstance(t, LostSamples) for t in f.terms))
        and not _held_by(f.terms, fitted.terms)
        and f.cost <= fitted.cost + _AS_LIKELY * _of_difference(step, fitted, f)
    ]
    rivals += _bent(step, fitted, plain, scale)
    # Of what a fast second circuit does, a gap soon after the step does the same.
    rivals += sorted(soon_lost(step, fitted, scale, _AS_LIKELY), key=lambda f: f.cost)
    values, apart, named_rivals = _spanned(step, fitted, rivals, scale)
    findings += [f for f in named_rivals if f.cause not in {g.cause for g in findings}]
    chance = _CHANCE if fitted.terms else _CHANCE_OF_NONE
    within = [k for k, d in enumerate(named) if d.family in modelled]
    growth = score.growth(within, chance=chance)[: len(step.names)]
    # What leaves a figure open withholds it.
    opening = [*of_both, *(t for t in fitted.terms if t.cause is Cause.AC_COUPLED or isinstance(t, LargeHum))]
    if opening:
        beyond = no_figure(fitted, values, growth, apart)
        if any(beyond):
            place = fitted.terms.index(opening[0])
            answers = [Answer.WITHHELD if b else Answer.MODELLED for b in beyond]
            each = zip(answers, step.names, strict=False)
            findings[place : place + 1] = [replace(findings[place], answer=a, estimates=(n,)) for a, n in each]
    unexplained = max((abs(z) for z in _left(fitted, named, score)), default=0.0)
    if unexplained > alarm or (alarm < COARSE_ALARM and structured(step, fitted)):
        extra = of_parts(step, fitted, scale)
        apart = apart + extra
        beyond = no_figure(fitted, values, growth, apart)
        answers = [Answer.WITHHELD if b else Answer.WIDENED for b in beyond]
        unknown = [Finding(Cause.UNEXPLAINED, a, (n,), unexplained) for a, n in zip(answers, step.names, strict=False)]
        if all(beyond):
            # What the voltage shows before the step is no trial.
            hum = [g for g in findings if certain and g.cause is Cause.HUM]
            in_vain = [g for g in findings if g not in hum]
            findings, unknown = hum, [none_explains(each, in_vain, "step") for each in unknown]
        findings += unknown
    return StepJudgement(fitted, values, growth, apart, tuple(findings), tuple(named), score)


def _of_difference(step: Problem, fitted: Fitted, rival: Fitted) -> float:
    """Return the variance of what tells two fits apart, in that of white noise: rounding that no noise hides is in it."""
    # Readings alone: what is known beforehand has no rounding.
    count = step.record.time.size
    apart = rival.residuals[:count] - fitted.residuals[:count]
    size = float(np.linalg.norm(apart))
    return max(1.0, float(StepVariance(step, fitted)(apart[None, :] / size)[0])) if size else 1.0


def _held_by(terms: Sequence[Term], others: Sequence[Term]) -> bool:
    """Tell whether a model with `terms` holds that with `others`; hum on both channels holds that of the same frequency on one."""
    own = {*terms, *(hum_on_current(t.frequency) for t in terms if isinstance(t, HumOfBoth))}
    return own >= set(others)


def _figures(fitted: Fitted, term: Term, scale: StepScale) -> dict[str, float | str]:
    return {"record": "step", **term.told(scale, figures_of(fitted.terms, fitted.figures, term))}


def _left(fitted: Fitted, named: list[Direction], score: Score) -> list[float]:
    """Return how far the directions that are not in the model are seen."""
    modelled = {t.family for t in fitted.terms}
    return [float(z) for d, z in zip(named, score.z, strict=True) if d.family not in modelled]


def _clearest(family: str, named: list[Direction], score: Score) -> float:
    return max((float(z) for d, z in zip(named, score.z, strict=True) if d.family == family), key=abs, default=0.0)


def _candidates(
    step: Problem,
    fitted: Fitted,
    named: list[Direction],
    score: Score,
    scale: StepScale,
    ring: RingingEdge | None,
    hums: Sequence[HumOfBoth],
) -> Iterator[Fitted]:
    """Give the fits with one term more, as far as they are possible."""
    modelled = {t.family for t in fitted.terms}
    worth = {d.family: 0.0 for d in named}
    first = {d.family: d.term for d in named}
    for direction, z in zip(named, score.z, strict=True):
        if abs(z) >= worth[direction.family]:
            worth[direction.family], first[direction.family] = abs(float(z)), direction.term
    least = max(_WORTH, _WORTH_SHARE * max((z for f, z in worth.items() if f not in modelled), default=0.0))
    enough = fitted.cost + _AS_LIKELY
    if ring is not None:
        terms = [ring] if "skew" in modelled else [ring.of_channel, ring]
        for found in _possible(step, [(*fitted.terms, t) for t in terms], fitted, scale, enough):
            enough = min(enough, found.cost + ring.price + _AS_LIKELY)
            yield found
            if found.terms[-1] is ring:
                ring = ring.fitted(figures_of(found.terms, found.figures, ring))
        if "skew" in modelled:
            yield from _possible(step, list(_of_one_channel(fitted, ring)), fitted, scale, enough)
    # What is seen best first: others are then given up that cannot come as near.
    for family, z in sorted(worth.items(), key=lambda each: -each[1]):
        # The instant of the step hides a delay from the test until it is gross.
        seen = z >= (_WORTH if family == "skew" else least)
        if family in modelled or not (seen or family in _HIDDEN):
            continue
        terms = [t for t in TERMS if t.family == family] if family in _SEVERAL else [first[family]]
        if not seen:
            # An inductance that rises and falls again need not show where one that falls does, nor a slow divider where a fast one does.
            terms = [t for t in terms if len(t.start) > 1 and t.family == "saturation"]
        # The power of a bend is found from where it is likely alone.
        terms = [bend_in(step, fitted, scale) if isinstance(t, BentChannel) else t for t in terms]
        if family == Divider.family and (divider := divider_in(step, fitted, scale)):
            terms = [*terms, divider]
        if family in ("hum", "third"):
            terms = [t for t in TERMS if t.family == family and t in {d.term for d in named}]
            terms += hums if family == "hum" else ()
        for found in _possible(step, [(*fitted.terms, t) for t in terms], fitted, scale, enough):
            enough = min(enough, found.cost + _AS_LIKELY)
            yield found
            late = float(figures_of(found.terms, found.figures, found.terms[-1])[0])
            if family == "skew" and late > _LATE and ring is None:
                # A channel that is damped enough not to ring is late by 2ζ/ω₀, but otherwise than by a delay.
                slow = Resonance(natural=2.0 * _DAMPED / late, damping=_DAMPED)
                yield from _possible(step, [(*fitted.terms, slow)], fitted, scale, enough)


def _of_one_channel(fitted: Fitted, ring: RingingEdge) -> Iterator[tuple[Term, ...]]:
    """Give the models in which delay and ringing of the edge are together what a channel of second order makes."""
    kept = tuple(t for t in fitted.terms if t.family != "skew")
    for delay in (t for t in fitted.terms if t.family == "skew" and not isinstance(t, Resonance)):
        yield (*kept, ring.of_channel)
        late = float(figures_of(fitted.terms, fitted.figures, delay)[0])
        for damping in _RINGING if late > 0.0 else ():
            yield (*kept, Resonance(natural=2.0 * damping / late, damping=damping))


def _exchanged(step: Problem, fitted: Fitted, rounds: Sequence[Sequence[Fitted]], scale: StepScale) -> Iterator[Fitted]:
    """Give the fits that are as likely with another term in place of one accepted before the last, of those that came near in its round."""
    modelled = {t.family for t in fitted.terms}
    for old, found in zip(fitted.terms[:-1], rounds, strict=False):
        kept = [t for t in fitted.terms if t is not old]
        behind = min(f.cost for f in found) - fitted.cost + _AS_LIKELY
        near = [f.terms[-1] for f in sorted(found, key=lambda f: f.cost) if f.cost - fitted.cost < _NEAR * behind]
        # Of all places of a gap the best one.
        gaps = [t for t in near if isinstance(t, LostSamples)]
        near = [t for t in near if t not in gaps[1:]]
        # What no record tells apart is tried for itself.
        own = old.family if old.family == Divider.family else None
        models = [(*kept, t) for t in near if t.family not in modelled or (t.family == own and t is not old)]
        yield from _possible(step, models, fitted, scale, fitted.cost + _AS_LIKELY)


def _bent(step: Problem, fitted: Fitted, plain: Fitted, scale: StepScale) -> Iterator[Fitted]:
    """Give the fits with a current channel that bends in place of what else was found, and with an inductance that rises with the current
    in place of such a channel, where they explain nearly as much.

    Neither iron nor probe follows a law exactly: however much likelier one is, the other may be the cause, with another resistance.
    """
    term = next((t for t in fitted.terms if t.family == "saturation"), None)
    own = None if term is None else figures_of(fitted.terms, fitted.figures, term)
    rising = term is not None and own is not None and rises(term, own)
    # What else was found may have been so for want of the other cause; what is read beside the current is another matter.
    kept = [(), tuple(t for t in fitted.terms if t.family in _BESIDE)] if fitted.terms else []
    kept += [tuple(t for t in fitted.terms if t is not term)] if rising else []
    for terms in dict.fromkeys(k for k in kept if k != fitted.terms):
        for without in _possible(step, [terms], fitted, scale, np.inf) if terms else [plain]:
            fell = without.cost - fitted.cost
            enough = fitted.cost + max(_AS_LIKELY, min(_OF_ANOTHER * fell, _AS_NOISY * fitted.cost))
            models = [] if isinstance(term, BentChannel) else [(*terms, bend_in(step, without, scale))]
            yield from (f for f in _possible(step, models, without, scale, enough) if f.cost < enough)
            if isinstance(term, BentChannel):
                half = fitted.cost + _HALF * fell
                models = [(*terms, t) for t in TERMS if t.family == term.family and not isinstance(t, BentChannel)]
                found = [f for f in _possible(step, models, without, scale, half) if f.cost < half]
                found = [f for f in found if rises(f.terms[-1], figures_of(f.terms, f.figures, f.terms[-1]))]
                yield from sorted(found, key=lambda f: f.cost)[:1]
                # By another law of the probe the inductance is another one.
                found = list(_possible(step, [(*terms, term.cubic())], without, scale, half))
                yield from (f for f in found if f.cost < half)


def _possible(
    step: Problem, models: list[tuple[Term, ...]], start: Fitted, scale: StepScale, enough: float
) -> Iterator[Fitted]:
    """Give the fits with some terms each, as far as there are such and the world can have their figures."""
    for terms in models:
        try:
            fit = fit_with(step, terms, start, scale, enough)
            circuit = fit.full[:2]
            if any(isinstance(t, HumOfBoth) and not t.fits(*circuit) for t in fit.terms):
                again = [t.renewed(*circuit) if isinstance(t, HumOfBoth) else t for t in fit.terms]
                fit = fit_with(step, again, fit, scale, enough)
        except EstimationError:
            continue
        if all(t.possible(figures_of(fit.terms, fit.figures, t)) for t in fit.terms):
            yield fit


def _turned(fit: Fitted, scale: StepScale, count: int) -> FloatArray:
    """Return how far the parameters (k,) lie higher where a rotor that turns, and no AC coupling, lets the current fall.

    Behind a high pass of rate c the current is s/((s + c)·(L·s + R)) of the voltage, that of a rotor on its inertia alone
    s/(L·s² + R′·s + k²/J): one expression, with R′ = R + c·L and the same L.
    """
    higher = np.zeros(count)
    for term in fit.terms:
        if _figures(fit, term, scale).get("channel") == "current" and term.cause is Cause.AC_COUPLED:
            higher[0] += figures_of(fit.terms, fit.figures, term)[0] / scale.time_constant * fit.full[1]
    return higher


def _by_probe(fit: Fitted) -> tuple[float, float]:
    """Return between what a resistance (Ω) lies where a fit has a channel that bends: from its value by another law to that by none."""
    own = [(t, figures_of(fit.terms, fit.figures, t)) for t in fit.terms]
    read = fit.full[0] * (1.0 + sum(bent(*each) for each in own))
    return float(read / (1.0 + sum(lost(*each) for each in own))), float(read)


def _spanned(
    step: Problem, fitted: Fitted, rivals: list[Fitted], scale: StepScale
) -> tuple[FloatArray, FloatArray, list[Finding]]:
    """Return values whose interval, with a standard uncertainty beside the fit's own, holds all fits that are as likely."""
    count = len(step.names)
    own = fitted.full[step.free]
    spread = 2.0 * np.sqrt(np.diag(fitted.covariance)[:count])
    low, high, turned = own - spread, own + spread, own + spread + _turned(fitted, scale, count)
    findings = []
    for rival in rivals:
        theirs = rival.full[step.free]
        reach = 2.0 * np.sqrt(np.diag(rival.covariance)[:count])
        low, high = np.minimum(low, theirs - reach), np.maximum(high, theirs + reach)
        turned = np.maximum(turned, theirs + reach + _turned(rival, scale, count))
        for term in rival.terms:
            alike = [t for t in fitted.terms if t.family == term.family]
            # Of what no record tells apart the reader is to look at both.
            if not alike or (term.family in _HIDDEN and alike[0].cause is not term.cause):
                findings.append(Finding(term.cause, Answer.WIDENED, (), 0.0, _figures(rival, term, scale)))
    probes = [_by_probe(f) for f in (fitted, *rivals)]
    of_probe = max(1.0 - least / most for least, most in probes)
    if of_probe:
        low[0] = min(low[0], *(least for least, _ in probes))
        high[0] = max(high[0], *(most for _, most in probes))
        turned[0] = max(turned[0], high[0])
        shown: dict[str, float | str] = {"record": "step-bend", "share": of_probe}
        if all(f.cause is not Cause.DISTORTION for f in findings):
            findings.append(Finding(Cause.DISTORTION, Answer.WIDENED, (), 0.0, shown))
    more = np.maximum(turned - high, 0.0)
    all_terms = [t for fit in (fitted, *rivals) for t in fit.terms]
    of_two = of_probe > 0.0 or any(isinstance(t, Divider) or t.cause is Cause.DISTORTION for t in all_terms)
    ends = _TWO_ENDS if of_two else 1.0
    apart = np.maximum(0.25 * ends * (high - low) - 0.5 * spread, 0.0) + 0.25 * _TWO_ENDS * more
    return 0.5 * (low + high + more), apart, findings
