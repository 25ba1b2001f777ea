"""A live plot as it goes over a run's line: few enough points to draw, digits to be seen, sentences for any language."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from bench.journal.stored_result import restore_text, store_text
from procedures.core.axes import Axes, CurveStyle, FloatArray, PlotCurve
from procedures.core.live_plot import ComingReadings, Gauge, LivePlot
from reports.plots.envelope import envelope

#: Points of a curve, and significant digits of a number: more than a screen shows.
_POINTS, _DIGITS = 400, 6


def store_plot(plot: LivePlot) -> dict[str, Any]:
    """Return a plot in JSON's types; long records by the least and the largest of each stretch."""
    return {
        "title": store_text(plot.title),
        "upper": _store_axes(plot.upper),
        "lower": _store_axes(plot.lower) if plot.lower else None,
        "said": [store_text(sentence) for sentence in plot.said],
        "coming": vars(plot.coming) if plot.coming else None,
        "gauge": {**vars(plot.gauge), "quantity": store_text(plot.gauge.quantity)} if plot.gauge else None,
    }


def restore_plot(data: Mapping[str, Any]) -> LivePlot:
    """Return the plot that `store_plot` took apart."""
    gauge = data["gauge"]
    return LivePlot(
        restore_text(data["title"]),
        _restore_axes(data["upper"]),
        _restore_axes(data["lower"]) if data["lower"] else None,
        tuple(restore_text(sentence) for sentence in data["said"]),
        ComingReadings(**data["coming"]) if data["coming"] else None,
        Gauge(**{**gauge, "quantity": restore_text(gauge["quantity"])}) if gauge else None,
    )


def _store_axes(axes: Axes) -> dict[str, Any]:
    return {
        **vars(axes),
        "x_label": store_text(axes.x_label),
        "y_label": store_text(axes.y_label),
        "curves": [_store_curve(curve) for curve in axes.curves],
    }


def _store_curve(curve: PlotCurve) -> dict[str, Any]:
    drawn = np.isfinite(curve.x) & np.isfinite(curve.y)
    x, y = envelope(curve.x[drawn], curve.y[drawn], _POINTS)
    return {"name": store_text(curve.name), "manner": curve.manner.value, "x": _rounded(x), "y": _rounded(y)}


def _rounded(values: FloatArray) -> list[float]:
    return [float(f"{value:.{_DIGITS}g}") for value in values]


def _restore_axes(data: Mapping[str, Any]) -> Axes:
    curves = tuple(
        PlotCurve(restore_text(each["name"]), np.array(each["x"]), np.array(each["y"]), CurveStyle(each["manner"]))
        for each in data["curves"]
    )
    words = {name: restore_text(data[name]) for name in ("x_label", "y_label")}
    return Axes(**{**data, **words, "curves": curves})
