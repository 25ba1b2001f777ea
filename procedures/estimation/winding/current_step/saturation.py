"""Terms of a current step's circuit and channel that are not proportional to the current: iron that saturates, and a probe that bends."""

from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.fitting.misfit import Cause
from procedures.estimation.winding.current_step.term import StepScale, Term

#: Currents, in steps, between which an inductance follows its law, and some of them.
_FITTED = (-0.1, 1.2)
_PLACES = np.linspace(*_FITTED, 14)
#: Readings, in steps, among which that of a current is sought.
_READ = np.linspace(0.0, 1.6, 801)
#: Between which a bend's power lies; where more flows than is read by this share, anybody sees that the current does not reach its end.
_LEAST_POWER, _MOST_POWER, _MOST_BENT = 0.9, 29.0, 1.0 / 3.0
#: Least change of the current with the reading, where a fit on its way has a channel that reads more of more current.
_FLATTEST = 0.05
#: The most that a channel which bends loses at the end: this share of what the inductance seems to rise by, and so much of what it loses
#: by its own law.
_LOST_OF_RISE, _OF_LAW = 0.5, 2.0
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


@dataclass(frozen=True)
class BentChannel(Term):
    """The current's channel reads less and less of a current: i = r·(1 + a·|r/I|ⁿ) flows where it reads r, as from a probe whose core
    comes near saturation, or whose amplifier or compensation comes to its end.

    The figures are a, and the logarithm of n over `exponent` if n is not that. An inductance that rises with the current makes nearly the
    same shape, with a resistance higher by 1 + a.
    """

    cause: ClassVar[Cause] = Cause.DISTORTION
    family: ClassVar[str] = "saturation"
    # Probes bend more rarely than iron and circuits do the same.
    price: ClassVar[float] = 15.0
    exponent: float = 2.0

    start: tuple[float, ...] = (0.0, 0.0)
    known: tuple[float, ...] = (np.inf, 1.0)

    def channel(self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray) -> FloatArray:
        """Return what the channel makes of currents (A, shape (…, n))."""
        flows = np.abs(current / scale.current)
        # A reading is sought among some, and then found by one step of Newton's.
        flowing = _READ * (1.0 + float(figures[0]) * _READ ** self.power(figures))
        falls = np.flatnonzero(np.diff(flowing) <= 0.0)
        rises = slice(None, int(falls[0]) + 1 if falls.size else None)
        near = np.interp(flows, flowing[rises], _READ[rises])
        off = np.minimum(flows, flowing[rises][-1]) - near * (1.0 + float(figures[0]) * near ** self.power(figures))
        return np.asarray(np.sign(current) * abs(scale.current) * (near + off / self._slope(near, figures)))

    def channel_slopes(
        self, slopes: FloatArray, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray:
        """Return what the channel makes of small changes (A, shape (m, n)) of the current (n,)."""
        return np.asarray(
            slopes / self._slope(np.abs(self.channel(current, step, scale, figures) / scale.current), figures)
        )

    def channel_by_figures(
        self, current: FloatArray, step: float, scale: StepScale, figures: FloatArray
    ) -> FloatArray | None:
        """Return the derivatives (k, n) of what the channel makes of a current (n,) by the figures (k,)."""
        read = self.channel(current, step, scale, figures) / scale.current
        size, n = np.abs(read), self.power(figures)
        by_a = -scale.current * read * size**n / self._slope(size, figures)
        by_n = by_a * float(figures[0]) * n * np.log(np.maximum(size, _READ[1]))
        return np.array([by_a, by_n][: figures.size])

    def within(self, figures: FloatArray) -> bool:
        """Tell whether a fit may go to these figures."""
        return bool(-0.05 < figures[0] < 1.0 and _LEAST_POWER < self.power(figures) < _MOST_POWER)

    def possible(self, figures: FloatArray) -> bool:
        """Tell whether a core or an amplifier does so."""
        return bool(0.0 < figures[0] < _MOST_BENT)

    def power(self, figures: FloatArray) -> float:
        """Return n."""
        return self.exponent * float(np.exp(np.sum(figures[1:])))

    def cubic(self) -> "BentChannel":
        """Return the plainest law."""
        return replace(self, exponent=2.0, start=(0.0,), known=(np.inf,))

    def told(self, scale: StepScale, figures: FloatArray) -> dict[str, float | str]:
        """Return what was found, in SI."""
        return {"record": "step-bend", "share": float(figures[0] / (1.0 + figures[0]))}

    def _slope(self, read: FloatArray, figures: FloatArray) -> FloatArray:
        """Return by how much more current flows for a reading that is higher, in steps both."""
        n = self.power(figures)
        return np.maximum(1.0 + (n + 1.0) * float(figures[0]) * read**n, _FLATTEST)


def rises(term: Term, figures: FloatArray) -> bool:
    """Tell whether a term is an inductance that rises with the current, or a channel that makes nearly the same shape."""
    return isinstance(term, BentChannel) or (
        isinstance(term, _Saturation) and float(term.share(np.ones(1), figures)[0]) > 1.0
    )


def bent(term: Term, figures: FloatArray) -> float:
    """Return by what share more flows than is read at the step's current, 0 where a term is no channel that bends."""
    return max(float(figures[0]), 0.0) if isinstance(term, BentChannel) else 0.0


def lost(term: Term, figures: FloatArray) -> float:
    """Return by what share more may flow than is read at the step's current, whatever the law of a channel that bends; 0 where it does not.

    Where h(r) flows and r is read, the inductance seems to rise with h′ and the resistance with h/r, which of a gain that falls faster and
    faster rises by at most half as much, and by less the later it begins to fall.
    """
    if not isinstance(term, BentChannel):
        return 0.0
    a = max(float(figures[0]), 0.0)
    return min(_LOST_OF_RISE * (term.power(figures) + 1.0), _OF_LAW) * a


#: The laws that are looked for: one direction all of them. The first is the plainest.
LAWS: tuple[Term, ...] = (
    _Saturation(),
    _FluxSaturation(),
    _BiasedSaturation(),
    _MagnetSaturation(),
    BentChannel(),
)
