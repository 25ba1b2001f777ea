"""Plots of a flux map while it is measured: the currents read, those planned, and the map as it grows."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from drivers.interfaces.text import Text, text
from procedures.core.axes import Axes, CurveStyle, FloatArray, PlotCurve
from procedures.core.contours import contours
from procedures.core.live_plot import LivePlot
from procedures.estimation.flux.first_look import FirstLook, first_look
from procedures.estimation.flux.plan import PlannedReading
from procedures.estimation.flux.stroke_train import StrokeTrain
from procedures.techniques.maps.readings import MapReadings

_D, _Q = text("d-axis current"), text("q-axis current")
_UNNAMED = Text("_")
#: Lines of equal size are drawn at so many steps from the least to the largest.
_STEPS = 6
#: Shorter times (s) are told in seconds.
_SECONDS = 90.0


def map_plot(planned: Sequence[PlannedReading], taken: MapReadings, pole_pairs: float, left: float) -> LivePlot:
    """Return the plane of currents (A): those read and those to come, with lines of equal flux linkage and torque as the readings so far
    tell them; `left` (s) is the time that it will take yet.
    """
    done = len(taken.points) + len(taken.limited)
    messages: list[Text] = [
        text(
            "{done} of {planned} readings, about {left} left",
            done=done,
            planned=len(planned),
            left=text("{seconds:.0f} s", seconds=left)
            if left < _SECONDS
            else text("{minutes:.0f} min", minutes=left / 60.0),
        )
    ]
    read, to_come = taken.planned, np.array([(one.i_d, one.i_q) for one in planned[done:]]).reshape(-1, 2)
    largest = max(math.hypot(one.i_d, one.i_q) for one in planned)
    angle = np.linspace(0.0, 2.0 * math.pi, 121)
    curves = [
        PlotCurve(text("read"), read[:, 0], read[:, 1], CurveStyle.READING),
        PlotCurve(text("largest current"), largest * np.cos(angle), largest * np.sin(angle), CurveStyle.RECORD),
        PlotCurve(text("to come"), to_come[:, 0], to_come[:, 1], CurveStyle.TO_COME),
    ]
    seen = _seen(taken, largest)
    if seen is not None:
        flux, torque = np.hypot(seen.psi_d, seen.psi_q), seen.torque(pole_pairs)
        curves += _equal(text("equal flux linkage"), seen, flux, CurveStyle.FIT)
        curves += _equal(text("equal torque"), seen, torque, CurveStyle.SECOND)
        messages.append(
            text(
                "A first look, within the currents read: flux linkage {low} … {high} V·s, torque up to {torque} N·m",
                low=f"{np.nanmin(flux):.3g}",
                high=f"{np.nanmax(flux):.3g}",
                torque=f"{np.nanmax(np.abs(torque)):.3g}",
            )
        )
    return LivePlot(text("Currents of the flux map"), Axes(_D, "A", _Q, "A", curves), None, messages)


def _seen(taken: MapReadings, largest: float) -> FirstLook | None:
    """Return the map as far as the readings tell it; None before that."""
    if not taken.points:
        return None
    current = taken.column("d_current") + 1j * taken.column("q_current")
    voltage = taken.column("d_voltage") + 1j * taken.column("q_voltage")
    return first_look(current, voltage, taken.column("electrical_speed"), largest)


def _equal(name: Text, seen: FirstLook, values: FloatArray, manner: CurveStyle) -> Iterator[PlotCurve]:
    """Give the lines of equal value, named once."""
    if not np.isfinite(values).any():
        return
    for level in np.linspace(np.nanmin(values), np.nanmax(values), _STEPS + 2)[1:-1]:
        for x, y in contours(seen.i_d, seen.i_q, values, float(level)):
            yield PlotCurve(name, x, y, manner)
            name = _UNNAMED


def stroke_plot(locations: Sequence[complex], taken: Sequence[StrokeTrain], left: int) -> LivePlot:
    """Return the plane of currents (A) of a map at standstill: those that were read; `left` locations are yet to come."""
    messages: list[Text] = [text("{left} of {planned} locations left", left=left, planned=len(locations))]
    read = np.array([one.current[k] for one in taken for k in (1, 2)], dtype=np.complex128)
    largest = max(map(abs, locations))
    angle = np.linspace(0.0, 2.0 * math.pi, 121)
    curves = (
        PlotCurve(text("largest current"), largest * np.cos(angle), largest * np.sin(angle), CurveStyle.SECOND),
        PlotCurve(text("read"), read.real, read.imag, CurveStyle.READING),
    )
    return LivePlot(text("Currents of the flux map"), Axes(_D, "A", _Q, "A", curves), None, messages)
