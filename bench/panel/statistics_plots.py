"""Options of the plots that show a line's statistics."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

from bench.eol.statistics.control_chart import Chart
from bench.eol.statistics.proportion import pareto
from bench.eol.statistics_messages import outside, rule_words, scale_for, trimmed
from bench.panel.line_records import Bar
from bench.panel.plots import axes, line, number_labels, tooltip
from drivers.interfaces.text import Text, Translate, text
from reports.labels import ParameterLabels
from reports.tables.figures import decimals_for, figure

if TYPE_CHECKING:
    from bench.eol.line_statistics import Golden, ParameterStatistics
    from bench.eol.store.tallies import Failures

_BLUE, _RED, _GREY = "#1565c0", "#b3261e", "#44505c"
_LIMITS = (text("Lower limit"), text("Upper limit"))
#: The ends of an axis that its data set are no round numbers.
_INNER = number_labels(showMinLabel=False, showMaxLabel=False)
#: Bars of a Pareto chart; the table beside it has the rest.
BARS = 10


def pareto_plot(failures: Sequence["Failures"], labels: ParameterLabels, translate: Translate) -> dict[str, Any]:
    """Return bars of failed motors by parameter, the worst first, and the line of their cumulative share."""
    failed = [each for each in failures if each.failed]
    shares = pareto([each.failed for each in failed])[:BARS]
    names = [labels[each.name].render(translate) for each in failed[:BARS]]
    title = text("Failures by parameter, and their cumulative share").render(translate)
    plot = _described(axes("", "", text("Failed").render(translate)), title)
    plot["grid"] |= {"top": 36, "right": 70, "bottom": 60}
    plot["xAxis"] = {
        "type": "category",
        "data": names,
        "axisLabel": {"interval": 0, "width": 110, "overflow": "break", "hideOverlap": False},
    }
    counts = {**plot["yAxis"], "scale": False, "minInterval": 1}
    share = text("Cumulative, %").render(translate)
    plot["yAxis"] = [
        counts,
        {**plot["yAxis"], "name": share, "scale": False, "min": 0, "max": 100, "splitLine": {"show": False}},
    ]
    bars = {"type": "bar", "name": counts["name"], "barMaxWidth": 60, "data": [e.failed for e in failed[:BARS]]}
    rising = line(share, [], marks=True) | {"data": [round(100.0 * each.cumulative, 1) for each in shares]}
    plot["series"] = [
        {**bars, "itemStyle": {"color": _BLUE}, "label": {"show": True, "position": "top"}},
        {**rising, "yAxisIndex": 1, "itemStyle": {"color": _RED}},
    ]
    return plot


def histogram_plot(each: "ParameterStatistics", label: Text, translate: Translate) -> dict[str, Any]:
    """Return the histogram of a parameter with its limits and its mean."""
    found, scale = each.distribution, scale_for(each)
    histogram = trimmed(found.histogram)
    name = label.render(translate)
    plot = _described(
        axes("", _with_unit(name, scale.unit), text("Motors").render(translate)),
        text("Histogram of {parameter} with its limits", parameter=name).render(translate),
    )
    edges = [edge / scale.factor for edge in histogram.edges]
    digits = decimals_for(edges[1] - edges[0], 0.0)
    limits = [side / scale.factor for side in (found.limits.low, found.limits.high)]
    shown = [edges[0], edges[-1], *(side for side in limits if math.isfinite(side))]
    room = 0.06 * (max(shown) - min(shown))
    plot["xAxis"] |= {
        "min": round(min(shown) - room, digits),
        "max": round(max(shown) + room, digits),
        "axisLabel": dict(_INNER),
        "splitLine": {"show": False},
    }
    plot["yAxis"] |= {"scale": False, "minInterval": 1}
    beyond = outside(histogram, found.limits.low, found.limits.high)
    bars = [
        {
            "value": [0.5 * (low + high), count],
            "itemStyle": {"color": _RED if out else _BLUE},
            "tooltip": {"formatter": f"{figure(low, digits)} … {figure(high, digits)}: {count}"},
        }
        for low, high, count, out in zip(edges[:-1], edges[1:], histogram.counts, beyond, strict=True)
    ]
    marks = [
        _mark("xAxis", side, words.render(translate), _RED, solid=True)
        for side, words in zip(limits, _LIMITS, strict=True)
        if math.isfinite(side)
    ]
    marks.append(_mark("xAxis", found.mean / scale.factor, text("Mean").render(translate), _GREY, solid=False))
    plot["series"] = [{"type": "bar", "barWidth": "96%", "data": bars, "markLine": _lines(marks)}]
    return plot


def histogram_bars(each: "ParameterStatistics") -> list[tuple[str, Bar]]:
    """Return the histogram's bars in words, and which motors each stands for; the outermost have no bound."""
    scale, histogram = scale_for(each), trimmed(each.distribution.histogram)
    edges = histogram.edges
    digits = decimals_for((edges[1] - edges[0]) / scale.factor, 0.0)
    bars = []
    for number, (low, high, count) in enumerate(zip(edges[:-1], edges[1:], histogram.counts, strict=True)):
        words = f"{figure(low / scale.factor, digits)} … {figure(high / scale.factor, digits)} {scale.unit}: {count}"
        first, last = number == 0, number == len(histogram.counts) - 1
        bounds = Bar("", each.distribution.parameter, None if first else low, None if last else high)
        bars.append((words, bounds))
    return bars


