"""Terms that may act on a current step beside resistance and inductance: each as a term of the model, and as a direction to test for."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.first_order import respond_evenly
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.fitting.noise import MAINS
from procedures.estimation.winding.current_step.closed_circuits import closed_circuits
from procedures.estimation.winding.current_step.record import StepRecord
from procedures.estimation.winding.current_step.saturation import LAWS
from procedures.estimation.winding.current_step.share_and_lag import by_share_and_lag
from procedures.estimation.winding.current_step.term import StepScale, Term, high_pass, read_at

#: Time constants of eddy currents that are looked for, in those of the winding.
EDDIES = (0.03, 0.1, 0.3)
#: Hum's third harmonic, of rectifiers and saturated transformers, comes alone or with it.
THIRDS = tuple(3.0 * f for f in MAINS)


class _Skew(Term):
    """The current's channel is late by so many time constants of the winding."""

    cause, family = Cause.SKEW, "skew"

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        late = float(figures[0]) * scale.time_constant / step
        return read_at(current, np.arange(current.shape[-1], dtype=np.float64) - late)

    def nudge(self, step: float, scale: StepScale) -> float:
        # Wider than the kink where the current begins.
        return max(super().nudge(step, scale), 0.5 * step / scale.time_constant)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        return {"time": float(figures[0]) * scale.time_constant}


class _Pole(Term):
    """The current's channel is a low pass of so many time constants of the winding; where negative, the voltage's is."""

    cause, family = Cause.BANDWIDTH, "skew"

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        lag = float(figures[0]) * scale.time_constant
        if lag > 1e-3 * step:
            return respond_evenly(step, current.T / lag, 1.0 / lag).T
        return np.asarray(current - lag * np.gradient(current, step, axis=-1))

    def within(self, figures: FloatArray) -> bool:
        return bool(abs(figures[0]) < 0.7)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        lag = float(figures[0]) * scale.time_constant
        return {
            "time_constant": abs(lag),
            "bandwidth": 1.0 / (2.0 * np.pi * max(abs(lag), 1e-300)),
            "channel": "current" if lag > 0.0 else "voltage",
        }


