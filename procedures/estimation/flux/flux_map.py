"""A flux map: flux linkages at locations, with what they share of uncertainty apart from what they do not."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from procedures.estimation.fitting.expanded import half_width
from procedures.estimation.fitting.fit import FloatArray
from procedures.estimation.flux.surface import FluxSurface, fit_surface

#: A drive's delay between voltage and current, which a fit finds, is trusted to this (s), a third of a usual switching period.
TRUSTED_DELAY = 1.0e-5


@dataclass(frozen=True)
class GainLimits:
    """Half-widths of what all readings share: the gains of voltage, current and speed (relative), and the delay of the voltages against
    the currents (s) beyond what a fit shows of it. They are rectangular (Type B).
    """

    voltage: float = 0.0
    current: float = 0.0
    speed: float = 0.0
    delay: float = 0.0


@dataclass(frozen=True)
class MapFigure:
    """One figure that follows from a map, in SI: value, standard uncertainty and 95 % coverage interval.

    `scatter` and `between` are the standard uncertainties of the readings' noise and of what lies between the points, `sessions` that of
    what is other from one session of a run to the next, `shared` the half-widths (rectangular, signed) of what all readings share, by name.
    """

    value: float
    standard_uncertainty: float
    coverage_interval: tuple[float, float]
    scatter: float = 0.0
    between: float = 0.0
    shared: Mapping[str, float] = field(default_factory=dict)
    sessions: float = 0.0

    def as_dict(self) -> dict[str, object]:
        """Return it as `--json` prints it."""
        return {
            "value": self.value,
            "standard_uncertainty": self.standard_uncertainty,
            "coverage_interval": list(self.coverage_interval),
        }


@dataclass(frozen=True)
class MeasuredFluxMap:
    """Flux linkages `flux` (m, 2) in V·s at currents `points` (m, 2) in A, peak, d along the magnet, currents into the motor.

    Where `symmetric`, points have i_q ≥ 0 and stand for their mirror images: ψ_d even, ψ_q odd in i_q. `covariance` (2m, 2m) of
    ψ_d, ψ_q of the first point, of the second … is that of scatter, at `degrees_of_freedom`; `shared` holds by name what a common
    error at its limit does to each of them (2m,), rectangular. Where the readings are of several sessions, `by_sessions` (2m, 2m) is the
    part of `covariance` that stems from what was other in them: the angle's zero, the magnets, gains.
    """

    points: FloatArray
    flux: FloatArray
    covariance: FloatArray
    symmetric: bool
    degrees_of_freedom: float = np.inf
    shared: Mapping[str, FloatArray] = field(default_factory=dict)
    by_sessions: FloatArray | None = None

    @property
    def full_scale(self) -> float:
        """The largest |ψ| (V·s), which deviations are told in shares of."""
        return float(np.max(np.hypot(self.flux[:, 0], self.flux[:, 1])))

    @property
    def largest_current(self) -> float:
        """The largest |i| (A)."""
        return float(np.max(np.hypot(self.points[:, 0], self.points[:, 1])))

    @property
    def scatter(self) -> FloatArray:
        """Standard uncertainty (m, 2) in V·s by scatter alone."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0)).reshape(-1, 2)

    @property
    def uncertainty(self) -> FloatArray:
        """Combined standard uncertainty (m, 2) in V·s of each flux linkage."""
        common = sum((limit**2 / 3.0 for limit in self.shared.values()), np.zeros(self.flux.size))
        return np.asarray(np.sqrt(self.scatter**2 + common.reshape(-1, 2)))

    @cached_property
    def surface(self) -> FluxSurface:
        """A smooth surface through the points, its smoothness chosen by leaving out locations."""
        floor = (1e-6 * self.full_scale) ** 2
        return fit_surface(self.points, self.flux, symmetric=self.symmetric, variances=self.scatter**2 + floor)

    def figure(self, value: float, gradient: FloatArray, *, between: float = 0.0, coverage: float = 0.95) -> MapFigure:
        """Return a figure with derivatives `gradient` (2m,) by the flux linkages, and `between` its standard uncertainty for what lies
        between the points.
        """
        noise = float(np.sqrt(max(float(gradient @ self.covariance @ gradient), 0.0)))
        shared = {name: float(gradient @ limit) for name, limit in self.shared.items()}
        limits = [abs(limit) for limit in shared.values()]
        scattered = [(u, freedom) for u, freedom in ((noise, self.degrees_of_freedom), (between, np.inf)) if u > 0.0]
        half = half_width(limits, scattered, coverage)
        standard = float(np.sqrt(noise**2 + between**2 + sum(a * a for a in limits) / 3.0))
        part = 0.0 if self.by_sessions is None else float(gradient @ self.by_sessions @ gradient)
        sessions = float(np.sqrt(min(max(part, 0.0), noise**2)))
        alone = float(np.sqrt(noise**2 - sessions**2))
        return MapFigure(value, standard, (value - half, value + half), alone, between, shared, sessions)

    def figure_at(self, value: float, at: FloatArray, factors: FloatArray) -> MapFigure:
        """Return a figure that hangs on the flux linkages at currents (k, 2) by `factors` (k, 2)."""
        gradient = np.einsum("kc,kcn->n", factors, self.surface.weights(at))
        between = math.hypot(*self.surface.spread(at, factors, np.zeros((len(at), 2, 2))))
        return self.figure(value, gradient, between=between)

    def torque(self, pole_pairs: float) -> FloatArray:
        """Return the air gap's torque (m,) in N·m at the points: 1.5·p·(ψ_d·i_q − ψ_q·i_d)."""
        return np.asarray(
            1.5 * pole_pairs * (self.flux[:, 0] * self.points[:, 1] - self.flux[:, 1] * self.points[:, 0])
        )


def of_gains(
    points: FloatArray, flux: FloatArray, slopes: FloatArray, *, voltage: float, current: float
) -> dict[str, FloatArray]:
    """Return what gains of voltage and current (relative) do to flux linkages (m, 2) at currents (m, 2) where ψ rises by `slopes`
    (m, 2, 2): (2m,) each, as a map's `shared` has them.
    """
    return {"voltage": voltage * flux.ravel(), "current": -current * np.einsum("kab,kb->ka", slopes, points).ravel()}
