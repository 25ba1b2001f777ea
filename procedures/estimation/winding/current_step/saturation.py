"""Terms of a current step's circuit and channel that are not proportional to the current: iron that saturates, and a probe that bends."""

from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.winding.current_step.term import StepScale, Term

#: Currents, in steps, between which an inductance follows its law, and some of them.
_FITTED = (-0.1, 1.2)
_PLACES = np.linspace(*_FITTED, 14)
#: Rounds that find the reading of a current.
_ITERATIONS = 5
#: Places and weights of a mean between 0 and 1.
_NODES, _WEIGHTS = (
    0.5 * (1.0 + each) if not k else 0.5 * each for k, each in enumerate(np.polynomial.legendre.leggauss(8))
)


class _Saturation(Term):
    """Inductance L₀/(1 + a·(i/I)²) of the current, I being the step's; where a is negative it rises with the current."""

    cause, family = Cause.SATURATION, "saturation"

    def flux(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray | None:
        a = float(figures[0])
        x = current / scale.current
        if abs(a) < 1e-6:
            return np.asarray(current * (a * x**2 / 3.0))
        root = np.sqrt(abs(a))
        return np.asarray(current - scale.current * self.linked(root * x, falls=a > 0.0) / root)

    def linked(self, x: FloatArray, *, falls: bool) -> FloatArray:
        """Return the flux linkage over that of a small current, for a current in units of √|a|, where the inductance falls or rises."""
        return np.asarray(np.arctan(x) if falls else np.arctanh(np.clip(x, -0.99, 0.99)))

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

    def linked(self, x: FloatArray, *, falls: bool) -> FloatArray:
        return np.asarray(np.tanh(x) if falls else np.tan(np.clip(x, -1.2, 1.2)))

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

    def power(self, figures: FloatArray) -> float:
        """Return n of the law r·(1 + a·|r/I|ⁿ)."""
        return 2.0

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        return {"record": "step-bend", "share": float(figures[0] / (1.0 + figures[0]))}


class _SteepBend(_Bend):
    """A channel that bends late: i = r·(1 + a·|r/I|ⁿ) flows where it reads r, as where an amplifier or a compensation comes to its end.

    The figures are a, and the logarithm of n over 5.
    """

    start: tuple[float, ...] = (0.0, 0.0)
    known: tuple[float, ...] = (np.inf, 0.5)
    # A law of one figure that is nearly as good is the simpler one.
    price: ClassVar[float] = 15.0

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        flows, a, n = current / scale.current, float(figures[0]), self.power(figures)
        read = flows / (1.0 + a * np.minimum(np.abs(flows), 1.0) ** n)
        for _ in range(2 * _ITERATIONS):
            bent = a * np.minimum(np.abs(read), 2.0) ** n
            read = read - (read * (1.0 + bent) - flows) / (1.0 + (n + 1.0) * bent)
        return np.asarray(scale.current * read)

    def channel_slopes(
        self, slopes: FloatArray, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray:
        read, n = np.abs(self.channel(current, step, scale, figures) / scale.current), self.power(figures)
        return np.asarray(slopes / (1.0 + (n + 1.0) * float(figures[0]) * np.minimum(read, 2.0) ** n))

    def within(self, figures: FloatArray) -> bool:
        return bool(-0.05 < figures[0] < 1.0 and abs(figures[1]) < 1.5)

    def power(self, figures: FloatArray) -> float:
        return 5.0 * float(np.exp(figures[1]))


def rises(term: Term, figures: FloatArray) -> bool:
    """Tell whether a term is an inductance that rises with the current, or a channel that makes nearly the same shape."""
    return isinstance(term, _Bend) or risen(term, figures) > 0.0


def risen(term: Term, figures: FloatArray) -> float:
    """Return by what share an inductance is, or for a channel that bends seems, higher at the step's current than at none; 0 if not."""
    if isinstance(term, _Bend):
        return max((term.power(figures) + 1.0) * float(figures[0]), 0.0)
    return max(float(term.share(np.ones(1), figures)[0]) - 1.0, 0.0) if isinstance(term, _Saturation) else 0.0


def bent(term: Term, figures: FloatArray) -> float:
    """Return by what share more flows than is read at the step's current, 0 where a term is no channel that bends."""
    return max(float(figures[0]), 0.0) if isinstance(term, _Bend) else 0.0


#: The laws that are looked for: one direction all of them. The first is the plainest.
LAWS: tuple[Term, ...] = (
    _Saturation(),
    _FluxSaturation(),
    _BiasedSaturation(),
    _MagnetSaturation(),
    _Bend(),
    _SteepBend(),
)