@dataclass(frozen=True)
class _Eddy(Term):
    """A closed circuit that is coupled to the winding: k² times its time constant in `lag` of the winding's, and that one's logarithm.

    A record of a fast one shows the product far better than either.
    """

    cause: ClassVar[Cause] = Cause.SECOND_TIME_CONSTANT
    family: ClassVar[str] = "eddy"
    lag: float = 0.1

    start: tuple[float, ...] = (0.0, 0.0)
    # A record that shows the coupling need not show the time constant.
    known: tuple[float, ...] = (np.inf, 1.0)

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray | None:
        rate = 1.0 / (self._lag(figures) * scale.time_constant)
        return np.asarray(self._coupling(figures) * high_pass(current, step, rate))

    def flux_change(
        self, current: FloatArray, change: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray:
        return np.asarray(self.flux(change, step, scale, figures))

    def flux_by_figures(
        self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray | None:
        lag = self._lag(figures) * scale.time_constant
        return by_share_and_lag(current, step, lag, self._coupling(figures), figures)

    def possible(self, figures: FloatArray) -> bool:
        return bool(figures[0] >= 0.0)

    def within(self, figures: FloatArray) -> bool:
        return bool(-0.2 < self._coupling(figures) < 0.95 and abs(figures[1]) < 3.0)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        return {
            "time_constant": self._lag(figures) * scale.time_constant,
            "coupling": abs(self._coupling(figures)) ** 0.5,
        }

    def _coupling(self, figures: FloatArray) -> float:
        return float(figures[0] * np.exp(-figures[1]))

    def _lag(self, figures: FloatArray) -> float:
        return self.lag * float(np.exp(figures[1]))


class _Coupling(Term):
    """The current's channel is a high pass: its corner in units of the winding's."""

    cause, family = Cause.AC_COUPLED, "coupling"
    name: ClassVar[str] = "current"

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        return high_pass(current, step, float(figures[0]) / scale.time_constant)

    def possible(self, figures: FloatArray) -> bool:
        return bool(figures[0] > 0.0)

    def within(self, figures: FloatArray) -> bool:
        return bool(figures[0] > -0.5)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        return {"corner": float(figures[0]) / (2.0 * np.pi * scale.time_constant), "channel": self.name}


class _VoltageCoupling(_Coupling):
    """The voltage's channel is a high pass: what it takes off the voltage is in the current that flows."""

    name = "voltage"

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        # The inverse of a high pass adds the integral, and commutes with the circuit.
        total = np.cumsum(current, axis=-1) - 0.5 * current
        return np.asarray(current + float(figures[0]) / scale.time_constant * step * total)

    def back(self, shares: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        return self.channel(shares[..., ::-1], step, scale, figures)[..., ::-1]


class _Slope(Term):
    """The current's channel drifts: by so many steps over the record."""

    cause, family = Cause.SLOPE, "slope"
    straight: ClassVar[bool] = True

    def beside(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray | float:
        return np.asarray(float(figures[0]) * scale.current * (time - scale.begin) / scale.length)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        return {"slope": float(figures[0]) * scale.current / scale.length}


@dataclass(frozen=True)
class _Hum(Term):
    """Mains hum on the current's channel: sine and cosine, in steps."""

    cause: ClassVar[Cause] = Cause.HUM
    family: ClassVar[str] = "hum"
    straight: ClassVar[bool] = True
    frequency: float = MAINS[0]

    start: tuple[float, ...] = (0.0, 0.0)
    known: tuple[float, ...] = (np.inf, np.inf)

    def beside(self, time: FloatArray, scale: StepScale, figures: FloatArray) -> FloatArray | float:
        angle = 2.0 * np.pi * self.frequency * (time - scale.begin)
        return np.asarray(scale.current * (figures[0] * np.sin(angle) + figures[1] * np.cos(angle)))

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        return {"frequency": self.frequency, "amplitude": abs(scale.current) * float(np.hypot(*figures))}


@dataclass(frozen=True)
class _Third(_Hum):
    """The third harmonic of mains hum on the current's channel."""

    family: ClassVar[str] = "third"
    frequency: float = THIRDS[0]


def hum_on_current(frequency: float) -> Term:
    """Return the term of mains hum of a frequency (Hz) on the current's channel alone."""
    return _Hum(frequency)


#: All that is looked for. Skew and pole, the laws of saturation, and the couplings of both channels, are one direction each.
TERMS: tuple[Term, ...] = (
    _Skew(),
    _Pole(),
    *LAWS,
    _Eddy(),
    _Coupling(),
    _VoltageCoupling(),
    _Slope(),
    *(_Hum(frequency) for frequency in MAINS),
    *(_Third(frequency) for frequency in THIRDS),
)


@dataclass(frozen=True)
class Direction:
    """Test of a record: the `family` of terms that it stands for, and the term that is fitted first."""

    family: str
    cause: Cause
    term: Term


def directions(
    record: StepRecord, p: FloatArray, current: FloatArray, scale: StepScale
) -> tuple[list[Direction], FloatArray]:
    """Return the directions to test for, and ∂current/∂term of each (m, n), at none of it.

    `current` (A, shape (n,)) is the fitted one without offset and what is read beside it.
    """
    rate, size = p[0] / p[1], current.size
    after = slice(max(record.edge - 1, 0), None)
    part = current[after]
    # Nothing flows before the step.
    cubic = part * (part / scale.current) ** 2 / 3.0
    lines = [t for t in TERMS if isinstance(t, _Hum) and t.frequency * record.step < 0.4]
    rows = np.zeros((3 + len(EDDIES) + 1 + 2 * len(lines), size))
    rows[0, after] = -np.gradient(part)
    rows[1, after] = high_pass(cubic, record.step, rate)
    rows[2 : 2 + len(EDDIES), after] = closed_circuits(record, rate, part, EDDIES)
    rows[2 + len(EDDIES), after] = -np.cumsum(part)
    rows[3 + len(EDDIES)] = (record.time - scale.begin) / scale.length
    for k, line in enumerate(lines):
        angle = 2.0 * np.pi * line.frequency * (record.time - scale.begin)
        rows[4 + len(EDDIES) + 2 * k] = np.sin(angle)
        rows[5 + len(EDDIES) + 2 * k] = np.cos(angle)
    named = [Direction("skew", Cause.SKEW, _Skew()), Direction("saturation", Cause.SATURATION, LAWS[0])]
    named += [Direction("eddy", Cause.SECOND_TIME_CONSTANT, _Eddy(lag)) for lag in EDDIES]
    named += [Direction("coupling", Cause.AC_COUPLED, _Coupling()), Direction("slope", Cause.SLOPE, _Slope())]
    for line in lines:
        named += 2 * [Direction(line.family, Cause.HUM, line)]
    return named, rows
