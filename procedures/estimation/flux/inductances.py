"""Apparent and differential inductances of a flux map."""

from dataclasses import dataclass

import numpy as np

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import MapFigure, MeasuredFluxMap

#: Below this share of the largest current a flux linkage is not divided by its current: the differential one stands there.
_SMALL = 0.02
#: Less flux at zero current, in shares of the largest, is no magnet's.
_NO_MAGNET = 0.005
#: A map's d axis is fitted where it reaches this share of the largest current, at so many currents.
_AXIS_SHARE, _AXIS_POINTS = 0.3, 13


@dataclass(frozen=True)
class MapInductances:
    """Inductances (H) at one current (A): `apparent_d` = (ψ_d − ψ_d(0, 0))/i_d and `apparent_q` = ψ_q/i_q, None at little current;
    `dd`, `dq`, `qd`, `qq` = ∂ψ_a/∂i_b.
    """

    i_d: float
    i_q: float
    apparent_d: MapFigure | None
    apparent_q: MapFigure | None
    dd: MapFigure
    dq: MapFigure
    qd: MapFigure
    qq: MapFigure


def inductances_at(measured: MeasuredFluxMap, i_d: float, i_q: float) -> MapInductances:
    """Return the inductances at a current (A), each with its interval."""
    surface, at = measured.surface, np.array([[i_d, i_q], [0.0, 0.0]])
    flux = surface(at)
    slopes, slope_weights = surface.slopes(at[:1])[0], surface.slope_weights(at[:1])[0]
    least = _SMALL * measured.largest_current

    def differential(flux_axis: int, current_axis: int) -> MapFigure:
        factors = np.zeros((1, 2, 2))
        factors[0, flux_axis, current_axis] = 1.0
        between = float(surface.spread(at[:1], np.zeros((1, 2)), factors)[0])
        return measured.figure(
            float(slopes[flux_axis, current_axis]), slope_weights[flux_axis, current_axis], between=between
        )

    def apparent(axis: int, current: float) -> MapFigure | None:
        if abs(current) < least:
            return None
        factors = np.zeros((2, 2))
        factors[:, axis] = 1.0 / current, (-1.0 / current if axis == 0 else 0.0)
        return measured.figure_at(float(np.sum(factors * flux)), at, factors)

    return MapInductances(
        i_d, i_q, apparent(0, i_d), apparent(1, i_q), differential(0, 0), differential(0, 1), differential(1, 0),
        differential(1, 1),
    )  # fmt: skip


@dataclass(frozen=True)
class DAxisSaturation:
    """ψ_d = ψ_d(0) + L·i_d + scale·i_d² at i_q = 0 from `lowest_current` (A) to 0: `inductance` in H, `scale` in H/A."""

    inductance: MapFigure
    scale: MapFigure
    lowest_current: float

    def as_dict(self) -> dict[str, object]:
        """Return it for the findings."""
        return {
            "inductance": self.inductance.as_dict(),
            "scale": self.scale.as_dict(),
            "lowest_current": self.lowest_current,
        }


def d_axis_saturation(measured: MeasuredFluxMap) -> DAxisSaturation | None:
    """Return how L_d of the chord changes with negative i_d, by least squares; None where the map has too little of that axis.

    What the parabola leaves counts as uncertainty.
    """
    lowest = float(np.min(measured.points[:, 0]))
    if lowest > -_AXIS_SHARE * measured.largest_current:
        return None
    i_d = np.linspace(lowest, 0.0, _AXIS_POINTS)
    at = np.column_stack((i_d, np.zeros_like(i_d)))
    design = np.column_stack((np.ones_like(i_d), i_d, i_d**2))
    solved = np.linalg.pinv(design)
    flux, weights = measured.surface(at)[:, 0], measured.surface.weights(at)[:, 0, :]
    factors = solved @ flux
    left = flux - design @ factors
    # The remainder is smooth, not noise: its points are not independent, so it is not divided by their number.
    misfit = float(np.sqrt(left @ left / (i_d.size - 3)))
    made = []
    for row, value in zip(solved[1:], factors[1:], strict=True):
        each = np.column_stack((row, np.zeros_like(row)))
        lying = float(np.sum(measured.surface.spread(at, each, np.zeros((i_d.size, 2, 2))) ** 2))
        remains = misfit * float(np.sum(np.abs(row)))
        made.append(measured.figure(float(value), row @ weights, between=float(np.hypot(np.sqrt(lying), remains))))
    return DAxisSaturation(made[0], made[1], lowest)


def characteristic_current(measured: MeasuredFluxMap) -> MapFigure | None:
    """Return the field-weakening current (A) −i_d at which nothing of the d flux is left; None where the map ends before.

    Raises EstimationError where the map has no magnet to weaken.
    """
    lowest = float(np.min(measured.points[:, 0]))
    i_d = np.linspace(lowest, 0.0, 401)
    flux = measured.surface(np.column_stack((i_d, np.zeros_like(i_d))))[:, 0]
    if flux[-1] <= _NO_MAGNET * measured.full_scale:
        raise EstimationError("the map has no magnet's flux along +d at zero current, so there is none to weaken")
    below = np.flatnonzero(flux <= 0.0)
    if not below.size:
        return None
    k = int(below[-1])
    crossing = float(i_d[k] - flux[k] * (i_d[k + 1] - i_d[k]) / (flux[k + 1] - flux[k]))
    at = np.array([[crossing, 0.0]])
    slope = float(measured.surface.slopes(at)[0, 0, 0])
    return measured.figure_at(-crossing, at, np.array([[1.0 / slope, 0.0]]))


def reciprocity(measured: MeasuredFluxMap, at: FloatArray) -> FloatArray:
    """Return ∂ψ_d/∂i_q − ∂ψ_q/∂i_d (H) at currents (n, 2): 0 where the map conserves energy, 2·ΔR/ω for a resistance ΔR too small."""
    slopes = measured.surface.slopes(at)
    return np.asarray(slopes[:, 0, 1] - slopes[:, 1, 0])
