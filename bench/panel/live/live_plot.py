"""A page's drawing and text of a plot that a run shows, with the readings that have come since."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bench.panel.live.live_view import Readings
from bench.panel.plots import fit_plot, labelled
from drivers.interfaces.text import Text, text
from procedures.core.axes import CurveStyle, PlotCurve
from procedures.core.live_plot import ComingReadings, LivePlot

#: An axis ends so much beyond where the readings are to get.
_ROOM = 1.05
#: So many readings are marks; more are a line, which costs the browser less.
_MARKED = 150
_COMING = text("readings")
_GOAL = "#8a5a00"

#: Readings by instrument and quantity.
AllReadings = Mapping[tuple[str, str], Readings]


def with_readings(plot: LivePlot, readings: AllReadings) -> LivePlot:
    """Return the plot with what has been read for it since it was announced, as its first curve."""
    if plot.coming is None:
        return plot
    curve = points_of(plot.coming, readings)
    return replace(plot, upper=replace(plot.upper, curves=(curve, *plot.upper.curves)))


def points_of(coming: ComingReadings, readings: AllReadings) -> PlotCurve:
    """Return the points that the readings are, in the axes' units; none before the first reading."""
    kept = readings.get((coming.instrument, coming.quantity))
    times = np.array(kept.times if kept else (), dtype=np.float64)
    values = np.array(kept.values if kept else (), dtype=np.float64)
    here = times >= coming.since
    x, y = coming.rate * (times[here] - coming.since), values[here] / coming.scale
    return PlotCurve(_COMING, x, y, CurveStyle.READING if x.size <= _MARKED else CurveStyle.RECORD)


def options_of(plot: LivePlot, say: Callable[[Text], str], *, small: bool = False) -> dict[str, Any]:
    """Return the options of the chart of a plot that has its readings; a `small` one names neither curves nor quantities."""
    upper = labelled(plot.upper, say)
    options = fit_plot(upper, labelled(plot.lower, say) if plot.lower else None)
    if small:
        options["legend"]["show"] = False
        for grid in options["grid"]:
            grid |= {"left": 62, "right": 10}
        # In pixels below, where the numbers and the label stand: a share of so little is less than they take.
        options["grid"][-1] |= {"bottom": 42, "height": "auto" if plot.lower is None else "14%"}
        options["grid"][-1].pop("top", None)
        options["grid"][0] |= {"top": 10} if plot.lower is None else {"top": 10, "height": "40%"}
        for axis in options["yAxis"]:
            axis["name"] = axis["name"].rpartition(" / ")[2]
    coming = plot.coming
    if coming is None:
        return options
    x_factor, y_factor = upper["factors"]
    marks = []
    if coming.until_x is not None:
        goal = coming.until_x / x_factor
        marks.append({"xAxis": _short(goal)})
        options["xAxis"][0]["axisLabel"]["showMaxLabel"] = False
        options["xAxis"][0]["max"] = _short(_ROOM * max(goal, _largest(upper["curves"], 1)))
    if coming.until_y is not None:
        goal = coming.until_y / y_factor
        marks.append({"yAxis": _short(goal)})
        options["yAxis"][0]["axisLabel"]["showMaxLabel"] = False
        options["yAxis"][0]["max"] = _short(_ROOM * max(goal, _largest(upper["curves"], 2)))
    if options["series"] and marks:
        line = {"color": _GOAL, "type": "dashed", "width": 2}
        label = {"formatter": say(text("end")), "color": _GOAL, "position": "insideEndTop"}
        options["series"][0]["markLine"] = {
            "symbol": ["none", "none"],
            "silent": True,
            "animation": False,
            # The library would round where the line is to two decimals.
            "precision": -1,
            "lineStyle": line,
            "label": label,
            "data": marks,
        }
    return options


def to_go(plot: LivePlot) -> Text | None:
    """Return where a hand should be now and is to get, of a plot that has its readings; None where no hand makes it, or it is there."""
    coming = plot.coming
    if coming is None or coming.until_x is None:
        return None
    x = plot.upper.curves[0].x
    here, unit = float(x[-1]) if x.size else 0.0, plot.upper.x_unit
    if here > coming.until_x - 0.5:
        return None
    return text("Now at {here}: turn on to {end}", here=f"{here:.0f}{unit}", end=f"{coming.until_x:.0f}{unit}")


def _largest(curves: Sequence[Sequence[Any]], place: int) -> float:
    return max((float(np.max(curve[place])) for curve in curves if len(curve[place])), default=0.0)


def _short(value: float) -> float:
    return float(f"{value:.4g}")