def control_plot(each: "ParameterStatistics", label: Text, translate: Translate) -> dict[str, Any]:
    """Return the control chart of a parameter's latest motors; the points that break rules are marked."""
    chart, scale = each.chart, scale_for(each)
    name = label.render(translate)
    plot = _described(
        axes("", text("Serial number").render(translate), _with_unit(name, scale.unit)),
        text("Control chart of {parameter}: centre, control limits, points that break rules", parameter=name).render(
            translate
        ),
    )
    plot["grid"] |= {"left": 84, "right": 130, "bottom": 60}
    plot["xAxis"] = {**plot["xAxis"], "type": "category", "data": list(each.serial_numbers), "nameGap": 32}
    plot["yAxis"]["nameGap"] = 64
    values = [float(f"{value / scale.factor:.6g}") for value in each.values]
    course = line(name, [], marks=True) | {
        "showAllSymbol": True,
        "data": values,
        "itemStyle": {"color": _BLUE},
    }
    plot["series"] = [course]
    if chart is None:
        return plot
    digits = decimals_for(chart.sigma / scale.factor, chart.centre / scale.factor)
    sides = [(text("Centre"), chart.centre, _GREY, True)]
    sides += [(Text("UCL"), chart.high, _RED, False), (Text("LCL"), chart.low, _RED, False)]
    marks = [
        _mark(
            "yAxis",
            value / scale.factor,
            f"{words.render(translate)} {figure(value / scale.factor, digits)}",
            colour,
            solid=solid,
        )
        for words, value, colour, solid in sides
        if math.isfinite(value)
    ]
    plot["series"][0]["markLine"] = _lines(marks)
    # The limits stay in sight also where all points are near the centre.
    reach = [*values, *(side / scale.factor for side in (chart.low, chart.high) if math.isfinite(side))]
    room = 0.08 * (max(reach) - min(reach)) or 1.0
    plot["yAxis"] |= {
        "min": round(min(reach) - room, digits),
        "max": round(max(reach) + room, digits),
        "axisLabel": dict(_INNER),
    }
    broken: dict[int, list[int]] = {}
    for signal in chart.signals:
        broken.setdefault(signal.index, []).append(signal.rule)
    points = [
        {
            "name": each.serial_numbers[index],
            "value": [index, values[index]],
            "tooltip": {"formatter": "{b}: " + figure(values[index], digits) + "\n" + _rules(rules, chart, translate)},
        }
        for index, rules in broken.items()
    ]
    marked = {"type": "scatter", "symbol": "diamond", "symbolSize": 13, "itemStyle": {"color": _RED}, "z": 5}
    plot["series"].append({**marked, "name": text("breaks a rule").render(translate), "data": points})
    return plot


def golden_names(each: "ParameterStatistics") -> dict[str, "Golden"]:
    """Return golden motors' figures by what tells them apart: the serial number, station and socket."""
    return {f"{golden.serial_number}, {golden.station} · {golden.socket}": golden for golden in each.golden}


def golden_plot(each: "ParameterStatistics", label: Text, translate: Translate) -> dict[str, Any]:
    """Return the figures of golden motors over time, a line for each and each socket, by `golden_names`."""
    scale = scale_for(each)
    name = label.render(translate)
    plot = _described(
        axes("", "UTC", _with_unit(name, scale.unit)),
        text("Golden motors' {parameter} over time", parameter=name).render(translate),
    )
    plot["grid"] |= {"left": 84}
    plot["yAxis"]["nameGap"] = 64
    plot["useUTC"] = True
    plot["xAxis"] |= {"type": "time", "axisLabel": {"formatter": "{MM}-{dd} {HH}:{mm}", "hideOverlap": True}}
    # A time is no number: the library's own words for it stay.
    plot["tooltip"] |= {"trigger": "axis", "axisPointer": {}}
    plot["legend"] = {"top": 4, "data": list(golden_names(each))}
    for name, golden in golden_names(each).items():
        pairs = [
            [1000.0 * at.timestamp(), float(f"{value / scale.factor:.6g}")]
            for at, value in zip(golden.times, golden.values, strict=True)
        ]
        plot["series"].append(line(name, pairs, marks=True))
    return plot


def _rules(rules: Sequence[int], chart: Chart, translate: Translate) -> str:
    return "\n".join(rule_words(rule, chart).render(translate) for rule in rules)


def _described(plot: dict[str, Any], words: str) -> dict[str, Any]:
    """Give a plot its description for those who do not see it, and tooltips that take serial numbers as plain text."""
    plot.pop("title")
    return plot | {
        "aria": {"enabled": True, "label": {"description": words}},
        "tooltip": tooltip(trigger="item", renderMode="richText"),
    }


def _with_unit(name: str, unit: str) -> str:
    return f"{name} / {unit}" if unit else name


def _mark(axis: str, at: float, words: str, colour: str, *, solid: bool) -> dict[str, Any]:
    return {
        axis: at,
        "name": words,
        "lineStyle": {"color": colour, "type": "solid" if solid else "dashed", "width": 1.5},
        "label": {"formatter": words, "color": colour},
    }


def _lines(marks: Sequence[dict[str, Any]]) -> dict[str, Any]:
    # Without a negative precision the library draws a line where its value rounded to two decimals is.
    return {"silent": True, "symbol": "none", "animation": False, "precision": -1, "data": list(marks)}
