"""Maximum torque per ampere of a flux map."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import MapFigure, MeasuredFluxMap
from procedures.estimation.flux.region import measured_region

_ANGLES = 361
_NEWTON = 20
#: A slope that changes by less than this share of the largest over a step of the scan does not bend.
_FLAT = 1e-6


@dataclass(frozen=True)
class MtpaPoint:
    """The angle of most torque at one current (A, peak): `angle` in degrees from the q axis, positive towards −d; torque in N·m.

    `at_edge` where the map ends before the torque has its maximum: the figures are then those of the edge, and no maximum.
    """

    current: float
    angle: MapFigure
    torque: MapFigure
    i_d: float
    i_q: float
    at_edge: bool


def maximum_torque_per_ampere(measured: MeasuredFluxMap, currents: ArrayLike, pole_pairs: float) -> Sequence[MtpaPoint]:
    """Return for each current (A, peak) where the torque is largest with i_q > 0. Raises EstimationError for currents beyond the map."""
    result = []
    for current in np.atleast_1d(np.asarray(currents, dtype=np.float64)):
        if not 0.0 < current <= 1.02 * measured.largest_current:
            raise EstimationError(
                f"{current:g} A is not within the map; currents above 0 up to {measured.largest_current:g} A are allowed"
            )
        result.append(_at(measured, float(current), pole_pairs))
    return result


def torque_at(measured: MeasuredFluxMap, at: FloatArray, pole_pairs: float) -> FloatArray:
    """Return the torque (n,) in N·m on the map's surface at currents (n, 2): 1.5·p·(ψ_d·i_q − ψ_q·i_d)."""
    flux = measured.surface(at)
    return np.asarray(1.5 * pole_pairs * (flux[:, 0] * at[:, 1] - flux[:, 1] * at[:, 0]))


def torque_figure(measured: MeasuredFluxMap, i_d: float, i_q: float, pole_pairs: float) -> MapFigure:
    """Return the torque (N·m) at a current (A) with its interval."""
    at = np.array([[i_d, i_q]])
    value = 1.5 * pole_pairs * np.array([[i_q, -i_d]])
    return measured.figure_at(float(torque_at(measured, at, pole_pairs)[0]), at, value)


def _at(measured: MeasuredFluxMap, current: float, pole_pairs: float) -> MtpaPoint:
    region = measured_region(measured)
    beta = np.linspace(0.0, np.pi, _ANGLES)
    at = current * np.column_stack((np.cos(beta), np.sin(beta)))
    inside = region.holds(at)
    if not np.any(inside):
        raise EstimationError(f"the map has no points at {current:g} A; measure to larger currents")
    beta, at = beta[inside], at[inside]
    best = int(np.argmax(torque_at(measured, at, pole_pairs)))
    angle, step = float(beta[best]), np.pi / (_ANGLES - 1)
    edge = (
        best in (0, beta.size - 1)
        or beta[best] - beta[best - 1] > 1.5 * step
        or beta[best + 1] - beta[best] > 1.5 * step
    )
    low, high = angle - step, angle + step
    # The slope's zero by bisection and secant: the surface is smooth, but not everywhere three times differentiable.
    for _ in range(0 if edge else _NEWTON):
        slope = _slope(measured, current, np.array([low, angle, high]))
        if slope[1] > 0.0:
            low, slope_low, slope_high = angle, slope[1], slope[2]
            angle = low + (high - low) * slope_low / (slope_low - slope_high) if slope_low > slope_high else high
        else:
            high, slope_low, slope_high = angle, slope[0], slope[1]
            angle = low + (high - low) * slope_low / (slope_low - slope_high) if slope_low > slope_high else low
        angle = float(np.clip(angle, low, high))
        if high - low < 1e-9 or abs(slope[1]) < 1e-12 * float(np.max(np.abs(slope))):
            break
    i_d, i_q = current * np.cos(angle), current * np.sin(angle)
    where = np.array([[i_d, i_q]])
    curvature = float(np.diff(_slope(measured, current, angle + np.array([-step, step])))[0]) / (2.0 * step)
    value, slope_weights = _functional(where)
    surface = measured.surface
    gradient = np.einsum("kc,kcn->n", value, surface.weights(where))
    gradient = gradient + np.einsum("kca,kcan->n", slope_weights, surface.slope_weights(where))
    between = float(surface.spread(where, value, slope_weights)[0])
    # Where the torque does not bend down there is no maximum that an uncertainty could be of: the scan's step says where it was looked.
    flat = -curvature * step < _FLAT * float(np.max(np.abs(_slope(measured, current, beta))))
    degrees = 0.0 if flat else 180.0 / np.pi / -curvature
    edge, between = edge or flat, np.degrees(step) if flat else between * degrees
    figure = measured.figure(float(np.degrees(angle)) - 90.0, gradient * degrees, between=float(between))
    return MtpaPoint(current, figure, torque_figure(measured, i_d, i_q, pole_pairs), i_d, i_q, edge)


def _functional(at: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the factors of ψ and ∂ψ/∂i in the torque's slope over the current's angle, of one current each, per 1.5·p."""
    along = np.column_stack((-at[:, 1], at[:, 0]))
    slopes = np.stack((at[:, 1:] * along, -at[:, :1] * along), axis=1)
    return at, slopes


def _slope(measured: MeasuredFluxMap, current: float, beta: FloatArray) -> FloatArray:
    at = current * np.column_stack((np.cos(beta), np.sin(beta)))
    value, slopes = _functional(at)
    return np.asarray(
        np.einsum("kc,kc->k", value, measured.surface(at))
        + np.einsum("kca,kca->k", slopes, measured.surface.slopes(at))
    )
