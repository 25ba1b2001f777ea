"""Options of the live plots."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from bench.journal.waveforms import StoredWaveform
from bench.panel.decimate import envelope
from reports.plots.model import Manner

#: Points that a plot of a screen's width shows.
POINTS = 3000
#: Those of a small plot beside others.
_FIT_POINTS = 400
_COLOURS = ("#1565c0", "#b3261e", "#0b6b3a", "#7b1fa2")
_GRID = {"left": 70, "right": 24, "top": 36, "bottom": 48}


def axes(title: str, x: str, y: str) -> dict[str, Any]:
    """Return a plot with axes and no data; `x` and `y` name quantity and unit."""
    axis = {"type": "value", "scale": True, "nameLocation": "middle"}
    return {
        "animation": False,
        "title": {"text": title, "left": "center", "textStyle": {"fontSize": 14}},
        "grid": dict(_GRID),
        "tooltip": {"trigger": "axis"},
        "xAxis": {**axis, "name": x, "nameGap": 28},
        "yAxis": {**axis, "name": y, "nameGap": 52},
        "series": [],
        "color": list(_COLOURS),
        "aria": {"enabled": True},
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
    chosen = envelope(drawn, points)
    when = np.asarray(times, dtype=np.float64)
    pairs: list[list[float]] = np.column_stack((when[chosen], drawn[chosen])).tolist()
    return pairs


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
            "axisLabel": {"showMinLabel": False, "showMaxLabel": False},
        }
    return plot


def fit_plot(upper: Mapping[str, Any], left: Mapping[str, Any]) -> dict[str, Any]:
    """Return a fit with what it leaves below, on one x axis; each holds labels `x` and `y` and `curves` of name, x, y, manner."""
    axis = {"type": "value", "scale": True, "nameLocation": "middle"}
    drawn: dict[str, Any] = {
        "animation": False,
        "tooltip": {"trigger": "axis"},
        "color": list(_COLOURS),
        "aria": {"enabled": True},
        "grid": [
            {"left": 64, "right": 12, "top": 12, "height": "46%"},
            {"left": 64, "right": 12, "top": "66%", "height": "18%"},
        ],
        "xAxis": [
            {**axis, "gridIndex": 0, "axisLabel": {"show": left["x"] != upper["x"]}},
            {**axis, "gridIndex": 1, "name": left["x"], "nameGap": 26},
        ],
        "yAxis": [
            {**axis, "gridIndex": 0, "name": upper["y"], "nameGap": 46},
            {**axis, "gridIndex": 1, "name": left["y"], "nameGap": 46, "splitNumber": 2},
        ],
        "series": [],
    }
    for index, part in enumerate((upper, left)):
        for name, x, y, manner in part["curves"]:
            lone = manner is Manner.READING
            series = line(name, thinned(x, y, _FIT_POINTS), marks=lone)
            series |= {"xAxisIndex": index, "yAxisIndex": index}
            if lone:
                series["lineStyle"] = {"width": 0}
            elif manner in (Manner.RECORD, Manner.BROAD):
                series |= {"lineStyle": {"width": 4, "color": "#c5cdd5"}, "itemStyle": {"color": "#c5cdd5"}}
            drawn["series"].append(series)
    return drawn
