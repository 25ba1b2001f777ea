"""A disturbance of a current step as a term of its model, and the current of a circuit with such terms."""

import itertools
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar, NamedTuple

import numpy as np

from procedures.estimation.fitting.first_order import respond_evenly, response_and_slope_evenly
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.winding.current_step.circuit import NAMES, response, response_and_slopes
from procedures.estimation.winding.current_step.record import StepRecord

#: The current of a circuit that is not linear is found by iteration, to this share of the step; its derivatives to that share of theirs.
_PRECISION, _PRECISION_OF_SLOPES, _ROUNDS = 1e-7, 1e-3, 40
#: Figures are changed by so much for a difference quotient.
_DIFFERENCE = 1e-4


@dataclass(frozen=True)
class StepScale:
    """Units of a term's figures: the circuit's time constant (s), the step's current (A), and when it begins (s)."""

    time_constant: float
    current: float
    begin: float
    length: float


class Term(ABC):
    """One disturbance with its figures, dimensionless and 0 where there is none.

    `cause` names it; terms of one `family` stand for one another and are never in a model together.
    """

    cause: ClassVar[Cause]
    family: ClassVar[str]
    #: Figures at which a fit begins, and what is known of them beforehand: standard deviations, infinite where nothing is.
    start: tuple[float, ...] = (0.0,)
    #: How much lower χ² must be with it than with another.
    price: ClassVar[float] = 0.0
    #: By how much it lowers χ² of readings that are not fitted.
    evidence: float = 0.0
    known: tuple[float, ...] = (np.inf,)
    #: What is read beside the current goes in proportion with the figures, but for a part that does not depend on them.
    straight: ClassVar[bool] = False

    @property
    def asked(self) -> float:
        """The reduction of χ² that the term must achieve beyond that of another, after its other evidence."""
        return self.price - self.evidence

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray | None:
        """Return the flux linkage that is missing beside L·i, over L (A); None where the term is not the circuit's."""
        return None

    def flux_change(
        self, current: FloatArray, change: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray:
        """Return by how much `flux` changes (A, shape (m, n)) with small changes (A, shape (m, n)) of the current."""
        return np.zeros_like(change)

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return what the current's channel makes of currents (A, shape (…, n)): each its own, and sums of sums."""
        return current

    def channel_slopes(
        self, slopes: FloatArray, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray:
        """Return what the current's channel makes of small changes (A, shape (m, n)) of the current (n,)."""
        return self.channel(slopes, step, scale, figures)

    def channel_by_figures(
        self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray | None:
        """Return the derivatives (k, n) of what the channel makes of a current (n,) by the figures (k,); None for difference quotients."""
        return None

    def flux_by_figures(
        self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray | None:
        """Return the derivatives (k, n) of `flux` for a current (n,) by the figures (k,); None for difference quotients."""
        return None

    def back(self, shares: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return the shares (…, n) that the currents have in readings' shares, where the channel adds up what noise drives."""
        return shares

    def beside(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray | float:
        """Return what is read beside the current (A)."""
        return 0.0

    def beside_slopes(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return the derivatives (k, n) of what is read beside the current by the figures (k,)."""
        by = _DIFFERENCE * np.eye(figures.size)
        pairs = [(self.beside(time, scale, figures + d), self.beside(time, scale, figures - d)) for d in by]
        return np.array([np.subtract(above, below) for above, below in pairs]) / (2.0 * _DIFFERENCE)

    def within(self, figures: FloatArray) -> bool:
        """Tell whether a fit may go to these figures."""
        return True

    def nudge(self, step: float, scale: StepScale) -> float:
        """Return by how much a figure is changed for a difference quotient."""
        return _DIFFERENCE

    def possible(self, figures: FloatArray) -> bool:
        """Tell whether fitted figures are any that the world can have."""
        return True

    @abstractmethod
    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""


def high_pass(values: FloatArray, step: float, rate: float) -> FloatArray:
    """Return values (…, n), `step` (s) apart, through a high pass of a rate (1/s)."""
    return np.asarray(values - rate * respond_evenly(step, values.T, abs(rate)).T)


def read_at(values: FloatArray, at: FloatArray) -> FloatArray:
    """Return values (…, n) at places (n,) between the samples, straight between them and the last one beyond."""
    size = values.shape[-1]
    at = np.clip(at, 0.0, size - 1.0)
    before = np.minimum(at.astype(int), size - 2)
    first, last = np.take(values, before, -1), np.take(values, before + 1, -1)
    return np.asarray(first + (at - before) * (last - first))


class _Own(NamedTuple):
    """A term with its figures, and where they stand among all parameters."""

    term: Term
    figures: FloatArray
    rows: slice


class StepModel:
    """The current of a circuit with `terms`, as it flows and as its channel gives it, with the derivatives by all parameters.

    The parameters `p` are resistance, inductance, offset, voltage offset and delay; `figures` are those of the terms in their order.
    """

    def __init__(self, record: StepRecord, terms: Sequence[Term], scale: StepScale) -> None:
        self._record, self._scale = record, scale
        ends = np.cumsum([0, *(len(t.start) for t in terms)]).tolist()
        self._terms = [(t, slice(*e)) for t, e in zip(terms, itertools.pairwise(ends), strict=True)]
        self._inside = [each for each in self._terms if _is(each[0].flux, Term.flux)]
        #: What is missing does not depend on the current.
        self._given = all(not _is(t.flux_change, Term.flux_change) for t, _ in self._inside)
        self._channels = [each for each in self._terms if _is(each[0].channel, Term.channel)]
        self._beside = [each for each in self._terms if _is(each[0].beside, Term.beside)]
        self._straight: dict[int, tuple[FloatArray, FloatArray]] = {}
        #: The parameters that a linear circuit was last evaluated for, and its current.
        self._linear: tuple[FloatArray, FloatArray] | None = None

    def within(self, figures: FloatArray) -> bool:
        """Tell whether all figures are within what the terms reach to."""
        return all(term.within(figures[place]) for term, place in self._terms)

    def flowing(self, p: FloatArray, figures: FloatArray, begin: FloatArray | None = None) -> FloatArray:
        """Return the current (A, shape (n,)) that flows; `begin` is one nearby."""
        linear, inside = response(self._record, p), self._own(self._inside, figures)
        self._linear = p.copy(), linear
        current = begin if begin is not None and inside else linear
        for _ in range(_ROUNDS if inside else 0):
            # λ' + R·i = v with λ = L·(i − missing): what is missing acts like a drive of its own, and the iteration contracts.
            further = linear + high_pass(self._missing(current, inside), self._record.step, p[0] / p[1])
            change = float(np.max(np.abs(further - current)))
            current = further
            if self._given or not change > _PRECISION * abs(self._scale.current):
                break
        return current

    def read(self, flowing: FloatArray, p: FloatArray, figures: FloatArray) -> FloatArray:
        """Return the readings (A, shape (n,)) of a current that flows, offset included."""
        read = flowing
        for term, f, _ in self._own(self._channels, figures):
            read = term.channel(read, self._record.step, self._scale, f)
        read = read + p[2]
        for own in self._own(self._beside, figures):
            if own.term.straight:
                none, each = self._line(own)
                read = read + none + own.figures @ each
            else:
                read = read + own.term.beside(self._record.time, self._scale, own.figures)
        return np.asarray(read, dtype=np.float64)

    def unread(self, read: FloatArray, p: FloatArray, figures: FloatArray) -> FloatArray:
        """Return readings (A, shape (n,)) without offset and what is read beside the current."""
        beside = (o.term.beside(self._record.time, self._scale, o.figures) for o in self._own(self._beside, figures))
        return np.asarray(read - p[2] - sum(beside))

    def flowing_slopes(
        self, flowing: FloatArray, p: FloatArray, figures: FloatArray, begin: FloatArray | None = None
    ) -> FloatArray:
        """Return the derivatives (k, n) of the current that flows by the parameters and the figures; `begin` are such nearby."""
        record, rate = self._record, p[0] / p[1]
        rows = np.zeros((p.size + figures.size, flowing.size))
        known = self._linear[1] if self._linear is not None and np.array_equal(self._linear[0], p) else None
        rows[: p.size] = response_and_slopes(record, p, known)[1]
        rows[2] = 0.0
        inside = self._own(self._inside, figures)
        if not inside:
            return rows
        answer, by_rate = response_and_slope_evenly(record.step, self._missing(flowing, inside), rate)
        by_rate = (answer + rate * by_rate) / p[1]
        rows[0] -= by_rate
        rows[1] += rate * by_rate
        for each in inside:
            quotient = each.term.flux_by_figures(flowing, record.step, self._scale, each.figures)
            if quotient is None:
                quotient = self._by_figures(each, lambda o: self._missing(flowing, [o]))
            rows[each.rows] = high_pass(quotient, record.step, rate)
        slopes = rows if begin is None or self._given else begin
        for _ in range(0 if self._given else _ROUNDS):
            missing = [o.term.flux_change(flowing, slopes, record.step, self._scale, o.figures) for o in inside]
            further = rows + high_pass(np.sum(missing, axis=0), record.step, rate)
            change = np.max(np.abs(further - slopes), axis=1)
            slopes = further
            if np.all(change <= _PRECISION_OF_SLOPES * np.max(np.abs(slopes), axis=1)):
                break
        return slopes

    def read_slopes(self, flowing: FloatArray, slopes: FloatArray, figures: FloatArray) -> FloatArray:
        """Return the derivatives (k, n) of the readings for those of the current that flows."""
        step, scale = self._record.step, self._scale
        result = slopes.copy()
        for own in self._own(self._channels, figures):
            result = np.array(own.term.channel_slopes(result, flowing, step, scale, own.figures))
            by_figures = own.term.channel_by_figures(flowing, step, scale, own.figures)
            if by_figures is None:
                by_figures = self._by_figures(own, partial(self._channelled, flowing))
            result[own.rows] += by_figures
            flowing = self._channelled(flowing, own)
        for own in self._own(self._beside, figures):
            straight = own.term.straight
            result[own.rows] += (
                self._line(own)[1] if straight else own.term.beside_slopes(self._record.time, scale, own.figures)
            )
        result[2] += 1.0
        return result

    def _channelled(self, current: FloatArray, own: _Own) -> FloatArray:
        return own.term.channel(current, self._record.step, self._scale, own.figures)

    def _line(self, own: _Own) -> tuple[FloatArray, FloatArray]:
        """Return what is read beside the current where all figures of a term are 0 (n,), and by how much more for each (k, n)."""
        if own.rows.start not in self._straight:
            none, *each = (
                own.term.beside(self._record.time, self._scale, figures)
                for figures in np.eye(own.figures.size + 1, own.figures.size, -1)
            )
            self._straight[own.rows.start] = np.asarray(none), np.array(each) - none
        return self._straight[own.rows.start]

    def _by_figures(self, own: _Own, made: Callable[[_Own], FloatArray]) -> FloatArray:
        """Return the difference quotients (k, n) of what is made of a term by its figures (k,)."""
        by = own.term.nudge(self._record.step, self._scale)
        steps = by * np.eye(own.figures.size)
        above, below = ([made(own._replace(figures=own.figures + way * s)) for s in steps] for way in (1.0, -1.0))
        return (np.array(above) - np.array(below)) / (2.0 * by)

    @staticmethod
    def _own(of: Sequence[tuple[Term, slice]], figures: FloatArray) -> list[_Own]:
        count = len(NAMES)
        return [_Own(t, figures[place], slice(count + place.start, count + place.stop)) for t, place in of]

    def _missing(self, current: FloatArray, inside: Sequence[_Own]) -> FloatArray:
        missing = np.zeros_like(current)
        for term, f, _ in inside:
            part = term.flux(current, self._record.step, self._scale, f)
            if part is not None:
                missing += part
        return missing


def _is(own: Callable[..., object], nothing: Callable[..., object]) -> bool:
    """Tell whether a term's method is another than that of none."""
    return getattr(own, "__func__", own) is not nothing


def shares_of_currents(
    terms: Sequence[Term], figures: FloatArray, shares: FloatArray, step: float, scale: StepScale
) -> FloatArray:
    """Return shares (m, n) in the currents for shares in the readings that the terms' channels make of them."""
    for term, own in zip(reversed(terms), reversed(_split(terms, figures)), strict=True):
        shares = term.back(shares, step, scale, own)
    return shares


def _split(terms: Sequence[Term], figures: FloatArray) -> list[FloatArray]:
    """Return the figures of each term."""
    ends = np.cumsum([len(t.start) for t in terms])
    return np.split(figures, ends[:-1].astype(int)) if terms else []


def figures_of(terms: Sequence[Term], figures: FloatArray, term: Term) -> FloatArray:
    """Return the figures of one of the terms."""
    return _split(terms, figures)[list(terms).index(term)]
