"""A flux map as a table, and its figures as parameters."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from drivers.interfaces.text import Text, text
from procedures.core.curves import curve
from procedures.core.procedure import Procedure
from procedures.estimation.flux.capability import largest_torque
from procedures.estimation.flux.conserving import fit_conserving
from procedures.estimation.flux.flux_map import MapFigure, MeasuredFluxMap
from procedures.estimation.flux.inductances import d_axis_saturation, inductances_at, reciprocity
from procedures.estimation.flux.mtpa import maximum_torque_per_ampere
from procedures.estimation.flux.region import measured_region

#: The warning of a largest torque per ampere that lies outside of the map.
AT_EDGE = "mtpa-at-edge"
#: Beyond so many times the inductance's voltage the resistance's is told.
_OUTWEIGHED = 8.0
#: Name of the table beside a run's result.
MAP_FILE = "flux_map.csv"
#: Steps of the grid along either axis, and speeds at which the largest torque is told.
_PLACES, _SPEEDS = 24, 20
#: Currents at which the largest torque per ampere is told, shares of the map's largest.
_MTPA = (0.25, 0.5, 0.75, 1.0)


def table_of(flux_map: MeasuredFluxMap) -> Mapping[str, Sequence[float]]:
    """Return a map's points, a column each: currents (A, peak), flux linkages and their standard uncertainties (V·s, peak)."""
    uncertainty = flux_map.uncertainty
    columns = {
        "id_A": flux_map.points[:, 0],
        "iq_A": flux_map.points[:, 1],
        "psi_d_Vs": flux_map.flux[:, 0],
        "psi_q_Vs": flux_map.flux[:, 1],
        "u_psi_d_Vs": uncertainty[:, 0],
        "u_psi_q_Vs": uncertainty[:, 1],
    }
    return {name: values.tolist() for name, values in columns.items()}


