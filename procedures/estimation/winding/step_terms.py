"""What may act on a current step beside resistance and inductance: each as a term of the model, and as a direction to test for."""

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
#: Time constants of eddy currents that are looked for, in those of the winding.
EDDIES = (0.03, 0.1, 0.3)
MAINS = (50.0, 60.0)


@dataclass(frozen=True)
class Scale:
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

    def flux(self, current: FloatArray, step: float, scale: Scale, figures: FloatArray) -> FloatArray | None:
        """Return the flux linkage that is missing beside L·i, over L (A); None where the term is not the circuit's."""
        return None

    def channel(self, current: FloatArray, step: float, scale: Scale, figures: FloatArray) -> FloatArray:
        """Return what the current's channel makes of a current (A, shape (n,))."""
        return current

    def beside(self, time: FloatArray, scale: Scale, figures: FloatArray) -> FloatArray | float:
        """Return what is read beside the current (A)."""
        return 0.0

    def possible(self, figures: FloatArray) -> bool:
        """Tell whether the figures are any that the world can have."""
        return True

    @abstractmethod
    def told(self, scale: Scale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""


def _high_pass(values: FloatArray, step: float, rate: float) -> FloatArray:
    return np.asarray(values - rate * respond_evenly(step, values, abs(rate)))


class Skew(Term):
    """The current's channel is late by so many time constants of the winding."""

    cause, family = Cause.SKEW, "skew"

    def channel(self, current: FloatArray, step: float, scale: Scale, figures: FloatArray) -> FloatArray:
        late = float(figures[0]) * scale.time_constant / step
        at = np.arange(current.size)
        return np.interp(at - late, at, current)

    def told(self, scale: Scale, figures: FloatArray) -> dict[str, float | str]:
        return {"time": float(figures[0]) * scale.time_constant}


class Pole(Term):
    """The current's channel is a low pass of so many time constants of the winding; where negative, the voltage's is."""

    cause, family = Cause.BANDWIDTH, "skew"

    def channel(self, current: FloatArray, step: float, scale: Scale, figures: FloatArray) -> FloatArray:
        lag = float(figures[0]) * scale.time_constant
        if lag > 1e-3 * step:
            return respond_evenly(step, current / lag, 1.0 / lag)
        return np.asarray(current - lag * np.gradient(current, step))

    def possible(self, figures: FloatArray) -> bool:
        return bool(abs(figures[0]) < 0.7)

    def told(self, scale: Scale, figures: FloatArray) -> dict[str, float | str]:
        lag = float(figures[0]) * scale.time_constant
        return {
            "time_constant": abs(lag),
            "bandwidth": 1.0 / (2.0 * np.pi * max(abs(lag), 1e-300)),
            "channel": "current" if lag > 0.0 else "voltage",
        }


class Saturation(Term):
    """Inductance L₀/(1 + a·(i/I)²) of the current, I being the step's; where a is negative it rises with the current."""

    cause, family = Cause.SATURATION, "saturation"

    def flux(self, current: FloatArray, step: float, scale: Scale, figures: FloatArray) -> FloatArray | None:
        a = float(np.clip(figures[0], -0.45, 4.0))
        x = current / scale.current
        if abs(a) < 1e-6:
            return np.asarray(current * (a * x**2 / 3.0))
        root = np.sqrt(abs(a))
        linked = np.arctan(root * x) / root if a > 0.0 else np.arctanh(np.clip(root * x, -0.99, 0.99)) / root
        return np.asarray(current - scale.current * linked)

    def share(self, at: float, figures: FloatArray) -> float:
        """Return the inductance at a current, in steps, over that at none."""
        return 1.0 / (1.0 + float(figures[0]) * at**2)

    def possible(self, figures: FloatArray) -> bool:
        return bool(-0.45 < figures[0] < 4.0)

    def told(self, scale: Scale, figures: FloatArray) -> dict[str, float | str]:
        # Where one percent of the inductance is gone, to first order of either law.
        smaller = float(scale.current * np.sqrt(0.01 / max(abs(figures[0]), 0.01)))
        return {"current": scale.current, "share": self.share(1.0, figures), "smaller": smaller}


class FluxSaturation(Saturation):
    """Inductance L₀·(1 − a·(λ/L₀I)²) of the flux linkage: λ = L₀·I/√a·tanh(√a·i/I)."""

    def flux(self, current: FloatArray, step: float, scale: Scale, figures: FloatArray) -> FloatArray | None:
        a = float(np.clip(figures[0], -0.45, 4.0))
        x = current / scale.current
        if abs(a) < 1e-6:
            return np.asarray(current * (a * x**2 / 3.0))
        root = np.sqrt(abs(a))
        linked = np.tanh(root * x) / root if a > 0.0 else np.tan(np.clip(root * x, -1.2, 1.2)) / root
        return np.asarray(current - scale.current * linked)

    def share(self, at: float, figures: FloatArray) -> float:
        a = float(figures[0])
        root = np.sqrt(abs(a)) * at
        return float(1.0 - np.tanh(root) ** 2 if a > 0.0 else 1.0 + np.tan(root) ** 2)

    def possible(self, figures: FloatArray) -> bool:
        return bool(-0.45 < figures[0] < 4.0)


@dataclass(frozen=True)
class Eddy(Term):
    """A closed circuit that is coupled to the winding: k², and the logarithm of its time constant in `lag` of the winding's."""

    cause: ClassVar[Cause] = Cause.SECOND_TIME_CONSTANT
    family: ClassVar[str] = "eddy"
    lag: float = 0.1

    start: tuple[float, ...] = (0.0, 0.0)
    # A record that shows the coupling need not show the time constant.
    known: tuple[float, ...] = (np.inf, 1.0)

    def flux(self, current: FloatArray, step: float, scale: Scale, figures: FloatArray) -> FloatArray | None:
        rate = 1.0 / (self._lag(figures) * scale.time_constant)
        return np.asarray(float(np.clip(figures[0], -0.7, 0.95)) * _high_pass(current, step, rate))

    def possible(self, figures: FloatArray) -> bool:
        return bool(0.0 <= figures[0] < 0.95)

    def told(self, scale: Scale, figures: FloatArray) -> dict[str, float | str]:
        return {"time_constant": self._lag(figures) * scale.time_constant, "coupling": float(abs(figures[0]) ** 0.5)}

    def _lag(self, figures: FloatArray) -> float:
        return self.lag * float(np.exp(np.clip(figures[1], -3.0, 3.0)))


class Coupling(Term):
    """The current's channel is a high pass: its corner in units of the winding's."""

    cause, family = Cause.AC_COUPLED, "coupling"

    def channel(self, current: FloatArray, step: float, scale: Scale, figures: FloatArray) -> FloatArray:
        return _high_pass(current, step, float(figures[0]) / scale.time_constant)

    def possible(self, figures: FloatArray) -> bool:
        return bool(figures[0] > 0.0)

    def told(self, scale: Scale, figures: FloatArray) -> dict[str, float | str]:
        return {"corner": float(figures[0]) / (2.0 * np.pi * scale.time_constant)}


class Slope(Term):
    """The current's channel drifts: by so many steps over the record."""

    cause, family = Cause.SLOPE, "slope"

    def beside(self, time: FloatArray, scale: Scale, figures: FloatArray) -> FloatArray | float:
        return np.asarray(float(figures[0]) * scale.current * (time - scale.begin) / scale.length)

    def told(self, scale: Scale, figures: FloatArray) -> dict[str, float | str]:
        return {"slope": float(figures[0]) * scale.current / scale.length}


@dataclass(frozen=True)
class Hum(Term):
    """Mains hum on the current's channel: sine and cosine, in steps."""

    cause: ClassVar[Cause] = Cause.HUM
    family: ClassVar[str] = "hum"
    frequency: float = MAINS[0]

    start: tuple[float, ...] = (0.0, 0.0)
    known: tuple[float, ...] = (np.inf, np.inf)

    def beside(self, time: FloatArray, scale: Scale, figures: FloatArray) -> FloatArray | float:
        angle = 2.0 * np.pi * self.frequency * (time - scale.begin)
        return np.asarray(scale.current * (figures[0] * np.sin(angle) + figures[1] * np.cos(angle)))

    def told(self, scale: Scale, figures: FloatArray) -> dict[str, float | str]:
        return {"frequency": self.frequency, "amplitude": abs(scale.current) * float(np.hypot(*figures))}


#: All that is looked for. Skew and pole, and the two laws of saturation, are one direction each.
TERMS: tuple[Term, ...] = (
    Skew(),
    Pole(),
    Saturation(),
    FluxSaturation(),
    Eddy(),
    Coupling(),
    Slope(),
    *(Hum(frequency) for frequency in MAINS),
)


def current_with(
    record: StepRecord, p: FloatArray, terms: Sequence[Term], figures: FloatArray, scale: Scale
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
    scale: Scale,
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
        further = linear + _high_pass(missing, record.step, rate)
        change = float(np.max(np.abs(further - current)))
        current = further
        if not change > _PRECISION * abs(scale.current):
            break
    return current


def as_read(
    record: StepRecord, flowing: FloatArray, p: FloatArray, terms: Sequence[Term], figures: FloatArray, scale: Scale
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


@dataclass(frozen=True)
class Direction:
    """What to test a record for: the `family` of terms that it stands for, and the term that is fitted first."""

    family: str
    cause: Cause
    term: Term


def directions(
    record: StepRecord, p: FloatArray, current: FloatArray, scale: Scale
) -> tuple[list[Direction], FloatArray]:
    """Return the directions to test for, and ∂current/∂term of each (m, n), at none of it.

    `current` (A, shape (n,)) is the fitted one without offset and what is read beside it.
    """
    rate, size = p[0] / p[1], current.size
    after = slice(max(record.edge - 1, 0), None)
    part = current[after]
    # Nothing flows before the step.
    missing = np.empty((part.size, 1 + len(EDDIES)))
    missing[:, 0] = part * (part / scale.current) ** 2 / 3.0
    for column, lag in enumerate(EDDIES, 1):
        missing[:, column] = _high_pass(part, record.step, 1.0 / (lag * scale.time_constant))
    missing -= rate * respond_evenly(record.step, missing, rate)
    angles = [2.0 * np.pi * f * (record.time - scale.begin) for f in MAINS if f * record.step < 0.4]
    rows = np.zeros((3 + len(EDDIES) + 1 + 2 * len(angles), size))
    rows[0, after] = -np.gradient(part)
    rows[1 : 2 + len(EDDIES), after] = missing.T
    rows[2 + len(EDDIES), after] = -np.cumsum(part)
    rows[3 + len(EDDIES)] = (record.time - scale.begin) / scale.length
    for k, angle in enumerate(angles):
        rows[4 + len(EDDIES) + 2 * k] = np.sin(angle)
        rows[5 + len(EDDIES) + 2 * k] = np.cos(angle)
    named = [Direction("skew", Cause.SKEW, Skew()), Direction("saturation", Cause.SATURATION, Saturation())]
    named += [Direction("eddy", Cause.SECOND_TIME_CONSTANT, Eddy(lag)) for lag in EDDIES]
    named += [Direction("coupling", Cause.AC_COUPLED, Coupling()), Direction("slope", Cause.SLOPE, Slope())]
    for frequency in MAINS[: len(angles)]:
        named += 2 * [Direction("hum", Cause.HUM, Hum(frequency))]
    return named, rows
