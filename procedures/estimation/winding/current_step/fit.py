"""Least squares of a recorded current step: the plain circuit, and the circuit with terms beside it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.nonlinear import solve
from procedures.estimation.winding.current_step.circuit import NAMES, Whitener, response, response_and_slopes, whitener
from procedures.estimation.winding.current_step.record import StepRecord
from procedures.estimation.winding.current_step.term import StepModel, StepScale, Term

#: Derivatives still hold within so much of a typical change; a last step is in standard uncertainties.
_STILL_HOLDS = 0.02
_ROUNDS, _LAST_STEP = 16, 0.1


@dataclass(frozen=True)
class Fitted:
    """A fit with `terms`: all five parameters `full`, the terms' `figures`, the `current` (A, shape (n,)) of it.

    `residuals` (n + priors,) are whitened and end with the rows of prior knowledge; `slopes` (k, n + priors) are ∂model/∂parameter,
    `gain` (k, n + priors) their pseudo-inverse, `covariance` (k, k) its product with itself.
    """

    terms: tuple[Term, ...]
    full: FloatArray
    figures: FloatArray
    current: FloatArray
    residuals: FloatArray
    slopes: FloatArray
    gain: FloatArray
    covariance: FloatArray

    @property
    def cost(self) -> float:
        """Σ of the squared residuals."""
        return float(self.residuals @ self.residuals)


@dataclass(frozen=True)
class Problem:
    """A step to fit: its record, what is known of its parameters beforehand (`known` (5,): standard deviations, infinite where
    nothing, 0 where the parameter is none), and what whitens it.
    """

    record: StepRecord
    known: FloatArray
    white: Whitener
    sizes: FloatArray

    @property
    def free(self) -> FloatArray:
        """True for each of the five parameters that is fitted."""
        return np.asarray(self.known > 0.0)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the parameters that are fitted."""
        return tuple(n for n, f in zip(NAMES, self.free, strict=True) if f)


def problem(record: StepRecord, resistance: float, inductance: float, offset: float) -> Problem:
    """Return the step's problem, with typical sizes of its parameters."""
    known = np.array([np.inf, np.inf, np.inf, 0.0, 0.0])
    if record.edge:
        known[3] = record.voltage_noise / np.sqrt(record.edge)
    known[4] = record.instant
    level = float(np.max(np.abs(record.current - offset)))
    sizes = np.array([resistance, inductance, level, known[3] or 1.0, known[4] or 1.0])
    return Problem(record, known, whitener(record, resistance, inductance), sizes)


