"""Samples missing from a recorded step although the time column has no gap: found in the residuals, and as a term of the model."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Cause, score_test
from procedures.estimation.winding.current_step.fit import Fitted, Problem, fit_with
from procedures.estimation.winding.current_step.term import StepScale, Term, figures_of
from procedures.estimation.winding.current_step.variance import StepVariance

#: The place is sought among all samples: so much further beyond chance than a direction that is given.
_SOUGHT = 1.5
#: So many time constants after the voltage has risen a gap is told from another inductance; it has where it moves by less than this
#: share of its largest in as long: sooner a gap hides what the voltage was.
_SOON, _SETTLED = 0.05, 0.03
#: How far from where it was sought a gap's place is looked for at first, in samples.
_FAR = 16
#: So many places of a gap are tried beside a second circuit, the last so many samples beyond those that are not sought.
_MOST_PLACES, _BEYOND = 10, 3
#: A place that the estimates make up for all but this share of its square is not looked at.
_SEEN = 1e-4


@dataclass(frozen=True)
class LostSamples(Term):
    """Before sample `place`, `after` (s) the step, so many of a `time_constant` (s) are missing, in which the winding's flux went on.

    `short` (A) is what the current there lacks of what the voltage drives in the end.
    """

    cause: ClassVar[Cause] = Cause.DROPOUTS
    family: ClassVar[str] = "lost"
    #: Its place was sought, too.
    price: ClassVar[float] = 9.0
    place: int = 0
    after: float = 0.0
    step: float = 1.0
    short: float = 0.0
    time_constant: float = 1.0

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return the flux linkage over L (A) that the recorded voltage did not bring, but the missing one."""
        gained = np.zeros_like(current)
        gained[..., self.place :] = -self.short * np.expm1(-float(figures[0]))
        return gained

    def within(self, figures: FloatArray) -> bool:
        """Tell whether a fit may go to these figures."""
        return bool(-0.2 < figures[0] < 3.0)

    def possible(self, figures: FloatArray) -> bool:
        """Tell whether anything is missing at all."""
        return bool(figures[0] > 0.0)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""
        return {"count": float(figures[0]) * self.time_constant / self.step, "after": self.after}


def lost_in(step: Problem, fitted: Fitted, scale: StepScale, *, alarm: float) -> LostSamples | None:
    """Return the place from which on the residuals show the current ahead, where it stands out of them.

    None is sought where a voltage could not be smoothed, for residuals are then not whitened sample by sample, nor beside a cut.
    """
    record, size = step.record, step.record.time.size
    if (
        record.noise_left is None
        or record.kept is not None
        or any(isinstance(term, LostSamples) for term in fitted.terms)
    ):
        return None
    ahead = step.white.apply(np.append(np.diff(fitted.current), 0.0))
    # Of the direction that begins at each sample: its product with the residuals, its square, and what the estimates take up of it.
    along, square, taken = (
        _from_each(ahead * rows) for rows in (fitted.residuals[:size], ahead, fitted.slopes[:, :size])
    )
    across = square - np.sum(taken * (fitted.covariance @ taken), axis=0)
    first = _first(step, scale)
    told = (across > _SEEN * square[0]) & (np.arange(size) >= first)
    z = np.where(told, along / np.sqrt(np.where(told, across, 1.0)), 0.0)
    place = int(np.argmax(z))
    # At the first place it is one that lies sooner.
    if z[place] < _SOUGHT * alarm or place == first:
        return None
    row = np.zeros((1, fitted.residuals.size))
    row[0, place:size] = ahead[place:]
    if score_test(fitted.residuals, fitted.slopes, row, StepVariance(step, fitted)).z[0] < _SOUGHT * alarm:
        return None
    return _gap(place, step, fitted, scale)


