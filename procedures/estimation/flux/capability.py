"""Largest torque over speed at a voltage, from a flux map: on the current's limit, on both limits, and on the voltage's alone (MTPV)."""

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum

import numpy as np
from numpy.typing import ArrayLike
from scipy import optimize

from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.flux_map import MapFigure, MeasuredFluxMap
from procedures.estimation.flux.mtpa import torque_at
from procedures.estimation.flux.region import MeasuredRegion, measured_region

_RADII, _ANGLES = 40, 91
#: A limit is reached within this share of it.
_REACHED = 2e-3


class TorqueLimit(StrEnum):
    """Limit of the torque at a speed."""

    CURRENT = "current"
    CURRENT_AND_VOLTAGE = "current-and-voltage"
    VOLTAGE = "voltage"
    MAP_EDGE = "map-edge"


@dataclass(frozen=True)
class CapabilityPoint:
    """Largest torque (N·m) at an electrical speed (rad/s), at a current (A), and what ends it.

    `torque` is at least that much where the map's edge ends it. `voltage` (V, peak) is what the phase then takes.
    """

    electrical_speed: float
    torque: MapFigure
    i_d: float
    i_q: float
    voltage: float
    limit: TorqueLimit


def largest_torque(
    measured: MeasuredFluxMap,
    electrical_speeds: ArrayLike,
    *,
    voltage: float,
    current: float,
    resistance: float,
    pole_pairs: float,
) -> Sequence[CapabilityPoint]:
    """Return the largest motoring torque at electrical speeds (rad/s, above 0) within a phase `voltage` (V, peak: U_dc/√3) and a
    `current` (A, peak), the winding having `resistance` (Ω). Speeds at which nothing within the map fits the voltage are left out.

    Raises EstimationError for limits that are not above zero.
    """
    if not (voltage > 0.0 and current > 0.0 and resistance >= 0.0):
        raise EstimationError(
            f"voltage {voltage:g} V, current {current:g} A, resistance {resistance:g} Ω: above zero are needed, resistance may be 0"
        )
    search = _Search(measured, measured_region(measured), voltage, current, resistance, pole_pairs)
    points = (search.at(float(speed)) for speed in np.atleast_1d(np.asarray(electrical_speeds, dtype=np.float64)))
    return [point for point in points if point is not None]