def scale_of(record: StepRecord, fitted: Fitted) -> StepScale:
    """Return the units of the terms' figures."""
    end = float(np.mean(response(record, fitted.full)[-max(3, record.time.size // 50) :]))
    begin = float(record.time[max(record.jump if record.sharp else record.edge, 0)])
    level = end if end else float(np.ptp(record.current))
    length = float(record.time[-1] - record.time[0])
    return StepScale(fitted.full[1] / fitted.full[0], level, begin, length)


def fit_plain(step: Problem, start: FloatArray) -> tuple[Problem, Fitted]:
    """Return the fit of the circuit alone from `start` (5,), and the problem whitened by what was found."""
    record, full = step.record, start
    rounds = 1 if record.noise_left is not None else 2
    for _ in range(rounds):
        white = whitener(record, full[0], full[1])
        plain = _Plain(record, step.known, white, full, step.sizes)
        solution = solve(plain.evaluate, full[step.free], step.sizes[step.free], step.names)
        full = full.copy()
        full[step.free] = solution.values
    residuals, slopes = plain.evaluate(solution.values)
    current = record.current - plain.left
    fitted = Fitted((), full, np.empty(0), current, residuals, -slopes, solution.gain, solution.covariance)
    return replace(step, white=white), fitted


class _Plain:
    """Residuals and derivatives of the circuit alone."""

    def __init__(
        self, record: StepRecord, known: FloatArray, white: Whitener, base: FloatArray, sizes: FloatArray
    ) -> None:
        self._record, self._white, self._base = record, white, base
        self._free, self._least = known > 0.0, 1e-3 * sizes[:2]
        self._priors = _priors(known[self._free])
        #: Measured less modelled current (A) where it was last evaluated.
        self.left = record.current

    def evaluate(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        q = self._base.copy()
        q[self._free] = p
        q[:2] = np.maximum(q[:2], self._least)
        current, slopes = response_and_slopes(self._record, q)
        self.left = self._record.current - q[2] - current
        # What is known of a parameter beforehand is a reading more.
        rows = np.concatenate((self._white.apply(slopes[self._free]), self._priors), axis=1)
        return np.append(self._white.apply(self.left), -p @ self._priors), -rows


def _priors(known: FloatArray) -> FloatArray:
    """Return the rows of prior knowledge (k, m) for standard deviations (k,)."""
    rows = np.diag(np.where(np.isfinite(known), 1.0 / known, 0.0))
    return rows[:, np.isfinite(known)]


def fit_with(step: Problem, terms: Sequence[Term], start: Fitted, scale: StepScale, enough: float = np.inf) -> Fitted:
    """Return the fit with these terms from what a fit with some of them found.

    Raises EstimationError where there is none, or none in prospect whose cost is as low as `enough`.
    """
    at_start = dict(zip(start.terms, np.split(start.figures, _ends(start.terms)), strict=True)) if start.terms else {}
    figures = [at_start.get(term, np.asarray(term.start)) for term in terms]
    known = np.concatenate([step.known[step.free], *(np.asarray(term.known) for term in terms)])
    full = start.full.copy()
    for k, term in enumerate(terms):
        if term.family == "skew" and len(term.start) == 1 and term not in at_start:
            # What the instant of the step has taken of it, the term takes over.
            figures[k] = np.array([full[4] / scale.time_constant])
            full[4] = 0.0
    begin = np.concatenate([full[step.free], *figures])
    sizes = np.concatenate([step.sizes[step.free], np.full(begin.size - int(np.sum(step.free)), 1.0)])
    sizes[0], sizes[1] = start.full[0], start.full[1]
    sought = _Sought(step, tuple(terms), start.full, scale, known, sizes)
    names = (*step.names, *(term.cause.value for term in terms))
    # Where a circuit that is not linear has no such current, it grows beyond all numbers, and nobody goes there.
    with np.errstate(over="ignore", invalid="ignore"):
        solution = solve(sought.evaluate, begin, sizes, names, rounds=_ROUNDS, last_step=_LAST_STEP, enough=enough)
        residuals, slopes = sought.evaluate(solution.values)
    if not (np.all(np.isfinite(residuals)) and sought.within(solution.values + solution.gain @ residuals)):
        raise EstimationError(f"the fit of {', '.join(names)} leads to figures that there are not")
    full, own = sought.split(solution.values)
    return Fitted(tuple(terms), full, own, sought.current, residuals, -slopes, solution.gain, solution.covariance)


def _ends(terms: Sequence[Term]) -> FloatArray:
    return np.cumsum([len(t.start) for t in terms])[:-1].astype(int)


class _Sought:
    """Residuals and derivatives of the circuit with terms."""

    def __init__(
        self,
        step: Problem,
        terms: tuple[Term, ...],
        base: FloatArray,
        scale: StepScale,
        known: FloatArray,
        sizes: FloatArray,
    ) -> None:
        self._step, self._base, self._sizes = step, base, sizes
        self._model, self._priors = StepModel(step.record, terms, scale), _priors(known)
        self._free, self._count = step.free, int(np.sum(step.free))
        self._fitted = np.append(step.free, np.ones(sizes.size - int(np.sum(step.free)), dtype=bool))
        self._least = np.inf
        size = step.record.current.size + self._priors.shape[1]
        #: Derivatives of the residuals, and where they were taken.
        self._at, self._slopes = np.full(sizes.size, np.inf), np.zeros((sizes.size, size))
        #: What flows, and its derivatives, where these were last taken.
        self._flowing: FloatArray | None = None
        self._flows: FloatArray | None = None
        #: The modelled current (A) where it was last evaluated.
        self.current = step.record.current

    def split(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the five parameters, and the terms' figures."""
        full = self._base.copy()
        full[self._free] = p[: self._count]
        full[:2] = np.maximum(full[:2], 1e-3 * self._sizes[:2])
        return full, p[self._count :]

    def within(self, p: FloatArray) -> bool:
        """Tell whether a fit may go there."""
        return bool(np.all(np.isfinite(p))) and self._model.within(p[self._count :])

    def evaluate(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        full, figures = self.split(p)
        if not self.within(p):
            return np.full(self._slopes.shape[1], np.inf), self._slopes
        # What flows is found from what flowed nearby.
        begin = self._flowing
        if begin is not None and self._flows is not None:
            begin = begin + (p - self._at) @ self._flows[self._fitted]
        flowing = self._model.flowing(full, figures, begin)
        self.current = self._model.read(flowing, full, figures)
        left = self._step.white.apply(self._step.record.current - self.current)
        residuals = np.append(left, -p @ self._priors)
        cost = float(residuals @ residuals)
        # The derivatives cost more than the current itself, change little in the last steps, and nobody goes where the squares are larger.
        if cost < self._least and not np.max(np.abs(p - self._at) / self._sizes) < _STILL_HOLDS:
            self._flowing = flowing
            self._flows = self._model.flowing_slopes(flowing, full, figures, self._flows)
            rows = self._model.read_slopes(flowing, self._flows, figures)[self._fitted]
            self._slopes = -np.concatenate((self._step.white.apply(rows), self._priors), axis=1)
            self._at = p.copy()
        self._least = min(self._least, cost)
        return residuals, self._slopes
