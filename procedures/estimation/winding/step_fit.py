"""Least squares of a recorded current step: the plain circuit, and the circuit with terms beside it."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.nonlinear import Solution, solve
from procedures.estimation.winding.step_circuit import NAMES, Whitener, response_and_slopes, whitener
from procedures.estimation.winding.step_record import StepRecord
from procedures.estimation.winding.step_term import StepScale, Term, as_read, current_with, flowing_with

#: A difference quotient is taken over so much of a typical change; one that was taken within so much of a change still holds.
_DIFFERENCE, _STILL_HOLDS = 1e-4, 0.02
_ROUNDS, _LAST_STEP = 25, 0.03


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
        """Which of the five parameters are fitted."""
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
    if record.sharp:
        known[4] = record.step / np.sqrt(12.0)
    level = float(np.max(np.abs(record.current - offset)))
    sizes = np.array([resistance, inductance, level, known[3] or 1.0, known[4] or 1.0])
    return Problem(record, known, whitener(record, resistance, inductance), sizes)


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


def fit_with(step: Problem, terms: Sequence[Term], start: Fitted, scale: StepScale) -> Fitted:
    """Return the fit with these terms from what a fit with some of them found. Raises EstimationError where there is none."""
    at_start = dict(zip(start.terms, np.split(start.figures, _ends(start.terms)), strict=True)) if start.terms else {}
    figures = [at_start.get(term, np.asarray(term.start)) for term in terms]
    known = np.concatenate([step.known[step.free], *(np.asarray(term.known) for term in terms)])
    full = start.full.copy()
    for k, term in enumerate(terms):
        if term.family == "skew" and term not in at_start:
            # What the instant of the step has taken of it, the term takes over.
            figures[k] = np.array([full[4] / scale.time_constant])
            full[4] = 0.0
    begin = np.concatenate([full[step.free], *figures])
    sizes = np.concatenate([step.sizes[step.free], np.full(begin.size - int(np.sum(step.free)), 1.0)])
    sizes[0], sizes[1] = start.full[0], start.full[1]
    sought = _Sought(step, tuple(terms), start.full, scale, known, sizes)
    names = (*step.names, *(term.cause.value for term in terms))
    solution: Solution = solve(sought.evaluate, begin, sizes, names, rounds=_ROUNDS, last_step=_LAST_STEP)
    full, own = sought.split(solution.values)
    current = current_with(step.record, full, terms, own, scale)
    residuals = sought.residuals(solution.values, current)
    slopes = -sought.evaluate(solution.values)[1]
    return Fitted(tuple(terms), full, own, current, residuals, slopes, solution.gain, solution.covariance)


def _ends(terms: Sequence[Term]) -> FloatArray:
    return np.cumsum([len(t.start) for t in terms])[:-1].astype(int)


class _Sought:
    """Residuals and difference quotients of the circuit with terms."""

    def __init__(
        self,
        step: Problem,
        terms: tuple[Term, ...],
        base: FloatArray,
        scale: StepScale,
        known: FloatArray,
        sizes: FloatArray,
    ) -> None:
        self._step, self._terms, self._base, self._scale = step, terms, base, scale
        self._priors, self._sizes = _priors(known), sizes
        self._at, self._slopes = np.full(sizes.size, np.inf), np.empty((0, 0))
        self._flowing: FloatArray | None = None

    def split(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the five parameters, and the terms' figures."""
        full, count = self._base.copy(), int(np.sum(self._step.free))
        full[self._step.free] = p[:count]
        full[:2] = np.maximum(full[:2], 1e-3 * self._sizes[:2])
        return full, p[count:]

    def residuals(self, p: FloatArray, current: FloatArray) -> FloatArray:
        """Return the whitened residuals of a current (A), and those of what is known beforehand."""
        return np.append(self._step.white.apply(self._step.record.current - current), -p @ self._priors)

    def evaluate(self, p: FloatArray) -> tuple[FloatArray, FloatArray]:
        current = self._current(p, keep=True)
        # Each derivative costs as much as the current itself, and changes little in the last steps.
        if not np.max(np.abs(p - self._at) / self._sizes) < _STILL_HOLDS:
            rows = np.empty((p.size, current.size))
            for row, size in enumerate(self._sizes):
                further = p.copy()
                further[row] += _DIFFERENCE * size
                rows[row] = (self._current(further) - current) / (_DIFFERENCE * size)
            self._slopes = np.concatenate((self._step.white.apply(rows), self._priors), axis=1)
            self._at = p.copy()
        return self.residuals(p, current), -self._slopes

    def _current(self, p: FloatArray, *, keep: bool = False) -> FloatArray:
        """Return the modelled current (A); what flows is found from what flowed where it was last kept."""
        full, figures = self.split(p)
        record = self._step.record
        flowing = flowing_with(record, full, self._terms, figures, self._scale, self._flowing)
        if keep:
            self._flowing = flowing
        return as_read(record, flowing, full, self._terms, figures, self._scale)