def elsewhere(step: Problem, fitted: Fitted, scale: StepScale, as_likely: float) -> Iterator[Fitted]:
    """Give the fits with the gap at other places: the descent to the best one, and those near it within `as_likely` of χ².

    Where much is missing the derivatives, by which the place was sought, do not hold; and whoever errs by a sample errs in the inductance.
    """
    found: dict[int, Fitted | None] = {}
    place = next((term.place for term in fitted.terms if isinstance(term, LostSamples)), None)
    if place is None:
        return

    def cost(at: int) -> float:
        if at not in found:
            found[at] = _at(at, step, fitted, scale)
        fit = found[at]
        return np.inf if fit is None else fit.cost

    far = _FAR
    while far:
        best = min((place, place - far, place + far), key=cost)
        far = far if best != place else far // 2
        place = best
    if not np.isfinite(cost(place)):
        # No place has a fit, and none beyond would ever be worse.
        return
    for way in (-1, 1):
        far = 1
        while cost(place + way * far) <= cost(place) + as_likely:
            far *= 2
    yield from (fit for fit in found.values() if fit is not None)


def soon_lost(step: Problem, fitted: Fitted, scale: StepScale, as_likely: float) -> Iterator[Fitted]:
    """Give the fits within `as_likely` of χ² with a gap sooner after the step than one is sought, in place of a fitted second circuit.

    There both have nearly one direction, and no search tells which it is.
    """
    record = step.record
    others = tuple(term for term in fitted.terms if term.family != "eddy")
    if len(others) == len(fitted.terms) or record.noise_left is None or record.kept is not None:
        return
    if any(isinstance(term, LostSamples) for term in others):
        return
    last = _first(step, scale)
    places = np.arange(max(last - _soon(step, scale), record.jump) + 1, min(last + _BEYOND, record.time.size - 1))
    for place in places[:: -(-places.size // _MOST_PLACES)]:
        gap = _gap(int(place), step, fitted, scale)
        for kept in dict.fromkeys((others, ())):
            try:
                fit = fit_with(step, (*kept, gap), fitted, scale, fitted.cost + as_likely)
            except EstimationError:
                continue
            possible = all(t.possible(figures_of(fit.terms, fit.figures, t)) for t in fit.terms)
            if possible and fit.cost <= fitted.cost + as_likely:
                yield fit


def _at(place: int, step: Problem, fitted: Fitted, scale: StepScale) -> Fitted | None:
    """Return the fit with the gap at another place, None where there is none."""
    if not _first(step, scale) < place < step.record.time.size - 1:
        return None
    gap = _gap(place, step, fitted, scale)
    terms = tuple(gap if isinstance(t, LostSamples) else t for t in fitted.terms)
    try:
        fit = fit_with(step, terms, replace(fitted, terms=terms), scale)
    except EstimationError:
        return None
    return fit if all(t.possible(figures_of(terms, fit.figures, t)) for t in terms) else None


def _gap(place: int, step: Problem, fitted: Fitted, scale: StepScale) -> LostSamples:
    """Return the term of a gap before sample `place` of a fitted record."""
    record = step.record
    driven = float(np.mean(record.drive[place - 1 : place + 1])) / fitted.full[0]
    short = driven - float(fitted.current[place - 1] - fitted.full[2])
    after = float(record.time[place]) - scale.begin
    return LostSamples(place, after, record.step, short, float(fitted.full[1] / fitted.full[0]))


def _first(step: Problem, scale: StepScale) -> int:
    """Return the first sample before which a gap is sought."""
    record = step.record
    soon = _soon(step, scale)
    rising = np.abs(record.drive[record.jump + soon :] - record.drive[record.jump : -soon])
    return record.jump + int(np.argmax(rising < _SETTLED * np.max(np.abs(record.drive)))) + soon


def _soon(step: Problem, scale: StepScale) -> int:
    """Return so many samples after the voltage has risen a gap is told from another inductance."""
    return 1 + int(_SOON * scale.time_constant / step.record.step)


def _from_each(rows: FloatArray) -> FloatArray:
    """Return the sums of rows (…, n) from each sample on."""
    return np.asarray(np.cumsum(rows[..., ::-1], axis=-1)[..., ::-1])
