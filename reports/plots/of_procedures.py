"""The plots of each procedure, from what its findings hold and what was recorded in its steps."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from drivers.interfaces.text import Text, text
from procedures.core.axes import Axes, CurveStyle, FloatArray, PlotCurve
from reports.document.record import ProcedureRecord, Trace
from reports.plots.envelope import envelope
from reports.plots.misfit import CURRENT, FITTED, RESIDUAL, SPEED, TIME, fits, told
from reports.plots.model import Plot
from reports.plots.of_flux_map import flux_map
from reports.plots.of_maps import load_points, open_circuit, short_circuit

_RPM = np.pi / 30.0
_VOLTAGE, _READ, _RECORDED = text("Voltage"), text("readings"), text("recorded")
_PHASES = (CurveStyle.FIT, CurveStyle.SECOND, CurveStyle.THIRD)


def plots(procedure: ProcedureRecord) -> Iterator[Plot]:
    """Give the procedure's plots; none where its findings have not what they need (an older run, a reading by eye).

    Where a record shows something beyond its model, the plot of the residual names the cause.
    """
    findings = procedure.result.findings if procedure.result is not None else {}
    make = _MAKERS.get(procedure.name)
    drawn = make(procedure, findings) if make is not None else fits(procedure.name, findings)
    yield from (told(plot, findings) for plot in drawn)


def _array(values: object) -> FloatArray:
    return np.asarray(values, dtype=np.float64)


def _static(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    angles = _array(findings.get("marked_angles", ()))
    if angles.size < 2:
        return
    numbers = np.arange(1, angles.size + 1, dtype=np.float64)
    degrees = np.degrees(angles)
    yield Plot(
        procedure.name,
        text("Marked rest positions of the rotor"),
        (
            (
                Axes(
                    text("Mark"),
                    "",
                    text("Angle, mechanical"),
                    "°",
                    (PlotCurve(text("marks"), numbers, degrees, CurveStyle.READING),),
                ),
            ),
        ),
        (0.8,),
    )


def _dc(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    row, left = [], []
    for pair in ("AB", "BC", "CA"):
        line = findings.get(pair, {})
        current, voltage, residual = (_array(line.get(key, ())) for key in ("current", "voltage", "residual"))
        if not current.size or residual.size != current.size:
            return
        order = np.argsort(current)
        current_label = text("Current {pair}", pair=pair)
        row.append(
            Axes(
                current_label,
                "A",
                _VOLTAGE,
                "V",
                (
                    PlotCurve(_READ, current, voltage, CurveStyle.READING),
                    PlotCurve(FITTED, current[order], (voltage - residual)[order], CurveStyle.FIT),
                ),
            )
        )
        left.append(
            Axes(
                current_label,
                "A",
                RESIDUAL,
                "V",
                (PlotCurve(RESIDUAL, current, residual, CurveStyle.READING),),
            )
        )
    yield Plot(
        procedure.name,
        text("Voltage inside the clamps over current, both polarities, and the residual of the straight line"),
        (row, left),
        (1.0, 0.7),
    )


def _sweep(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    sweep = findings.get("sweep", {})
    time, inductance = _array(sweep.get("time", ())), _array(sweep.get("inductance", ()))
    if time.size < 2:
        return
    over_time = Axes(TIME, "s", _LINE, "H", (PlotCurve(_READ, time - time[0], inductance, CurveStyle.READING),))
    angle, fitted = _array(sweep.get("angle", ())), _array(sweep.get("fitted", ()))
    if angle.size != time.size or fitted.size != time.size:
        yield Plot(procedure.name, text("Inductance between two lines while the shaft is turned"), ((over_time,),))
        return
    turn = np.degrees(np.mod(angle, np.pi))
    order = np.argsort(turn)
    over_angle = Axes(
        text("Electrical angle from d, modulo 180°"),
        "°",
        _LINE,
        "H",
        (
            PlotCurve(_READ, turn, inductance, CurveStyle.READING),
            PlotCurve(FITTED, turn[order], fitted[order], CurveStyle.FIT),
        ),
    )
    left = Axes(
        TIME, "s", RESIDUAL, "H", (PlotCurve(RESIDUAL, time - time[0], inductance - fitted, CurveStyle.READING),)
    )
    yield Plot(
        procedure.name,
        text(
            "Inductance between two lines while the shaft is turned: over the fitted angle, and the residual over time"
        ),
        ((over_angle, left),),
    )


_LINE = text("Line inductance")


def _step(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    rows: tuple[list[Axes], list[Axes], list[Axes]] = ([], [], [])
    for axis in ("d", "q"):
        fit = findings.get(axis, {}).get("fit", {})
        time, fitted, residual = (_array(fit.get(key, ())) for key in ("time", "fitted", "residual"))
        if not time.size:
            continue
        label = text("Time, {axis} axis", axis=axis)
        traces = _last_record(procedure, f"3.3.1-{axis}/4")
        voltage, current = (_shown(traces, unit) for unit in ("V", "A"))
        if voltage is not None:
            rows[0].append(Axes(label, "s", _VOLTAGE, "V", (PlotCurve(_RECORDED, *voltage, CurveStyle.RECORD),)))
        recorded = PlotCurve(_RECORDED, *(current or (time, fitted + residual)), CurveStyle.RECORD)
        rows[1].append(Axes(label, "s", CURRENT, "A", (recorded, PlotCurve(FITTED, time, fitted, CurveStyle.FIT))))
        rows[2].append(Axes(label, "s", RESIDUAL, "A", (PlotCurve(RESIDUAL, time, residual, CurveStyle.RESIDUAL),)))
    drawn = [(row, height) for row, height in zip(rows, (0.62, 1.0, 0.62), strict=True) if row]
    if drawn:
        yield Plot(
            procedure.name,
            text("Steps on the d and q axes: recorded voltage, current with the fit to both, and the residual"),
            tuple(row for row, _ in drawn),
            tuple(height for _, height in drawn),
        )
    curves = findings.get("curve", {})
    if curves:
        yield _saturation(procedure.name, curves)


def _shown(traces: Sequence[Trace], unit: str) -> tuple[FloatArray, FloatArray] | None:
    """Return the first trace in a unit, few enough points to draw, or None where there is none."""
    return next((envelope(trace.time, trace.values) for trace in traces if trace.unit == unit), None)


def _saturation(name: str, curves: Mapping[str, Sequence[Mapping[str, float]]]) -> Plot:
    drawn = [
        PlotCurve(
            text("{axis} axis", axis=axis),
            _array([point["current"] for point in points]),
            _array([point["inductance"] for point in points]),
            manner,
        )
        for (axis, points), manner in zip(curves.items(), _PHASES, strict=False)
    ]
    axes = Axes(CURRENT, "A", text("Apparent inductance"), "H", drawn)
    return Plot(f"{name}-saturation", text("Inductance over current, both polarities"), ((axes,),))


def _emf(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    points = [point for point in findings.get("points", ()) if "waveform" in point]
    for number, point in enumerate(points[:1]):
        wave = point["waveform"]
        time = _array(wave["time"])
        recorded, fitted, left = [], [], []
        for channel, manner in enumerate(_PHASES, 1):
            if f"channel_{channel}" not in wave:
                break
            measured, curve = _array(wave[f"channel_{channel}"]), _array(wave[f"fitted_{channel}"])
            name = text("channel {number}", number=channel)
            # The records lie beneath their fits and need no name of their own.
            recorded.append(PlotCurve(Text("_"), time, measured, CurveStyle.RECORD))
            fitted.append(PlotCurve(name, time, curve, manner))
            left.append(PlotCurve(name, time, measured - curve, manner))
        yield Plot(
            f"{procedure.name}-{number}",
            text(
                "Back-EMF at {speed:.0f} rpm: recorded (grey), the fitted harmonics, and the residual",
                speed=point["speed_rpm"],
            ),
            ((Axes(TIME, "s", _VOLTAGE, "V", (*recorded, *fitted)),), (Axes(TIME, "s", RESIDUAL, "V", left),)),
            (1.0, 0.6),
        )
    all_points = findings.get("points", ())
    if len(all_points) > 1:
        speed = _array([p["speed_rpm"] for p in all_points])
        amplitude = _array([p["amplitude"] for p in all_points])
        constant = _array([p["back_emf_constant_mechanical"] for p in all_points])
        yield Plot(
            f"{procedure.name}-speeds",
            text("Amplitude of the phase EMF's fundamental, and its ratio to mechanical speed"),
            (
                (
                    Axes(
                        SPEED,
                        "rpm",
                        text("Amplitude"),
                        "V",
                        (PlotCurve(_READ, speed, amplitude, CurveStyle.READING),),
                        True,
                        True,
                    ),
                    Axes(
                        SPEED,
                        "rpm",
                        text("EMF over speed"),
                        "V·s/rad",
                        (PlotCurve(_READ, speed, constant, CurveStyle.READING),),
                    ),
                ),
            ),
            (0.85,),
        )


def _ramps(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    for key, caption in (
        ("ramps", text("Driven ramp and coast-down with the dynamometer coupled")),
        ("tare_ramps", text("The dynamometer alone: driven ramp and coast-down")),
    ):
        found = findings.get(key, {})
        upper, lower = [], []
        for name, title in (("driven", text("Time, driven")), ("coast", text("Time, coasting"))):
            ramp = found.get(name, {})
            fit = ramp.get("fit", {})
            time, speed = _array(ramp.get("time", ())), _array(ramp.get("speed", ()))
            fit_time, fitted = _array(fit.get("time", ())), _array(fit.get("fitted", ()))
            if not time.size or not fit_time.size:
                break
            upper.append(
                Axes(
                    title,
                    "s",
                    SPEED,
                    "rpm",
                    (
                        PlotCurve(_READ, time, speed / _RPM, CurveStyle.BROAD),
                        PlotCurve(FITTED, fit_time, fitted / _RPM, CurveStyle.SECOND),
                    ),
                )
            )
            # Where a ramp is long, readings and fit are thinned apart: only instants that both have can be compared.
            common, at, of = np.intersect1d(time, fit_time, return_indices=True)
            lower.append(
                Axes(
                    title,
                    "s",
                    RESIDUAL,
                    "rpm",
                    (PlotCurve(RESIDUAL, common, (speed[at] - fitted[of]) / _RPM, CurveStyle.RESIDUAL),),
                )
            )
        if len(upper) == 2:
            yield Plot(f"{procedure.name}-{key}", caption, (upper, lower), (1.0, 0.6))


def _torque(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    current, torque, residual = (_array(findings.get(key, ())) for key in ("currents", "torques", "residuals"))
    if not current.size or residual.size != current.size:
        return
    order = np.argsort(current)
    yield Plot(
        procedure.name,
        text("Shaft torque over the inverter's current, and the residual of the straight line"),
        (
            (
                Axes(
                    CURRENT,
                    "A",
                    text("Torque"),
                    "N·m",
                    (
                        PlotCurve(_READ, current, torque, CurveStyle.READING),
                        PlotCurve(FITTED, current[order], (torque - residual)[order], CurveStyle.FIT),
                    ),
                ),
                Axes(CURRENT, "A", RESIDUAL, "N·m", (PlotCurve(RESIDUAL, current, residual, CurveStyle.READING),)),
            ),
        ),
    )


def _equivalent(procedure: ProcedureRecord, findings: Mapping[str, Any]) -> Iterator[Plot]:
    points = findings.get("points", ())
    # A figure that is not given is not drawn either.
    if len(points) < 2 or any(row["answer"] == "withheld" for row in findings.get("misfit", ())):
        return
    speed = _array([p["speed_rpm"] for p in points])
    parts = []
    for key, name, manner in (
        ("equivalent_resistance", text("equivalent resistance"), CurveStyle.FIT),
        ("copper_resistance", text("copper"), CurveStyle.SECOND),
        ("commutation_resistance", text("commutation (no loss)"), CurveStyle.THIRD),
    ):
        values = [p.get(key) for p in points]
        if all(value is not None for value in values):
            parts.append(PlotCurve(name, speed, _array(values), manner))
    band = findings.get("commutation_over_speed", {}).get("band", ())
    if band:
        at = _array([p["speed_rpm"] for p in band])
        for key, name in (("low", text("commutation, 95 % from")), ("high", text("commutation, 95 % to"))):
            parts.append(PlotCurve(name, at, _array([p[key] for p in band]), CurveStyle.RESIDUAL))
    yield Plot(
        procedure.name,
        text("Equivalent resistance and its parts over speed"),
        ((Axes(SPEED, "rpm", text("Resistance"), "Ω", parts, y_from_zero=True),),),
    )


def _last_record(procedure: ProcedureRecord, identifier: str) -> Sequence[Trace]:
    """Return the traces of the last record taken in a step: the one whose fit stands in the findings."""
    for step in reversed(procedure.steps):
        if step.identifier == identifier and step.traces:
            return step.traces[-1]()
    return ()


_MAKERS: Mapping[str, Callable[[ProcedureRecord, Mapping[str, Any]], Iterator[Plot]]] = {
    "pole-pairs-static": _static,
    "stator-resistance-dc": _dc,
    "dq-inductance-extremes": _sweep,
    "dq-inductance-time-constant": _step,
    "back-emf-constant": _emf,
    "inertia": _ramps,
    "torque-constant": _torque,
    "equivalent-resistance": _equivalent,
    "flux-map": flux_map,
    "flux-map-standstill": flux_map,
    "open-circuit": open_circuit,
    "short-circuit": short_circuit,
    "load-points": load_points,
}
