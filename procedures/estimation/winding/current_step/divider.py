"""A badly compensated divider on the voltage's channel, as a term of a current step."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.winding.current_step.fit import Fitted, Problem, fit_with
from procedures.estimation.winding.current_step.share_and_lag import by_share_and_lag
from procedures.estimation.winding.current_step.term import StepScale, Term, high_pass

#: Time constants that are tried first, in those of the winding.
_LAGS = (0.1, 0.3, 0.6, 1.5, 3.0)
#: A divider passes so much more or less above a frequency than below (standard deviation), and no more than the second.
_USUAL, _MOST = 0.15, 0.4


@dataclass(frozen=True)
class Divider(Term):
    """The voltage's divider passes another share of what changes fast: what it takes off, in `lag` of the winding's time constant, and
    that one's logarithm.

    It multiplies the current by (1 + s·T·(1 + c))/(1 + s·T), and a second circuit does the same with another inductance: a record does
    not tell them apart. That is why they are one family.
    """

    cause: ClassVar[Cause] = Cause.COMPENSATION
    family: ClassVar[str] = "eddy"
    lag: float = 0.1

    start: tuple[float, ...] = (0.0, 0.0)
    # Near the winding's own time constant a record shows nothing of it but another inductance.
    known: tuple[float, ...] = (_USUAL, 1.0)

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return what the channel makes of currents (A, shape (…, n)): the voltage drives the circuit, so both commute."""
        rate = 1.0 / (self._lag(figures) * scale.time_constant)
        return np.asarray(current + self._share(figures) * high_pass(current, step, rate))

    def channel_by_figures(
        self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray | None:
        """Return the derivatives (k, n) of what the channel makes of a current (n,) by the figures (k,)."""
        return by_share_and_lag(current, step, self._lag(figures) * scale.time_constant, self._share(figures), figures)

    def possible(self, figures: FloatArray) -> bool:
        """Tell whether a divider can be off by as much."""
        return abs(self._share(figures)) < _MOST

    def within(self, figures: FloatArray) -> bool:
        """Tell whether a fit may go to these figures."""
        return bool(abs(self._share(figures)) < 2.0 * _MOST and np.all(np.abs(figures[1:]) < 3.0))

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""
        share = self._share(figures)
        return {
            "time_constant": self._lag(figures) * scale.time_constant * (1.0 + share),
            "more": -share / (1.0 + share),
        }

    def at_start(self) -> "Divider":
        """Return the same with its time constant as it is."""
        return replace(self, start=self.start[:1], known=self.known[:1])

    def _share(self, figures: FloatArray) -> float:
        return float(figures[0] * self.lag / self._lag(figures))

    def _lag(self, figures: FloatArray) -> float:
        return self.lag * float(np.exp(np.sum(figures[1:])))


def divider_in(step: Problem, fitted: Fitted, scale: StepScale) -> Divider | None:
    """Return the divider that leaves least unexplained beside the terms of a fit, None where there is none.

    From no divider at all a fit does not find its time constant: it is tried for some, and freed for the best.
    """
    best, found = np.inf, None
    for lag in _LAGS:
        try:
            fit = fit_with(step, (*fitted.terms, Divider(lag).at_start()), fitted, scale, best)
        except EstimationError:
            continue
        if fit.cost < best:
            best, found = fit.cost, Divider(lag, (float(fit.figures[-1]), 0.0))
    return found
