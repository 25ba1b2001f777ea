"""Samples that are missing from a recorded step under a time column without a gap: found in the residuals, and as a term of the model."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause, score_test
from procedures.estimation.winding.step_fit import Fitted, Problem
from procedures.estimation.winding.step_term import StepScale, Term, read_at
from procedures.estimation.winding.step_variance import StepVariance

#: The place is sought among all samples: so much further beyond chance than a direction that is given.
_SOUGHT = 1.5
#: So many time constants after the step a gap is told from another inductance.
_SOON = 0.25
#: A place that the estimates make up for all but this share of its square is not looked at.
_SEEN = 1e-4


@dataclass(frozen=True)
class LostSamples(Term):
    """From sample `place` on, `after` (s) the step, current and voltage are so many time constants of the winding ahead."""

    cause: ClassVar[Cause] = Cause.DROPOUTS
    family: ClassVar[str] = "lost"
    #: Its place was sought, too.
    price: ClassVar[float] = 9.0
    place: int = 0
    after: float = 0.0
    step: float = 1.0

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return currents (A, shape (…, n)) without the samples that are missing."""
        at = np.arange(current.shape[-1], dtype=np.float64)
        at[self.place :] += float(figures[0]) * scale.time_constant / step
        return read_at(current, at)

    def within(self, figures: FloatArray) -> bool:
        """Tell whether a fit may go to these figures."""
        return bool(-0.2 < figures[0] < 3.0)

    def possible(self, figures: FloatArray) -> bool:
        """Tell whether anything is missing at all."""
        return bool(figures[0] > 0.0)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""
        return {"count": float(figures[0]) * scale.time_constant / self.step, "after": self.after}


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
    begin = record.jump + _SOON * scale.time_constant / record.step
    told = (across > _SEEN * square[0]) & (np.arange(size) > begin)
    z = np.where(told, along / np.sqrt(np.where(told, across, 1.0)), 0.0)
    place = int(np.argmax(z))
    if z[place] < _SOUGHT * alarm:
        return None
    row = np.zeros((1, fitted.residuals.size))
    row[0, place:size] = ahead[place:]
    if score_test(fitted.residuals, fitted.slopes, row, StepVariance(step, fitted)).z[0] < _SOUGHT * alarm:
        return None
    return LostSamples(place=place, after=float(record.time[place]) - scale.begin, step=record.step)


def _from_each(rows: FloatArray) -> FloatArray:
    """Return the sums of rows (…, n) from each sample on."""
    return np.asarray(np.cumsum(rows[..., ::-1], axis=-1)[..., ::-1])
