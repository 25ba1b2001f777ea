"""Deviations of a record from its model, beside the plots: causes in the captions, and the residuals where they are visible."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from drivers.interfaces.text import Text, text, word
from procedures.core.axes import Axes, CurveStyle, PlotCurve
from reports.plots.model import Plot

TIME, CURRENT, SPEED = text("Time"), text("Current"), text("Speed")
FITTED, RESIDUAL = text("fit"), text("residual")
_RECORDED = text("recorded")
#: How a figure's answer to a cause is named beside a plot.
_ANSWERS = {"withheld": text("withheld"), "widened": text("widened"), "modelled": text("modelled")}
#: Columns over which a fit may be drawn, with what they are called and their units.
_OVER = {"time": (TIME, "s"), "current": (CURRENT, "A"), "angle": (text("Angle"), "rad"), "speed": (SPEED, "rad/s")}


def causes(findings: Mapping[str, Any]) -> list[tuple[str, Text]]:
    """Return the causes that a procedure's findings name, by their short names, each once with what was done about it."""
    named = dict.fromkeys((row["cause"], row["answer"]) for row in findings.get("misfit", ()))
    return [(cause, _ANSWERS.get(answer, Text("{a}", {"a": answer}))) for cause, answer in named]


def told(plot: Plot, findings: Mapping[str, Any]) -> Plot:
    """Return a plot that shows a residual with the causes in its caption; any other as it is."""
    found = [text("{cause} ({answer})", cause=word(cause), answer=answer) for cause, answer in causes(findings)]
    if not found or not any(is_residual(axes) for row in plot.rows for axes in row):
        return plot
    caption = text("{caption}. The residual shows: {causes}", caption=plot.caption, causes=found)
    return replace(plot, caption=caption)


def is_residual(axes: Axes) -> bool:
    """Tell whether a pair of axes shows what a fit leaves."""
    return axes.y_label == RESIDUAL


def fits(name: str, findings: Mapping[str, Any]) -> Iterator[Plot]:
    """Give a plot of every fit that stands in a procedure's findings: `fitted` and `residual` over time, current, angle or speed,
    in the `unit` that stands beside them.
    """
    for key, columns in findings.items():
        if not isinstance(columns, Mapping):
            continue
        over = next((each for each in _OVER if each in columns), "")
        x, fitted, residual = (_array(columns.get(each)) for each in (over, "fitted", "residual"))
        if not x.size or not x.size == fitted.size == residual.size:
            continue
        (label, x_unit), unit = _OVER[over], str(columns.get("unit", ""))
        record = PlotCurve(_RECORDED, x, fitted + residual, CurveStyle.READING)
        upper = Axes(label, x_unit, text("Reading"), unit, (record, PlotCurve(FITTED, x, fitted, CurveStyle.FIT)))
        left = Axes(label, x_unit, RESIDUAL, unit, (PlotCurve(RESIDUAL, x, residual, CurveStyle.RESIDUAL),))
        yield Plot(f"{name}-{key}", text("Readings, their fit, and the residual"), ((upper,), (left,)), (1.0, 0.6))


def _array(values: object) -> np.ndarray[Any, np.dtype[np.float64]]:
    if not isinstance(values, Sequence) or isinstance(values, str):
        return np.zeros(0)
    return np.asarray(values, dtype=np.float64)
