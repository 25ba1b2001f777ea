"""I(∞), L_q and R from the currents and braking torques of a short circuit: every value that explains them is weighted by its likelihood.

With y = ω·L_d/R and ξ = L_q/L_d the current is I(∞)·y·√(1 + ξ²y²)/(1 + ξy²). Its derivative by ξ is zero at ξ = 1: within their noise
the same currents belong to one ξ above 1 and one below, and no fit with one minimum has the right interval.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.population import sampled

#: What is known of L_q/L_d beforehand: a value, and the standard deviation of its logarithm.
USUAL_SALIENCY, SALIENCY_SPREAD = 1.5, 0.8
#: Unknowns that may be there or not: the probability that they are not; a size as good as none; the largest, up to which all sizes are
#: alike in their logarithms.
#: A winding that warms along the rows gains a share of its resistance, the magnets lose up to half as much of their flux linkage
#: (ferrite −0.2 %/K, neodymium −0.1 %/K, copper +0.39 %/K).
_SIZES = {
    "warming": (0.5, 0.01, 0.4),
    "saturation_d": (0.8, 0.02, 0.6),
    "saturation_q": (0.5, 0.02, 3.0),
    "drop": (0.8, 5e-4, 0.1),
    "iron": (0.5, 1e-3, 0.5),
    "friction": (0.7, 1e-3, 0.3),
    "viscous": (0.7, 1e-3, 0.3),
}
_SIGNED = ("saturation_d",)
_OTHERS = ("share", "unequal_low", "unequal_high", "offset", "zero", "noise")
_MOST_SHARE = 0.5
#: The torques' noise over the currents', of any size between these (logarithms).
_TORQUES = (math.log(0.1), math.log(10.0))
#: How far I(∞) may lie below and above the largest current, R below and above what the slowest row gives without inductance (logarithms).
_LIMIT, _RESISTANCE = (-1.5, 3.5), (-6.0, 1.5)
#: The same table gives the same figures.
_SEED = 1
_DRAWN = 1000
#: Rounds in which saturating inductances settle.
_SETTLING = 2
#: Errors below this are as good as none (relative).
_NONE = 1e-9


@dataclass(frozen=True)
class CurrentSamples:
    """Samples (n,) of the logarithms of I(∞) (A), L_q over the flux linkage, R (Ω) at the first row and at `row`; and of the other
    unknowns by name.
    """

    limit: FloatArray
    q_axis: FloatArray
    resistance: FloatArray
    mean_resistance: FloatArray
    others: Mapping[str, FloatArray]


@dataclass(frozen=True)
class ShortRows:
    """Rows of a table in the order in which they were read: electrical speeds (rad/s), currents (A), and T·ω_mech/1.5 (Ω·A²) or None.

    `unequal` is the half-width of a probed phase's deviation from the phases' mean (relative), `offset` the standard deviation of
    ln(R by torque/R by currents) through gains, `zero` the half-width of the torque's zero in shares of the largest torque; `friction`
    tells whether the torques hold it, `saturating` whether inductances may depend on the current.
    """

    speed: FloatArray
    current: FloatArray
    flux_linkage: float
    power: FloatArray | None = None
    unequal: float = 0.0
    offset: float = 0.0
    zero: float = 0.0
    friction: bool = False
    saturating: bool = False


def told(rows: ShortRows, floor: float, row: float = 0.5) -> CurrentSamples:
    """Return what the rows tell.

    `floor` is the least relative noise of a current, `row` the place, 0 … 1 along the rows, for which `mean_resistance` holds.
    Raises EstimationError where they tell nothing.
    """
    model = ShortPosterior(rows, floor)
    random = np.random.default_rng(_SEED)
    values = sampled(model.drawn(random), model.prior, model.likelihood, random)
    if not np.all(np.isfinite(values)):
        raise EstimationError("the currents do not tell I(∞) and R apart: read at low speeds too")
    known = model.named(values)
    most = model.largest_q(known)
    return CurrentSamples(
        known["limit"],
        known["saliency"] - known["limit"] - np.log1p(known["saturation_q"] * most),
        known["resistance"],
        known["resistance"] + np.log1p(row * known["warming"]),
        known,
    )


class ShortPosterior:
    """The density of what a table's rows tell: unknowns within a box (`low`, `high`), then such that are normal (`centre`, `spread`)."""

    def __init__(self, rows: ShortRows, floor: float) -> None:
        self._rows, self._floor = rows, floor
        self._along = np.linspace(0.0, 1.0, rows.speed.size)[:, None]
        self._speed, self._current = rows.speed[:, None], rows.current[:, None]
        self._relative = self._speed / float(np.max(rows.speed))
        slowest = int(np.argmin(rows.speed))
        top = math.log(float(np.max(rows.current)))
        low = math.log(rows.speed[slowest] * rows.flux_linkage / rows.current[slowest])
        flat: dict[str, tuple[float, float]] = {
            "limit": (top + _LIMIT[0], top + _LIMIT[1]),
            "resistance": (low + _RESISTANCE[0], low + _RESISTANCE[1]),
            "share": (0.0, _MOST_SHARE),
        }
        normal = {"saliency": (math.log(USUAL_SALIENCY), SALIENCY_SPREAD)}
        sizes = ["warming", *(["saturation_d", "saturation_q"] if rows.saturating else [])]
        if rows.unequal > _NONE:
            flat["unequal_low"] = flat["unequal_high"] = (-rows.unequal, rows.unequal)
        if rows.power is not None:
            flat["noise"] = _TORQUES
            sizes += ["drop", "iron", *(["friction", "viscous"] if rows.friction else [])]
            if rows.offset > _NONE:
                normal["offset"] = (0.0, rows.offset)
            if rows.zero > _NONE:
                flat["zero"] = (-rows.zero, rows.zero)
            self._power = rows.power[:, None]
            # What a torque as large as the largest adds to the power of each row.
            self._largest = float(np.max(np.abs(rows.power) / rows.speed)) * self._speed
        for name in sizes:
            absent, small, large = _SIZES[name]
            end = math.log1p(large / small)
            flat[name] = (-end if name in _SIGNED else -end * absent / (1.0 - absent), end)
        self._sizes = tuple(sizes)
        self._names = (*flat, *normal)
        self.low = np.array([low for low, _ in flat.values()])[:, None]
        self.high = np.array([high for _, high in flat.values()])[:, None]
        self.centre = np.array([centre for centre, _ in normal.values()])[:, None]
        self.spread = np.array([spread for _, spread in normal.values()])[:, None]

    def drawn(self, random: np.random.Generator) -> FloatArray:
        """Return samples of the prior (m, n)."""
        flat = self.low + (self.high - self.low) * random.random((self.low.size, _DRAWN))
        normal = self.centre + self.spread * random.standard_normal((self.centre.size, _DRAWN))
        return np.vstack((flat, normal))

    def prior(self, values: FloatArray) -> FloatArray:
        """Return logarithms of the densities (n,) beforehand, minus infinity for what cannot be."""
        flat, normal = values[: self.low.size], values[self.low.size :]
        inside = np.all((flat >= self.low) & (flat <= self.high), axis=0)
        return np.where(inside, -0.5 * (((normal - self.centre) / self.spread) ** 2).sum(0), -np.inf)

    def named(self, values: FloatArray) -> dict[str, FloatArray]:
        """Return the unknowns (n,) by name, sizes as such; what is no unknown is 0."""
        known = dict(zip(self._names, values, strict=True))
        for name in self._sizes:
            absent, small, large = _SIZES[name]
            there = known[name]
            if name in _SIGNED:
                # About the middle it is not there; the box is as long as the sizes are, so that they begin further out.
                there = (
                    np.sign(there)
                    * np.maximum(np.abs(there) - absent * math.log1p(large / small), 0.0)
                    / (1.0 - absent)
                )
                known[name] = small * np.sign(there) * np.expm1(np.abs(there))
            else:
                known[name] = small * np.expm1(np.maximum(there, 0.0))
        none = np.zeros(values.shape[1])
        return {name: known.get(name, none) for name in {*self._names, *_SIZES, *_OTHERS}}

    def largest_q(self, known: Mapping[str, FloatArray]) -> FloatArray:
        """Return the largest q-axis current of the rows, in halves of I(∞), (n,)."""
        return np.asarray(np.max(self._course(known)[3], axis=0))

    def likelihood(self, values: FloatArray) -> FloatArray:
        """Return logarithms of likelihoods (n,), the noise being of any size."""
        known = self.named(values)
        resistance, size, y_squared, _ = self._course(known)
        count = self._rows.current.size
        left = np.log(size / self._current)
        if self._rows.unequal > _NONE:
            # At low speed a phase's current is its resistance's, at high speed its inductance's.
            high = known["unequal_high"]
            left += high + (known["unequal_low"] - high) / (1.0 + y_squared)
        cost = (left**2).sum(0) + count * self._floor**2
        if self._rows.power is None:
            return np.asarray(-0.5 * count * np.log(cost))
        torque = known["zero"] + known["friction"] + known["viscous"] * self._relative
        heat = resistance * size**2 * (1.0 + known["iron"] * self._relative**2) * np.exp(known["offset"])
        share = self._power / np.maximum(heat + torque * self._largest, 1e-6 * heat)
        left = np.where(share > 0.0, np.log(np.maximum(share, 1e-12)), share - 1.0)
        cost += (left**2).sum(0) * np.exp(-2.0 * known["noise"])
        return np.asarray(-count * np.log(cost) - count * known["noise"])

    def _course(self, known: Mapping[str, FloatArray]) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Return R with the drop's share, the current, ω²·L_d·L_q/R², and the q-axis current in halves of I(∞); each (rows, n)."""
        limit = np.exp(known["limit"])
        emf = self._speed * self._rows.flux_linkage
        weaker = 1.0 - known["warming"] * known["share"] * self._along
        ohms = np.exp(known["resistance"])
        resistance = ohms * (1.0 + known["warming"] * self._along + known["drop"] * limit / self._current)
        across = emf / (limit * resistance)
        d_axis, q_axis = across, np.exp(known["saliency"]) * across
        x_d, x_q = d_axis, q_axis / (1.0 + known["saturation_q"] * 0.7)
        i_q = x_d
        # Inductances that depend on no current need no rounds.
        for _ in range(_SETTLING + 1 if self._rows.saturating else 0):
            scale = weaker * across / (1.0 + x_d * x_q)
            i_d, i_q = scale * x_q, 2.0 * scale
            x_d = d_axis * (1.0 + known["saturation_d"] * (1.0 - i_d))
            x_q = q_axis / (1.0 + known["saturation_q"] * i_q)
        y_squared = x_d * x_q
        size = limit * weaker * across * np.sqrt(1.0 + x_q**2) / (1.0 + y_squared)
        return resistance, size, np.maximum(y_squared, 0.0), i_q
