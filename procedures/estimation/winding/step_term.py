"""A disturbance of a current step as a term of its model, and the current of a circuit with such terms."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.first_order import respond_evenly
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.winding.step_circuit import response
from procedures.estimation.winding.step_record import StepRecord

#: The current of a circuit that is not linear is found by iteration, to this share of the step.
_PRECISION, _ROUNDS = 1e-6, 40


@dataclass(frozen=True)
class StepScale:
    """What a term's figures are in units of: the circuit's time constant (s), the step's current (A), and when it begins (s)."""

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
    known: tuple[float, ...] = (np.inf,)

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray | None:
        """Return the flux linkage that is missing beside L·i, over L (A); None where the term is not the circuit's."""
        return None

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return what the current's channel makes of a current (A, shape (n,))."""
        return current

    def beside(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray | float:
        """Return what is read beside the current (A)."""
        return 0.0

    def possible(self, figures: FloatArray) -> bool:
        """Tell whether the figures are any that the world can have."""
        return True

    @abstractmethod
    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""


def high_pass(values: FloatArray, step: float, rate: float) -> FloatArray:
    """Return values (n, …), `step` (s) apart, through a high pass of a rate (1/s)."""
    return np.asarray(values - rate * respond_evenly(step, values, abs(rate)))


def current_with(
    record: StepRecord, p: FloatArray, terms: Sequence[Term], figures: FloatArray, scale: StepScale
) -> FloatArray:
    """Return the current (A, shape (n,)) of a circuit with these terms, as its channel gives it, offset included.

    `p` are resistance, inductance, offset, voltage offset and delay, `figures` those of the terms in their order.
    """
    return as_read(record, flowing_with(record, p, terms, figures, scale), p, terms, figures, scale)


def flowing_with(
    record: StepRecord,
    p: FloatArray,
    terms: Sequence[Term],
    figures: FloatArray,
    scale: StepScale,
    begin: FloatArray | None = None,
) -> FloatArray:
    """Return the current (A, shape (n,)) that flows in a circuit with these terms; `begin` is one nearby."""
    linear = response(record, p)
    rate = p[0] / p[1]
    own = zip(terms, _split(terms, figures), strict=True)
    inside = [(t, f) for t, f in own if t.flux(linear[:2], record.step, scale, f) is not None]
    current = begin if begin is not None and inside else linear
    for _ in range(_ROUNDS if inside else 0):
        # λ' + R·i = v with λ = L·(i − missing): what is missing acts like a drive of its own, and the iteration contracts.
        missing = np.zeros_like(current)
        for term, f in inside:
            part = term.flux(current, record.step, scale, f)
            if part is not None:
                missing += part
        further = linear + high_pass(missing, record.step, rate)
        change = float(np.max(np.abs(further - current)))
        current = further
        if not change > _PRECISION * abs(scale.current):
            break
    return current


def as_read(
    record: StepRecord, flowing: FloatArray, p: FloatArray, terms: Sequence[Term], figures: FloatArray, scale: StepScale
) -> FloatArray:
    """Return the readings (A, shape (n,)) of a current that flows, offset included."""
    own = list(zip(terms, _split(terms, figures), strict=True))
    read = flowing
    for term, f in own:
        read = term.channel(read, record.step, scale, f)
    read = read + p[2]
    for term, f in own:
        read = read + term.beside(record.time, scale, f)
    return np.asarray(read, dtype=np.float64)


def _split(terms: Sequence[Term], figures: FloatArray) -> list[FloatArray]:
    """Return the figures of each term."""
    ends = np.cumsum([len(t.start) for t in terms])
    return np.split(figures, ends[:-1].astype(int)) if terms else []


def figures_of(terms: Sequence[Term], figures: FloatArray, term: Term) -> FloatArray:
    """Return the figures of one of the terms."""
    return _split(terms, figures)[list(terms).index(term)]
