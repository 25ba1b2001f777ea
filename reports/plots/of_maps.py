"""Plots of the motor turned at many speeds: short circuit, open circuit, load points."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import cycle
from typing import Any

import numpy as np

from drivers.interfaces.text import Text, text
from procedures.core.axes import Axes, CurveStyle, FloatArray, PlotCurve
from reports.document.record import ProcedureRecord
from reports.plots.misfit import CURRENT, FITTED, RESIDUAL, SPEED
from reports.plots.model import Plot

_RPM = np.pi / 30.0
_READ, _TORQUE, _LOSS = text("readings"), text("Torque"), text("Loss")
_AMPLITUDE, _UNNAMED = text("Amplitude"), Text("_")
#: Curves that stand beside each other, told apart without colour.
_MANNERS = (CurveStyle.FIT, CurveStyle.SECOND, CurveStyle.THIRD, CurveStyle.BROAD)


def short_circuit(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    """Give current and torque over speed with their fits and what they leave, and the loss in its parts."""
    sweeps = [sweep for sweep in findings.get("sweeps", ()) if sweep.get("fit")]
    if not sweeps:
        return
    upper: tuple[list[PlotCurve], list[PlotCurve]] = ([], [])
    lower: tuple[list[PlotCurve], list[PlotCurve]] = ([], [])
    for number, (sweep, manner) in enumerate(zip(sweeps, cycle(_MANNERS), strict=False)):
        # Readings are named once.
        name_of_readings, name_of_residual = (_UNNAMED, _UNNAMED) if number else (_READ, RESIDUAL)
        speed, fit = _array(sweep["speed"]) / _RPM, sweep["fit"]
        fine, warmth = _array(fit["speed"]) / _RPM, sweep["winding_temperature"]
        for place, name in enumerate(("current", "torque")):
            upper[place].append(PlotCurve(name_of_readings, speed, _array(sweep[name]), CurveStyle.READING))
            fitted = text("fit, {temperature:.0f} °C", temperature=warmth)
            upper[place].append(PlotCurve(fitted, fine, _array(fit[name]), manner))
        left = _array(sweep["current_residual"]) * _array(sweep["current"])
        lower[0].append(PlotCurve(name_of_residual, speed, left, CurveStyle.READING))
        lower[1].append(PlotCurve(name_of_residual, speed, _array(sweep["torque_residual"]), CurveStyle.READING))
    yield Plot(
        procedure.name,
        text("Short-circuit current and braking torque over speed, their fits, and the residuals"),
        (
            (
                Axes(SPEED, "rpm", _AMPLITUDE, "A", upper[0], True, True),
                Axes(SPEED, "rpm", _TORQUE, "N·m", upper[1], True, True),
            ),
            (Axes(SPEED, "rpm", RESIDUAL, "A", lower[0], True), Axes(SPEED, "rpm", RESIDUAL, "N·m", lower[1], True)),
        ),
        (1.0, 0.6),
    )
    cold = sweeps[0]
    speed = _array(cold["speed"]) / _RPM
    curves = (
        PlotCurve(text("copper, leads and link"), speed, _array(cold["copper_loss"]), CurveStyle.FIT),
        PlotCurve(
            text("drag with open terminals, dynamometer included"), speed, _array(cold["drag_loss"]), CurveStyle.SECOND
        ),
    )
    yield Plot(
        f"{procedure.name}-loss",
        text("Loss of the short circuit over speed, and the parts that can be separated"),
        ((Axes(SPEED, "rpm", _LOSS, "W", curves, True, True),),),
        (0.8,),
    )


def open_circuit(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    """Give the EMF over speed, and the drag with its fit and what it leaves."""
    passes, drag = findings.get("passes", ()), findings.get("drag", {})
    speed = _array(drag.get("speed", ()))
    if not passes or not speed.size:
        return
    emf, flux = [], []
    for taken, manner in zip(passes, cycle(_MANNERS), strict=False):
        name = Text("{temperature:.0f} °C", {"temperature": taken["winding_temperature"]})
        at, amplitude = _array(taken["speed"]) / _RPM, _array(taken["amplitude"])
        emf.append(PlotCurve(name, at, amplitude, manner))
        flux.append(PlotCurve(name, at, amplitude / _array(taken["electrical_speed"]), manner))
    torque, residual = _array(drag["torque"]), _array(drag["residual"])
    curves = [
        PlotCurve(_READ, speed / _RPM, torque, CurveStyle.READING),
        PlotCurve(FITTED, *_course(drag["terms"], speed), CurveStyle.FIT),
    ]
    if drag.get("tare"):
        curves.append(PlotCurve(text("the dynamometer's own drag"), *_course(drag["tare"], speed), CurveStyle.SECOND))
    yield Plot(
        procedure.name,
        text("EMF with open terminals over speed; torque that turning takes, its fit, and the residual"),
        (
            (
                Axes(SPEED, "rpm", _AMPLITUDE, "V", emf, True, True),
                Axes(SPEED, "rpm", _TORQUE, "N·m", curves, True, True),
            ),
            (
                Axes(SPEED, "rpm", text("EMF over electrical speed"), "V·s/rad", flux, True),
                Axes(
                    SPEED,
                    "rpm",
                    RESIDUAL,
                    "N·m",
                    (PlotCurve(RESIDUAL, speed / _RPM, residual, CurveStyle.READING),),
                    True,
                ),
            ),
        ),
        (1.0, 0.5),
    )


def load_points(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    """Give efficiency and loss over the torque, a curve a speed, and the loss's parts at the highest speed."""
    points = [point for point in findings.get("points", ()) if point.get("efficiency") is not None]
    if len(points) < 2:
        return
    by_speed: dict[float, list[Mapping[str, Any]]] = {}
    for point in points:
        by_speed.setdefault(round(point["speed_rpm"], -1), []).append(point)
    everywhere = _array([point["torque"] for point in points])
    efficiency = [
        PlotCurve(_UNNAMED, everywhere, _array([100.0 * p["efficiency"] for p in points]), CurveStyle.READING)
    ]
    loss = [PlotCurve(_UNNAMED, everywhere, _array([point["loss"] for point in points]), CurveStyle.READING)]
    for (_, row), manner in zip(sorted(by_speed.items()), cycle(_MANNERS), strict=False):
        name = Text("{speed:.0f} rpm", {"speed": float(np.mean([point["speed_rpm"] for point in row]))})
        ordered = sorted(row, key=lambda point: float(point["torque"]))
        torque = _array([point["torque"] for point in ordered])
        efficiency.append(PlotCurve(name, torque, _array([100.0 * point["efficiency"] for point in ordered]), manner))
        loss.append(PlotCurve(name, torque, _array([point["loss"] for point in ordered]), manner))
    yield Plot(
        procedure.name,
        text("Efficiency and loss over torque, a curve a speed"),
        (
            (
                Axes(_TORQUE, "N·m", text("Efficiency"), "%", efficiency),
                Axes(_TORQUE, "N·m", _LOSS, "W", loss, False, True),
            ),
        ),
        (1.0,),
    )
    parted = [row for row in by_speed.values() if len(row) > 1 and all(each["copper"] is not None for each in row)]
    if not parted:
        return
    highest = max(range(len(parted)), key=lambda place: float(parted[place][0]["speed_rpm"]))
    fastest = sorted(parted[highest], key=lambda each: float(each["current"]))
    current = _array([point["current"] for point in fastest])
    parts = [
        PlotCurve(name, current, _array([point[key] for point in fastest]), manner)
        for (key, name), manner in zip(
            (
                ("loss", text("whole loss")),
                ("copper", text("copper")),
                ("without_current", text("drag without a current")),
                ("rest", text("rest")),
            ),
            (CurveStyle.READING, *_MANNERS[:3]),
            strict=True,
        )
    ]
    yield Plot(
        f"{procedure.name}-parts",
        text("Parts of the loss at {speed:.0f} rpm over the current's amplitude", speed=fastest[0]["speed_rpm"]),
        ((Axes(CURRENT, "A", _LOSS, "W", parts, True),),),
        (0.8,),
    )


def _course(terms: Mapping[str, float], speed: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return a fitted drag over fine speeds: rpm, and N·m."""
    fine = np.linspace(float(speed.min()), float(speed.max()), 100)
    powers: Sequence[float] = list(terms.values())
    return fine / _RPM, sum(value * fine**power for power, value in enumerate(powers)) + np.zeros_like(fine)


def _array(values: object) -> FloatArray:
    return np.asarray(values, dtype=np.float64)