def grid_of(flux_map: MeasuredFluxMap) -> Mapping[str, Any]:
    """Return the smooth surface on a rectangular grid, for plots and tables: `i_d` (n,), `i_q` (m,) in A, `psi_d`, `psi_q` (n, m) in V·s.

    `measured` (n, m) says where the map's points enclose the currents; beyond them the surface is carried on.
    """
    reach = flux_map.largest_current
    low, high = float(np.min(flux_map.points[:, 0])), float(np.max(flux_map.points[:, 0]))
    # Zero is one of them: tables of others are looked up there.
    below, above = round(_PLACES * -low / (high - low)), round(_PLACES * high / (high - low))
    i_d = np.concatenate((np.linspace(low, 0.0, below + 1)[:-1], np.linspace(0.0, high, above + 1)))
    i_q = reach * np.arange(-_PLACES // 2, _PLACES // 2 + 1) / (_PLACES // 2)
    at = np.column_stack([each.ravel() for each in np.meshgrid(i_d, i_q, indexing="ij")])
    flux = flux_map.surface(at)
    shape = (i_d.size, i_q.size)
    return {
        "i_d": i_d.tolist(),
        "i_q": i_q.tolist(),
        "psi_d": flux[:, 0].reshape(shape).tolist(),
        "psi_q": flux[:, 1].reshape(shape).tolist(),
        "measured": measured_region(flux_map).holds(at).reshape(shape).tolist(),
    }


def saturation_of(flux_map: MeasuredFluxMap) -> Mapping[str, Any]:
    """Return `d_axis_saturation`: how L_d of the chord changes with negative i_d; nothing where the map has too little of that axis."""
    found = d_axis_saturation(flux_map)
    return {} if found is None else {"d_axis_saturation": found.as_dict()}


def conserving_of(flux_map: MeasuredFluxMap) -> Mapping[str, Any]:
    """Return how far the map is from one that conserves energy: point by point (V·s), the largest as a share of full scale, and how far
    ∂ψ_d/∂i_q and ∂ψ_q/∂i_d differ (H, root mean square over the points).

    Raises EstimationError where the points do not carry a surface.
    """
    conserving = fit_conserving(flux_map)
    largest = float(np.max(np.abs(conserving.residuals))) / flux_map.full_scale
    return {
        "residuals": curve(psi_d=conserving.residuals[:, 0], psi_q=conserving.residuals[:, 1]),
        "largest_share": largest,
        "reciprocity": float(np.sqrt(np.mean(reciprocity(flux_map, flux_map.points) ** 2))),
    }


@dataclass(frozen=True)
class MapBudget:
    """The names in a map's budget: its points' scatter, the shared contributions, and the determination of MTPA."""

    scatter: Text
    shared: Mapping[str, Text]
    section: str
    estimator: str


def report_figure(
    procedure: Procedure[Any],
    budget: MapBudget,
    name: str,
    figure: MapFigure,
    flux_map: MeasuredFluxMap,
    *,
    estimator: str,
) -> None:
    """Report a figure of a map as a parameter: its scatter, what lies between the points, and what they share as limits."""
    unc = procedure.bench.uncertainties
    made = unc.statistical(budget.scatter, figure.value, figure.scatter, flux_map.degrees_of_freedom)
    if figure.sessions:
        made = made + unc.statistical(
            text("differences between the run's sessions: angle's zero, magnets, gains"),
            0.0,
            figure.sessions,
            flux_map.degrees_of_freedom,
        )
    if figure.between:
        made = made + unc.statistical("interpolation between the map's points", 0.0, figure.between)
    for what, half_width in figure.shared.items():
        made = made + unc.limit(budget.shared[what], 0.0, abs(half_width))
    procedure.report(name, made, section=budget.section, estimator=estimator)


def tell_resistance(procedure: Procedure[Any], flux_map: MeasuredFluxMap, resistance: float, speed: float) -> None:
    """Say where the resistance (Ω) outweighs the inductance at an electrical speed (rad/s).

    A reading at either speed has ψ − τ·R·i, τ the delay between voltage and current: there a microsecond of it is per cent of ψ.
    """
    zero = inductances_at(flux_map, 0.0, 0.0)
    smaller = min(zero.dd.value, zero.qq.value)
    ratio = resistance / (speed * smaller) if smaller > 0.0 else 0.0
    if ratio > _OUTWEIGHED:
        procedure.notice(
            "resistance-outweighs",
            text(
                "at this speed the voltage across the resistance is {ratio:.2g} times that across the inductance, "
                "so the unknown part of the delay between voltage and current affects the flux linkages, whose "
                "intervals may be too narrow: raise speed_share",
                ratio=ratio,
            ),
        )


def at_edge(current: float) -> Text:
    """Return what is said where the largest torque at a current (A) lies outside of the map."""
    return text(
        "at {current:.3g} A the torque still increases at the edge of the map: the largest torque per ampere lies "
        "outside of it; measure over a wider range of d-axis current",
        current=current,
    )


def report_mtpa(procedure: Procedure[Any], budget: MapBudget, flux_map: MeasuredFluxMap, pole_pairs: float) -> None:
    """Report the largest torque and its angle at the map's largest current, and put those at smaller ones among the findings.

    Where the torque still grows at the map's edge, that is said instead.
    """
    currents = [share * flux_map.largest_current for share in _MTPA]
    points = maximum_torque_per_ampere(flux_map, currents, pole_pairs)
    procedure.findings["mtpa"] = [
        {
            "current": point.current,
            "i_d": point.i_d,
            "i_q": point.i_q,
            "at_edge": point.at_edge,
            "angle": point.angle.as_dict(),
            "torque": point.torque.as_dict(),
        }
        for point in points
    ]
    last = points[-1]
    if last.at_edge:
        procedure.notice(AT_EDGE, at_edge(last.current))
        return
    for name, figure in (("mtpa_angle", last.angle), ("mtpa_torque", last.torque)):
        report_figure(procedure, budget, name, figure, flux_map, estimator=budget.estimator)


def capability_of(
    flux_map: MeasuredFluxMap, *, bus_voltage: float, resistance: float, pole_pairs: float, speed: float
) -> Sequence[Mapping[str, Any]]:
    """Return the largest torque over the speed up to `speed` (rad/s, mechanical) at a bus voltage (V) and the map's largest current."""
    found = largest_torque(
        flux_map,
        pole_pairs * speed * np.linspace(0.05, 1.0, _SPEEDS),
        voltage=bus_voltage / math.sqrt(3.0),
        current=flux_map.largest_current,
        resistance=resistance,
        pole_pairs=pole_pairs,
    )
    return [
        {
            "speed": point.electrical_speed / pole_pairs,
            "torque": point.torque.as_dict(),
            "i_d": point.i_d,
            "i_q": point.i_q,
            "voltage": point.voltage,
            "limit": point.limit.value,
        }
        for point in found
    ]