class _Search:
    def __init__(
        self,
        measured: MeasuredFluxMap,
        region: MeasuredRegion,
        voltage: float,
        current: float,
        resistance: float,
        pole_pairs: float,
    ) -> None:
        self._map, self._region = measured, region
        self._voltage, self._current, self._resistance, self._poles = voltage, current, resistance, pole_pairs
        reach = min(current, 1.02 * measured.largest_current)
        radius, beta = np.meshgrid(np.linspace(0.0, reach, _RADII), np.linspace(0.0, np.pi, _ANGLES))
        at = np.column_stack(((radius * np.cos(beta)).ravel(), (radius * np.sin(beta)).ravel()))
        self._grid = at[region.holds(at)]
        self._flux = measured.surface(self._grid)
        self._torque = torque_at(measured, self._grid, pole_pairs)

    def at(self, speed: float) -> CapabilityPoint | None:
        if not speed > 0.0:
            raise EstimationError(f"an electrical speed of {speed:g} rad/s: speeds above zero are needed")
        taken = np.hypot(*_voltage(self._grid, self._flux, speed, self._resistance).T)
        fits = taken <= self._voltage
        if not np.any(fits):
            return None
        start = self._grid[fits][np.argmax(self._torque[fits])]
        at = self._refined(start, speed)
        return self._point(at, speed)

    def _refined(self, start: FloatArray, speed: float) -> FloatArray:
        # In shares of the current, so that the solver's steps are of order one.
        unit = self._current
        scale = max(float(np.max(np.abs(self._torque))), 1e-12)

        def lacking(x: FloatArray) -> float:
            return -self._torque_slope(unit * x[None, :])[0] / scale

        def lacking_slope(x: FloatArray) -> FloatArray:
            return np.asarray(-self._torque_slope(unit * x[None, :])[1] * unit / scale)

        def slack(x: FloatArray) -> FloatArray:
            at = unit * x[None, :]
            taken = float(np.hypot(*_voltage(at, self._map.surface(at), speed, self._resistance)[0]))
            edge = (self._region.offsets - self._region.normals @ at[0]) / unit
            return np.concatenate(([1.0 - taken / self._voltage, 1.0 - float(x @ x)], edge))

        def slack_slope(x: FloatArray) -> FloatArray:
            at = unit * x[None, :]
            volts = _voltage(at, self._map.surface(at), speed, self._resistance)[0]
            slope = _voltage_slope(self._map, at, speed, self._resistance)
            taken = max(float(np.hypot(*volts)), 1e-12)
            rows = [-(volts @ slope) * unit / taken / self._voltage, -2.0 * x]
            return np.vstack((*rows, -self._region.normals))

        limits = optimize.NonlinearConstraint(slack, 0.0, np.inf, jac=slack_slope)
        solution = optimize.minimize(
            lacking,
            start / unit,
            jac=lacking_slope,
            method="SLSQP",
            constraints=limits,
            options={"ftol": 1e-10, "maxiter": 60},
        )
        good = bool(np.all(slack(solution.x) > -1e-6)) and solution.fun <= lacking(start / unit)
        return np.asarray(unit * solution.x if good else start)

    def _torque_slope(self, at: FloatArray) -> tuple[float, FloatArray]:
        flux, slopes = self._map.surface(at)[0], self._map.surface.slopes(at)[0]
        i_d, i_q = at[0]
        factor = 1.5 * self._poles
        slope = slopes[0] * i_q - slopes[1] * i_d + np.array([-flux[1], flux[0]])
        return factor * float(flux[0] * i_q - flux[1] * i_d), factor * slope

    def _point(self, at: FloatArray, speed: float) -> CapabilityPoint:
        place = at[None, :]
        flux = self._map.surface(place)
        volts = _voltage(place, flux, speed, self._resistance)[0]
        taken = float(np.hypot(*volts))
        on_voltage, on_current = (
            taken > (1.0 - _REACHED) * self._voltage,
            np.hypot(*at) > (1.0 - _REACHED) * self._current,
        )
        on_edge = float(self._region.slack(place)[0]) < _REACHED * self._current and not on_current
        torque, slope = self._torque_slope(place)
        volts_slope = volts @ _voltage_slope(self._map, place, speed, self._resistance) / max(taken, 1e-12)
        active = [each for each, on in ((volts_slope, on_voltage), (2.0 * at, on_current)) if on]
        if on_edge:
            edges = self._region.offsets - self._region.normals @ at
            active.append(self._region.normals[int(np.argmin(edges))])
        # At an optimum the torque changes with the flux as if the current stayed, less what the limits then give up.
        multipliers = np.linalg.lstsq(np.array(active).T, slope, rcond=None)[0] if active else np.zeros(0)
        value = 1.5 * self._poles * np.array([[at[1], -at[0]]])
        if on_voltage:
            value = value - multipliers[0] * speed * np.array([[volts[1], -volts[0]]]) / taken
        limit = {
            (True, True): TorqueLimit.CURRENT_AND_VOLTAGE,
            (True, False): TorqueLimit.VOLTAGE,
            (False, True): TorqueLimit.CURRENT,
        }.get((bool(on_voltage), bool(on_current)), TorqueLimit.MAP_EDGE)
        figure = self._map.figure_at(torque, place, value)
        return CapabilityPoint(
            speed, figure, float(at[0]), float(at[1]), taken, TorqueLimit.MAP_EDGE if on_edge else limit
        )


def _voltage(at: FloatArray, flux: FloatArray, speed: float, resistance: float) -> FloatArray:
    return np.column_stack((resistance * at[:, 0] - speed * flux[:, 1], resistance * at[:, 1] + speed * flux[:, 0]))


def _voltage_slope(measured: MeasuredFluxMap, at: FloatArray, speed: float, resistance: float) -> FloatArray:
    """Return ∂(u_d, u_q)/∂(i_d, i_q) in Ω at one current (1, 2)."""
    slopes = measured.surface.slopes(at)[0]
    return np.asarray(resistance * np.eye(2) + speed * np.vstack((-slopes[1], slopes[0])))
