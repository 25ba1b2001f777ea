"""Options of the live plots."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bench.journal.waveforms import StoredWaveform
from drivers.interfaces.text import Text
from procedures.core.axes import Axes, CurveStyle
from reports.plots.envelope import extremes
from reports.tables.figures import Scale, scale_of

#: Points that a plot of a screen's width shows.
POINTS = 3000
#: Those of a small plot beside others.
_FIT_POINTS = 400
#: A legend's row and the mark of an entry, a letter at most, and the room of the smallest plot (px).
_LEGEND_ROW, _LEGEND_ENTRY, _LETTER, _LEGEND_WIDTH = 20, 50.0, 6.2, 330.0
#: Colour, kind and width of a curve: told apart by more than the colour.
_LINES: Mapping[CurveStyle, tuple[str, str, float]] = {
    CurveStyle.READING: ("#17202a", "solid", 0.0),
    CurveStyle.TO_COME: ("#9aa5b1", "solid", 0.0),
    CurveStyle.RECORD: ("#b4bec8", "solid", 4.0),
    CurveStyle.BROAD: ("#b4bec8", "solid", 4.0),
    CurveStyle.FIT: ("#0b4fa0", "solid", 2.0),
    CurveStyle.SECOND: ("#855c00", "dashed", 2.0),
    CurveStyle.THIRD: ("#1b6e3c", "dotted", 2.5),
    CurveStyle.RESIDUAL: ("#45525f", "solid", 1.0),
    CurveStyle.BARS: ("#0b4fa0", "solid", 1.0),
}
#: Curves that are marks, not lines.
_MARKS = (CurveStyle.READING, CurveStyle.TO_COME)
#: Curves that are drawn over the readings that they are fitted to.
_OVER = (CurveStyle.FIT, CurveStyle.SECOND, CurveStyle.THIRD)
_COLOURS = ("#1565c0", "#b3261e", "#0b6b3a", "#7b1fa2")
_GRID = {"left": 70, "right": 24, "top": 36, "bottom": 48}
#: Numbers as the rest of the page has them: no commas between thousands, and a minus. A formatter of the browser's, for the
#: library has none of its own for the numbers of axes and tooltips.
_NUMBER = "(value) => typeof value === 'number' ? String(Number(value.toPrecision(10))).replace('-', '−') : value"
_NUMBERS = f"(values) => [values].flat().map({_NUMBER}).join(', ')"
#: What every plot has: the page's letters, and its numbers.
_COMMON: Mapping[str, Any] = {
    "animation": False,
    "textStyle": {"fontFamily": "'Noto Sans', 'Noto Sans SC', 'Noto Sans CJK SC', sans-serif"},
}
_TOOLTIP: Mapping[str, Any] = {
    ":valueFormatter": _NUMBERS,
    "axisPointer": {"label": {":formatter": f"(pointer) => ({_NUMBER})(pointer.value)"}},
}


def number_labels(**more: Any) -> dict[str, Any]:
    """Return the labels of an axis of numbers, with further options of the library."""
    return {":formatter": _NUMBER, **more}


def tooltip(**more: Any) -> dict[str, Any]:
    """Return the tooltips of a plot, with further options of the library."""
    return {**_TOOLTIP, **more}


def axes(title: str, x: str, y: str) -> dict[str, Any]:
    """Return a plot with axes and no data; `x` and `y` name quantity and unit."""
    axis = {"type": "value", "scale": True, "nameLocation": "middle", "axisLabel": number_labels()}
    return {
        **_COMMON,
        "title": {"text": title, "left": "center", "textStyle": {"fontSize": 14}},
        "grid": dict(_GRID),
        "tooltip": tooltip(trigger="axis"),
        "xAxis": {**axis, "name": x, "nameGap": 28, "axisLabel": number_labels(hideOverlap=True)},
        "yAxis": {**axis, "name": y, "nameGap": 52},
        "series": [],
        "color": list(_COLOURS),
        # What the library would say by itself is English.
        "aria": {"enabled": True, "label": {"description": ", ".join(filter(None, (title, y, x)))}},
    }


def line(name: str, points: Sequence[Sequence[float]], *, marks: bool = False) -> dict[str, Any]:
    """Return one line of a plot."""
    return {
        "type": "line",
        "name": name,
        "showSymbol": marks,
        "symbolSize": 4,
        "lineStyle": {"width": 1.5},
        "data": list(points),
    }


def thinned(times: ArrayLike, values: ArrayLike, points: int = POINTS) -> list[list[float]]:
    """Return the pairs to draw of readings over time (s)."""
    drawn = np.asarray(values, dtype=np.float64)
    chosen = extremes(drawn, points)
    when = np.asarray(times, dtype=np.float64)
    return [[float(f"{x:.9g}"), float(f"{y:.6g}")] for x, y in zip(when[chosen], drawn[chosen], strict=True)]


def waveform_plot(
    waves: Mapping[str, StoredWaveform], *, start: float | None = None, end: float | None = None
) -> dict[str, Any]:
    """Return a plot of waveforms between two times (s), all of them without; zooming asks for it anew with its window."""
    units = list(dict.fromkeys(wave.unit for wave in waves.values()))
    plot = axes("", "t / s", units[0] if units else "")
    # Volts left, amperes right: one axis each.
    plot["yAxis"] = [
        {**plot["yAxis"], "name": unit, "position": "right" if n else "left"} for n, unit in enumerate(units)
    ]
    plot["legend"] = {"top": 22, "data": list(waves)}
    plot["grid"] |= {"top": 56, "bottom": 96, "right": 70}
    plot["dataZoom"] = [
        {"type": "inside", "filterMode": "none"},
        {"type": "slider", "filterMode": "none", "bottom": 12},
    ]
    for name, wave in waves.items():
        first = 0 if start is None else int(np.searchsorted(wave.time, start))
        last = len(wave.time) if end is None else int(np.searchsorted(wave.time, end, side="right"))
        # One sample beyond either edge: the line reaches the edge of the window.
        window = slice(max(first - 1, 0), min(last + 1, len(wave.time)))
        drawn = line(name, thinned(wave.time[window], wave.values[window]))
        plot["series"].append({**drawn, "yAxisIndex": units.index(wave.unit)})
    if waves:
        whole = next(iter(waves.values())).time
        plot["xAxis"] |= {
            "min": float(whole[0]),
            "max": float(whole[-1]),
            # The record's own ends are no round figures.
            "axisLabel": number_labels(showMinLabel=False, showMaxLabel=False),
        }
    return plot


def labelled(axes: Axes, say: Callable[[Text], str]) -> dict[str, Any]:
    """Return what a plot draws of a pair of axes, in the units of people: labels `x` and `y`, `curves` of name, x, y, manner; `factors`
    of x and y are what was divided by.
    """
    x_scale, y_scale = (
        _scale(max((float(np.nanmax(np.abs(part))) for part in parts if np.size(part)), default=0.0), unit)
        for parts, unit in (
            ([curve.x for curve in axes.curves], axes.x_unit),
            ([curve.y for curve in axes.curves], axes.y_unit),
        )
    )
    return {
        "x": f"{say(axes.x_label)} / {x_scale.unit}" if x_scale.unit else say(axes.x_label),
        "y": f"{say(axes.y_label)} / {y_scale.unit}" if y_scale.unit else say(axes.y_label),
        "factors": (x_scale.factor, y_scale.factor),
        "from_zero": (axes.x_from_zero, axes.y_from_zero),
        "curves": [
            (
                say(curve.name) if not str(curve.name).startswith("_") else "",
                np.asarray(curve.x, dtype=np.float64) / x_scale.factor,
                np.asarray(curve.y, dtype=np.float64) / y_scale.factor,
                curve.manner,
            )
            for curve in axes.curves
        ],
    }


def _scale(largest: float, unit: str) -> Scale:
    """Return the scale of an axis; times below a second are in milliseconds."""
    return Scale(1e-3, "ms") if unit == "s" and 0.0 < largest < 1.0 else scale_of(largest, unit)


def fit_plot(upper: Mapping[str, Any], left: Mapping[str, Any] | None = None) -> dict[str, Any]:
    """Return a plot of axes as `labelled` gives them, with what the fit leaves, or other axes, below."""
    parts = (upper,) if left is None else (upper, left)
    # Residuals are over what the fit is over, and share its labels.
    shared = left is not None and left["x"] == upper["x"]
    low = {"top": "68%", "height": "16%"} if shared else {"top": "72%", "height": "13%"}
    names = dict.fromkeys(name for name, *_ in upper["curves"] if name)
    boxes: list[dict[str, Any]] = [{"top": 34 + _LEGEND_ROW * (_legend_rows(list(names)) - 1), "bottom": 46}]
    if left is not None:
        boxes = [{"top": 34, "height": "46%" if shared else "42%"}, low]
    drawn: dict[str, Any] = {
        **_COMMON,
        "tooltip": tooltip(trigger="axis"),
        # What the library would say by itself is English.
        "aria": {
            "enabled": True,
            "label": {"description": ", ".join(dict.fromkeys(part[axis] for axis in ("y", "x") for part in parts))},
        },
        "legend": {"top": 2, "right": 8, "itemWidth": 34, "data": _entries(upper) if len(names) > 1 else []},
        "grid": [{"left": 72, "right": 18, "outerBoundsMode": "none", **box} for box in boxes],
        "xAxis": [],
        "yAxis": [],
        "series": [],
    }
    for index, part in enumerate(parts):
        axis = {"type": "value", "nameLocation": "middle", "gridIndex": index, "axisLine": {"onZero": False}}
        axis["axisLabel"] = number_labels()
        lowest = index == len(parts) - 1
        from_zero = part["from_zero"]
        x_axis = {**axis, "scale": not from_zero[0], "name": "" if shared and not lowest else part["x"], "nameGap": 26}
        if shared:
            # What the fit leaves stands below what it was fitted to.
            x_axis |= {"min": _least(upper) if from_zero[0] else "dataMin", "max": "dataMax"}
        ends = {"showMinLabel": from_zero[0] or not shared, "showMaxLabel": not shared}
        label = number_labels(show=lowest or not shared, hideOverlap=True, **ends)
        drawn["xAxis"].append({**x_axis, "axisLabel": label})
        y_axis = {**axis, "scale": not from_zero[1], "name": part["y"], "nameGap": 52}
        drawn["yAxis"].append({**y_axis, "splitNumber": 2 if index else 4})
        drawn["series"] += [
            {**_series(name, x, y, manner), "xAxisIndex": index, "yAxisIndex": index}
            for name, x, y, manner in part["curves"]
        ]
    return drawn


def _entries(part: Mapping[str, Any]) -> list[dict[str, Any]]:
    """Return the legend's entries of the curves that have names: a line without marks has none there either."""
    marks = {name: manner in _MARKS for name, _, _, manner in part["curves"] if name}
    return [{"name": name, **({} if marked else {"itemStyle": {"opacity": 0}})} for name, marked in marks.items()]


