"""Combines repeated steps of one circuit, and tests whether they contradict each other."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy import special

from procedures.estimation.fitting.misfit import ALARM, Answer, Cause, Finding, Misfit
from procedures.estimation.winding.current_step.clipping import Ends
from procedures.estimation.winding.current_step.response import StepFit, fit_step_response

#: Repeats contradict each other where chance makes them differ so much less often than this.
_CHANCE = 1e-3
#: What is seen by all repeats together is looked for in each from this share of its part on.
_SHARE = 0.6
#: A cause is the same in every repeat: what one alone shows by less than this is chance.
_ALONE = 4.5


class StepReading(NamedTuple):
    """Time (s), voltage (V) and current (A) of a step, one converter step of each channel, and their ends where known; `other_axis` as
    `fit_step_response` takes it.
    """

    time: ArrayLike
    voltage: ArrayLike
    current: ArrayLike
    voltage_resolution: float = 0.0
    current_resolution: float = 0.0
    voltage_ends: Ends = None
    current_ends: Ends = None
    other_axis: float = 0.0

    def fitted(self, alarm: float = ALARM) -> StepFit:
        """Return the fit; what is seen by less than `alarm` is chance. Raises EstimationError."""
        return fit_step_response(
            self.time,
            self.voltage,
            self.current,
            voltage_resolution=self.voltage_resolution,
            current_resolution=self.current_resolution,
            voltage_ends=self.voltage_ends,
            current_ends=self.current_ends,
            other_axis=self.other_axis,
            alarm=alarm,
        )


class Mean(NamedTuple):
    """Mean of repeats, its standard uncertainty and degrees of freedom; `ratio` is by how much they scatter beyond their own
    uncertainties, 0 where that may be chance.
    """

    value: float
    uncertainty: float
    degrees_of_freedom: float
    ratio: float


@dataclass(frozen=True)
class Repeats:
    """Fits of repeated steps."""

    fits: tuple[StepFit, ...]

    def mean(self, name: str) -> Mean:
        """Return the mean of an estimate. Noise averages out; what was found beside it is the same in every repeat, and does not."""
        values = np.array([f.value(name) for f in self.fits])
        own = np.array([f.uncertainty(name) for f in self.fits])
        noise = np.minimum(np.array([f.plain_uncertainty(name) for f in self.fits]), own)
        weights = own**-2 / np.sum(own**-2)
        value = float(weights @ values)
        common = float(weights @ (own**2 - noise**2))
        variance = float(weights**2 @ noise**2) + common
        ratio, freedom = 0.0, math.inf
        if values.size > 1:
            squares = float(np.sum(((values - value) / own) ** 2))
            if float(special.chdtrc(values.size - 1, squares)) < _CHANCE:
                ratio, freedom = math.sqrt(squares / (values.size - 1)), float(values.size - 1)
                variance *= ratio**2
        return Mean(value, math.sqrt(variance), freedom, ratio)

    @property
    def misfit(self) -> Misfit:
        """Misfit of the repeats to the model, each by itself and against each other."""
        own = [
            Finding(
                Cause.REPEATS_DIFFER,
                Answer.WIDENED,
                (name,),
                mean.ratio,
                {"record": "step", "count": float(len(self.fits)), "ratio": mean.ratio},
            )
            for name in ("resistance", "inductance")
            if (mean := self.mean(name)).ratio
        ]
        return Misfit.together([Misfit(tuple(own)), *(f.misfit for f in self.fits)])


def fit_repeats(steps: Sequence[StepReading]) -> Repeats:
    """Return the fits of repeated steps of one circuit.

    A cause that no single record shows beyond chance is looked for in each, where all of them together show it. Raises EstimationError
    for the first record that gives no estimate.
    """
    fits = [s.fitted(ALARM if len(steps) == 1 else _ALONE) for s in steps]
    together = _seen_together(fits)
    if together > ALARM and not any(f.judged.fitted.terms for f in fits):
        fits = [s.fitted(alarm=_SHARE * together / math.sqrt(len(fits))) for s in steps]
    return Repeats(tuple(fits))


def _seen_together(fits: Sequence[StepFit]) -> float:
    """Return how far the direction that stands out most is seen in all records together."""
    scores = [f.judged.score.z for f in fits]
    if len({z.size for z in scores}) != 1 or not scores[0].size:
        return 0.0
    return float(np.max(np.abs(np.sum(scores, axis=0)))) / math.sqrt(len(fits))
