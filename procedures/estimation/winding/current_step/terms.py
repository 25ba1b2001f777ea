"""Terms that may act on a current step beside resistance and inductance: each as a term of the model, and as a direction to test for."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.first_order import respond_evenly
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.winding.current_step.closed_circuits import closed_circuits
from procedures.estimation.winding.current_step.record import StepRecord
from procedures.estimation.winding.current_step.share_and_lag import by_share_and_lag
from procedures.estimation.winding.current_step.term import StepScale, Term, high_pass, read_at

#: Time constants of eddy currents that are looked for, in those of the winding.
EDDIES = (0.03, 0.1, 0.3)
MAINS = (50.0, 60.0)
#: Currents, in steps, between which an inductance follows its law, and some of them.
_FITTED = (-0.1, 1.2)
_PLACES = np.linspace(*_FITTED, 14)
#: Rounds that find the reading of a current.
_ITERATIONS = 5
#: Places and weights of a mean between 0 and 1.
_NODES, _WEIGHTS = (
    0.5 * (1.0 + each) if not k else 0.5 * each for k, each in enumerate(np.polynomial.legendre.leggauss(8))
)
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


class _Saturation(Term):
    """Inductance L₀/(1 + a·(i/I)²) of the current, I being the step's; where a is negative it rises with the current."""

    cause, family = Cause.SATURATION, "saturation"

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray | None:
        a = float(figures[0])
        x = current / scale.current
        if abs(a) < 1e-6:
            return np.asarray(current * (a * x**2 / 3.0))
        root = np.sqrt(abs(a))
        linked = np.arctan(root * x) / root if a > 0.0 else np.arctanh(np.clip(root * x, -0.99, 0.99)) / root
        return np.asarray(current - scale.current * linked)

    def flux_change(
        self, current: FloatArray, change: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray:
        return np.asarray((1.0 - self.share(current / scale.current, figures)) * change)

    def share(self, at: FloatArray, figures: FloatArray) -> FloatArray:
        """Return the inductance at a current, in steps, over that at none."""
        a = float(figures[0])
        return np.asarray(1.0 / (1.0 + a * np.minimum(at**2, 2.0)))

    def within(self, figures: FloatArray) -> bool:
        return bool(-0.45 < figures[0] < 4.0)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        # Where one percent of the inductance is gone, to first order of either law.
        smaller = float(scale.current * np.sqrt(0.01 / max(abs(figures[0]), 0.01)))
        return {"current": scale.current, "share": float(self.share(np.ones(1), figures)[0]), "smaller": smaller}


class _FluxSaturation(_Saturation):
    """Inductance L₀·(1 − a·(λ/L₀I)²) of the flux linkage: λ = L₀·I/√a·tanh(√a·i/I)."""

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray | None:
        a = float(figures[0])
        x = current / scale.current
        if abs(a) < 1e-6:
            return np.asarray(current * (a * x**2 / 3.0))
        root = np.sqrt(abs(a))
        linked = np.tanh(root * x) / root if a > 0.0 else np.tan(np.clip(root * x, -1.2, 1.2)) / root
        return np.asarray(current - scale.current * linked)

    def share(self, at: FloatArray, figures: FloatArray) -> FloatArray:
        a = float(figures[0])
        root = np.sqrt(abs(a)) * at
        return np.asarray(1.0 - np.tanh(root) ** 2 if a > 0.0 else 1.0 + np.tan(np.clip(root, -1.2, 1.2)) ** 2)


class _BiasedSaturation(_Saturation):
    """Inductance L₀·(1 − a·i/I): of an axis whose iron the magnets fill in part, it falls with one direction and rises with the other."""

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray | None:
        return np.asarray(0.5 * float(figures[0]) * current**2 / scale.current)

    def share(self, at: FloatArray, figures: FloatArray) -> FloatArray:
        return np.asarray(1.0 - float(figures[0]) * at)

    def within(self, figures: FloatArray) -> bool:
        return bool(abs(figures[0]) < 0.9)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        smaller = float(scale.current * 0.01 / max(abs(figures[0]), 0.01))
        return {"current": scale.current, "share": float(self.share(np.ones(1), figures)[0]), "smaller": smaller}


class _MagnetSaturation(_Saturation):
    """Inductance L₀/(1 + a·i/I + c·(i/I)²): of the magnets' axis, it may rise with a current against them and fall again.

    With a = 2mb/(1 + m²) and c = b²/(1 + m²) that is the arctangent's law of iron that the magnets fill by m already.
    """

    start = (0.0, 0.0)
    known = (np.inf, np.inf)
    # A law of one figure that is nearly as good is the simpler one.
    price: ClassVar[float] = 3.0

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray | None:
        a, c = (float(each) for each in figures)
        x = np.clip(current / scale.current, *_FITTED)
        # The integral from no current has a closed form of its own for every sign of 4c − a²; this is one for all.
        linked = np.zeros_like(x)
        for place, weight in zip(_NODES, _WEIGHTS, strict=True):
            y = place * x
            linked += weight / (1.0 + y * (a + c * y))
        return np.asarray(current * (1.0 - linked))

    def share(self, at: FloatArray, figures: FloatArray) -> FloatArray:
        x = np.clip(at, *_FITTED)
        return np.asarray(1.0 / (1.0 + float(figures[0]) * x + float(figures[1]) * x**2))

    def within(self, figures: FloatArray) -> bool:
        inverse = 1.0 + figures[0] * _PLACES + figures[1] * _PLACES**2
        return bool(np.all((inverse > 0.3) & (inverse < 6.0)))

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        smaller = float(scale.current * 0.01 / max(abs(figures[0]), np.sqrt(0.01 * abs(figures[1])), 0.01))
        return {"current": scale.current, "share": float(self.share(np.ones(1), figures)[0]), "smaller": smaller}


class _Bend(Term):
    """The current's channel reads less and less of a current, as a probe whose core comes near saturation: i = r·(1 + a·(r/I)²) flows
    where it reads r.

    An inductance that rises with the current makes nearly the same shape, with a resistance higher by 1 + a.
    """

    cause, family = Cause.DISTORTION, "saturation"
    # Probes bend more rarely than iron and circuits do the same.
    price: ClassVar[float] = 12.0

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        flows, a = current / scale.current, float(figures[0])
        read = flows / (1.0 + a * np.minimum(flows**2, 1.0))
        for _ in range(_ITERATIONS):
            read = read - (read * (1.0 + a * read**2) - flows) / (1.0 + 3.0 * a * read**2)
        return np.asarray(scale.current * read)

    def channel_slopes(
        self, slopes: FloatArray, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray:
        read = self.channel(current, step, scale, figures) / scale.current
        return np.asarray(slopes / (1.0 + 3.0 * float(figures[0]) * read**2))

    def within(self, figures: FloatArray) -> bool:
        return bool(-0.2 < figures[0] < 1.0)

    def possible(self, figures: FloatArray) -> bool:
        return bool(figures[0] > 0.0)

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        return {"record": "step-bend", "share": float(figures[0] / (1.0 + figures[0]))}


def rises(term: Term, figures: FloatArray) -> bool:
    """Tell whether a term is an inductance that rises with the current, or a channel that makes nearly the same shape."""
    law = isinstance(term, _Saturation) and float(term.share(np.ones(1), figures)[0]) > 1.0
    return law or isinstance(term, _Bend)


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
    _Saturation(),
    _FluxSaturation(),
    _BiasedSaturation(),
    _MagnetSaturation(),
    _Bend(),
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
    named = [Direction("skew", Cause.SKEW, _Skew()), Direction("saturation", Cause.SATURATION, _Saturation())]
    named += [Direction("eddy", Cause.SECOND_TIME_CONSTANT, _Eddy(lag)) for lag in EDDIES]
    named += [Direction("coupling", Cause.AC_COUPLED, _Coupling()), Direction("slope", Cause.SLOPE, _Slope())]
    for line in lines:
        named += 2 * [Direction(line.family, Cause.HUM, line)]
    return named, rows