def _least(axes: Mapping[str, Any]) -> float:
    """Return the least of all x and 0."""
    return min([0.0, *(float(np.min(x)) for _, x, *_ in axes["curves"] if np.size(x))])


def _legend_rows(names: Sequence[str]) -> int:
    """Return how many rows a legend of these names takes in the smallest plot, at least one."""
    rows, used = 1, 0.0
    for name in names:
        width = _LEGEND_ENTRY + sum(_LETTER if letter < "\u2e80" else 2.0 * _LETTER for letter in name)
        if used and used + width > _LEGEND_WIDTH:
            rows, used = rows + 1, 0.0
        used += width
    return rows


def _series(name: str, x: ArrayLike, y: ArrayLike, manner: CurveStyle) -> dict[str, Any]:
    colour, kind, width = _LINES[manner]
    points = thinned(x, y, _FIT_POINTS)
    marks = manner in _MARKS
    series = line(name, points, marks=marks)
    series |= {"lineStyle": {"width": width, "type": kind, "color": colour}, "itemStyle": {"color": colour}}
    if not marks:
        # A fit is seen also where its readings lie close.
        series |= {"symbol": "none", "z": 3 if manner in _OVER else 2}
    elif manner is CurveStyle.READING:
        # What was read is filled, what is to come a ring.
        series |= {"symbol": "circle", "symbolSize": 5}
    if manner is CurveStyle.BARS:
        series |= {"type": "bar", "barWidth": 18}
    return series
