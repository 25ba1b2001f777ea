"""Plots of a flux map: flux linkages over currents, the plane of currents with torque and voltage, largest torque over speed."""

import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from drivers.interfaces.text import Text, text
from procedures.core.axes import Axes, CurveStyle, FloatArray, PlotCurve
from procedures.core.contours import contours
from reports.document.record import ProcedureRecord
from reports.plots.misfit import SPEED
from reports.plots.model import Plot

_RPM = np.pi / 30.0
_D, _Q, _TORQUE = text("d-axis current"), text("q-axis current"), text("Torque")
_PSI_D, _PSI_Q = text("d-axis flux linkage"), text("q-axis flux linkage")
_UNNAMED = Text("_")
_MANNERS = (CurveStyle.FIT, CurveStyle.SECOND, CurveStyle.THIRD)
#: Lines of equal torque, shares of the largest, and speeds of the voltage's limits, shares of the last.
_TORQUES, _SPEEDS = (0.2, 0.4, 0.6, 0.8), (0.5, 0.75, 1.0)


def flux_map(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    """Give the map's two flux linkages, its plane of currents, and the largest torque over speed."""
    grid, points = findings.get("grid"), findings.get("tables", {}).get("flux_map.csv")
    if not grid or not points:
        return
    read = {name: np.asarray(column, dtype=np.float64) for name, column in points.items()}
    i_d, i_q, psi_d, psi_q = (np.asarray(grid[name], dtype=np.float64) for name in ("i_d", "i_q", "psi_d", "psi_q"))
    measured = np.asarray(grid["measured"], dtype=bool)
    psi_d, psi_q = (np.where(measured, each, np.nan) for each in (psi_d, psi_q))
    d_curves = [
        PlotCurve(Text("i_q = {current:.3g} A", {"current": i_q[k]}), i_d, psi_d[:, k], manner)
        for k, manner in zip(_places(i_q), _MANNERS, strict=False)
    ]
    q_curves = [
        PlotCurve(Text("i_d = {current:.3g} A", {"current": i_d[k]}), i_q, psi_q[k], manner)
        for k, manner in zip(_sides(i_d), _MANNERS, strict=False)
    ]
    yield Plot(
        procedure.name,
        text("Flux linkages: the smooth surface at some currents of the other axis, and the points read"),
        (
            (
                Axes(_D, "A", _PSI_D, "V·s", (PlotCurve(_UNNAMED, read["id_A"], read["psi_d_Vs"], CurveStyle.READING), *d_curves)),
                Axes(_Q, "A", _PSI_Q, "V·s", (PlotCurve(_UNNAMED, read["iq_A"], read["psi_q_Vs"], CurveStyle.READING), *q_curves)),
            ),
        ),
    )  # fmt: skip
    yield from _plane(procedure, findings, read, (i_d, i_q, psi_d, psi_q))
    yield from _over_speed(procedure, findings)


def _plane(
    procedure: ProcedureRecord,
    findings: Mapping[str, Any],
    read: Mapping[str, FloatArray],
    grid: tuple[FloatArray, ...],
) -> Iterator[Plot]:
    i_d, i_q, psi_d, psi_q = grid
    upper = i_q >= 0.0
    torque = 1.5 * float(findings["pole_pairs"]) * (psi_d * i_q - psi_q * i_d[:, np.newaxis])
    largest = float(np.nanmax(torque))
    curves = [PlotCurve(text("points read"), read["id_A"], np.abs(read["iq_A"]), CurveStyle.READING)]
    if findings.get("mtpa"):
        along = [(0.0, 0.0), *((each["i_d"], each["i_q"]) for each in findings["mtpa"] if not each["at_edge"])]
        curves.append(PlotCurve(text("largest torque per ampere"), *_columns(along), CurveStyle.FIT))
    for number, share in enumerate(_TORQUES):
        name = text("equal torque, {torques}", torques=_listed([share * largest for share in _TORQUES], "N·m"))
        for x, y in contours(i_d, i_q[upper], torque[:, upper], share * largest):
            curves.append(PlotCurve(name if not number else _UNNAMED, x, y, CurveStyle.RESIDUAL))
            name = _UNNAMED
    curves += list(_voltage_limits(findings, (i_d, i_q[upper], psi_d[:, upper], psi_q[:, upper])))
    yield Plot(
        f"{procedure.name}-plane",
        text(
            "Plane of currents: points read, largest torque per ampere, lines of equal torque, and the voltage's limits"
        ),
        ((Axes(_D, "A", _Q, "A", curves),),),
        (1.6,),
    )


def _voltage_limits(findings: Mapping[str, Any], grid: tuple[FloatArray, ...]) -> Iterator[PlotCurve]:
    over_speed = findings.get("largest_torque")
    if not over_speed:
        return
    i_d, i_q, psi_d, psi_q = grid
    resistance = float(np.mean(findings["resistance"]["resistance"]))
    voltage = float(findings["bus_voltage"]) / math.sqrt(3.0)
    speeds = [share * float(over_speed[-1]["speed"]) for share in _SPEEDS]
    name = text("voltage's limit at {speeds}", speeds=_listed([round(speed / _RPM) for speed in speeds], "rpm"))
    for speed in speeds:
        electrical = speed * float(findings["pole_pairs"])
        taken = np.hypot(
            resistance * i_d[:, np.newaxis] - electrical * psi_q, resistance * i_q[np.newaxis, :] + electrical * psi_d
        )
        for x, y in contours(i_d, i_q, taken, voltage):
            yield PlotCurve(name, x, y, CurveStyle.SECOND)
            name = _UNNAMED


def _over_speed(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    points = findings.get("largest_torque", ())
    if len(points) < 2:
        return
    speed = np.array([point["speed"] for point in points]) / _RPM
    curves = [
        PlotCurve(
            text("largest torque"), speed, np.array([point["torque"]["value"] for point in points]), CurveStyle.FIT
        ),
        *(
            PlotCurve(
                text("its 95 % interval") if not end else _UNNAMED,
                speed,
                np.array([point["torque"]["coverage_interval"][end] for point in points]),
                CurveStyle.RESIDUAL,
            )
            for end in (0, 1)
        ),
    ]
    yield Plot(
        f"{procedure.name}-speed",
        text(
            "Largest torque of the air gap over speed, at {voltage:.3g} V of the bus and {current:.3g} A",
            voltage=findings["bus_voltage"],
            current=findings["largest_current"],
        ),
        ((Axes(SPEED, "rpm", _TORQUE, "N·m", curves, True, True),),),
        (0.8,),
    )


def _places(values: FloatArray) -> list[int]:
    """Return the places of zero, of half the largest value and of nearly the largest."""
    return [int(np.argmin(np.abs(values - share * values[-1]))) for share in (0.0, 0.5, 0.9)]


def _sides(values: FloatArray) -> list[int]:
    """Return the places of zero, and of half the least and the largest value."""
    return [int(np.argmin(np.abs(values - value))) for value in (0.0, 0.5 * values[0], 0.5 * values[-1])]


def _columns(pairs: Sequence[tuple[float, float]]) -> tuple[FloatArray, FloatArray]:
    plane = np.array(pairs, dtype=np.float64)
    return plane[:, 0], plane[:, 1]


def _listed(values: Sequence[float | int], unit: str) -> Text:
    return Text(
        "{values} {unit}",
        {
            "values": " · ".join(str(value) if isinstance(value, int) else f"{value:.3g}" for value in values),
            "unit": unit,
        },
    )
