"""Output of `motorbench eol stats` for people."""

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from bench.cli.eol.yields_output import groups_table, yields_table
from bench.cli.plain_table import plain_table
from bench.eol.line_statistics import LineStatistics, ParameterStatistics
from bench.eol.statistics.association import Association
from bench.eol.statistics.proportion import pareto
from bench.eol.statistics_messages import (
    association_words,
    bounds,
    distribution_words,
    drift_figures,
    drift_words,
    false_alarm_words,
    indices,
    latest_of,
    outside,
    percentage,
    rule_words,
    scale_for,
    share_outside,
    signals,
    stated_limits,
    trimmed,
)
from bench.eol.store.tallies import Failures
from bench.run.console import console_on
from drivers.interfaces.text import Text, Translate, text
from reports.labels import ParameterLabels
from reports.tables.figures import decimals_for, figure

if TYPE_CHECKING:
    from rich.table import Table

#: Width of the column of names that long figures leave (characters).
_LEAST_NAME = 18
_BLOCKS = " ▁▂▃▄▅▆▇█"
_WIDEST = 50
#: Figures that are named beside a failure.
_SHOWN = 3


def print_statistics(
    found: LineStatistics,
    labels: ParameterLabels,
    confidence: float,
    translate: Translate,
    *,
    detailed: bool,
    named_rules: bool,
) -> None:
    """Print the yields, what failed, a line a parameter; `detailed` adds histogram and chart of each."""
    console = console_on(sys.stdout, markup=False)

    def say(words: Text) -> None:
        console.print(words.render(translate), soft_wrap=True)

    selection = found.selection
    batches = ", ".join(selection.batches[:5]) + (" …" if len(selection.batches) > 5 else "")
    say(
        text(
            "{model}, tests: {count}, batches: {names}",
            model=selection.model,
            count=selection.count,
            names=batches,
        )
    )
    console.print(yields_table(found.yields, confidence, translate))
    for grouping, groups in found.yields.motors.groups.items():
        console.print(groups_table(grouping, groups, translate))
    for title, failures in (
        (text("Parameter"), found.by_parameter),
        (text("Procedure"), found.by_procedure),
    ):
        if failures:
            console.print(_pareto(title, failures, labels, translate))
    for stands_out in _farthest(found):
        say(association_words(stands_out, labels))
    console.print(_figures(found.parameters, labels, translate))
    console.print(_capabilities(found.parameters, labels, confidence, translate))
    say(
        text(
            "Cp and Cpk by the spread within (moving range of neighbours), Pp and Ppk by the overall one; in brackets the "
            "{confidence:.0%} interval.",
            confidence=confidence,
        )
    )
    for name, each in found.parameters.items():
        words = distribution_words(each, labels[name])
        if words is not None:
            say(words)
    charts = [(each.chart, len(each.values)) for each in found.parameters.values() if each.chart is not None]
    if charts:
        say(false_alarm_words(*max(charts, key=lambda chart: chart[0].false_alarms), named=named_rules))
    for name, each in found.parameters.items():
        if each.distribution.changed:
            say(
                text(
                    "{parameter}: the limits have changed; the limits of the latest motor are shown",
                    parameter=labels[name],
                )
            )
        if detailed:
            console.print(_histogram(each, labels[name], translate))
        _print_chart(say, labels[name], each)
        _print_golden(say, labels[name], each)


def _pareto(title: Text, failures: Sequence[Failures], labels: ParameterLabels, translate: Translate) -> "Table":
    table = plain_table(
        translate, title, text("Failed"), text("% of failures"), text("Cumulative, %"), text("Errors"), text("")
    )
    table.columns[-1].justify = "left"
    for each, found in zip(failures, pareto([each.failed for each in failures]), strict=True):
        table.add_row(
            labels[each.name].render(translate),
            str(each.failed),
            percentage(found.share, 1),
            percentage(found.cumulative, 1),
            str(each.errors) if each.errors else "",
            "█" * round(30.0 * found.share) if each.failed else "",
        )
    return table


def _figures(parameters: Mapping[str, ParameterStatistics], labels: ParameterLabels, translate: Translate) -> "Table":
    table = plain_table(
        translate,
        text("Parameter"),
        text("Unit"),
        text("Figures"),
        text("Mean"),
        Text("s"),
        text("Limits"),
        text("Least … most"),
        left=2,
    )
    for name, each in parameters.items():
        found, scale = each.distribution, scale_for(each)
        spread = found.standard_deviation / scale.factor
        digits = decimals_for(spread, found.mean / scale.factor)
        table.add_row(
            labels[name].render(translate),
            scale.unit,
            str(found.count),
            figure(found.mean / scale.factor, digits),
            figure(spread, digits + 1),
            stated_limits(found.limits.low, found.limits.high, scale, digits),
            bounds(found.least, found.most, scale, digits),
        )
    return table


def _capabilities(
    parameters: Mapping[str, ParameterStatistics], labels: ParameterLabels, confidence: float, translate: Translate
) -> "Table":
    table = plain_table(
        translate, text("Parameter"), Text("Cp"), Text("Cpk"), Text("Pp"), Text("Ppk"), text("Outside, %")
    )
    # An index with its interval may be long: its lines break, and the parameter keeps its name.
    table.columns[0].min_width = _LEAST_NAME
    for column in table.columns[1:]:
        column.no_wrap = False
    for name, each in parameters.items():
        table.add_row(labels[name].render(translate), *indices(each), share_outside(each, confidence))
    return table


def _farthest(found: LineStatistics) -> list[Association]:
    """Return of each failure the three figures in which its motors lie farthest off."""
    shown: list[Association] = []
    for each in found.associations:
        if sum(one.failure == each.failure for one in shown) < _SHOWN:
            shown.append(each)
    return shown


def _histogram(each: ParameterStatistics, label: Text, translate: Translate) -> "Table":
    found, scale = each.distribution, scale_for(each)
    table = plain_table(
        translate,
        text("From ({parameter}, {unit})", parameter=label.render(translate), unit=scale.unit),
        text("Figures"),
        text(""),
        left=0,
    )
    table.columns[-1].justify = "left"
    histogram = trimmed(found.histogram)
    width = histogram.edges[1] - histogram.edges[0]
    digits = decimals_for(width / scale.factor, 0.0)
    most = max(histogram.counts)
    beyond = outside(histogram, found.limits.low, found.limits.high)
    for edge, count, out in zip(histogram.edges[:-1], histogram.counts, beyond, strict=True):
        table.add_row(
            figure(edge / scale.factor, digits),
            str(count),
            "█" * math.ceil(_WIDEST * count / most) if most else "",
            style="red" if out else None,
        )
    return table


def _print_chart(say: Callable[[Text], None], label: Text, each: ParameterStatistics) -> None:
    chart, scale = each.chart, scale_for(each)
    if chart is None:
        return
    digits = decimals_for(chart.sigma / scale.factor, chart.centre / scale.factor)
    say(
        text(
            "{parameter}: last {count}: {line}  centre {centre} {unit}; not normally distributed, so without "
            "control limits; a shift is still reported",
            parameter=label,
            count=len(each.values),
            line=_spark(each.values[-60:], chart.low, chart.high),
            centre=figure(chart.centre / scale.factor, digits),
            unit=scale.unit,
        )
        if not math.isfinite(chart.reach)
        else text(
            "{parameter}: last {count}: {line}  centre {centre}, control limits {low} … {high} {unit}",
            parameter=label,
            count=len(each.values),
            line=_spark(each.values[-60:], chart.low, chart.high),
            centre=figure(chart.centre / scale.factor, digits),
            low=figure(chart.low / scale.factor, digits) if math.isfinite(chart.low) else "–",
            high=figure(chart.high / scale.factor, digits) if math.isfinite(chart.high) else "–",
            unit=scale.unit,
        )
    )
    for rule, at in signals(each).items():
        say(
            text(
                "  {rule}: {motors}",
                rule=rule_words(rule, chart),
                motors=latest_of(at),
            )
        )


def _print_golden(say: Callable[[Text], None], label: Text, each: ParameterStatistics) -> None:
    for golden in each.golden:
        scale, found = scale_for(each), golden.drift
        say(
            text(
                "{parameter}: golden motor {serial}, {station} · {socket}: {count} ×, mean {mean}, s {s} {unit}, drift {slope} ({low} … "
                "{high}) {unit} a day: {said}",
                parameter=label,
                serial=golden.serial_number,
                station=golden.station,
                socket=golden.socket,
                count=found.count,
                unit=scale.unit,
                **drift_figures(golden, scale),
                said=drift_words(found),
            )
        )


def _spark(values: Sequence[float], low: float, high: float) -> str:
    """Draw values as blocks between the control limits, or to the outermost value where there is none; what lies beyond is marked."""
    low = low if math.isfinite(low) else min(values)
    high = high if math.isfinite(high) else max(values)
    result = []
    for value in values:
        if not low <= value <= high:
            result.append("▽" if value < low else "△")
        else:
            result.append(_BLOCKS[1 + round((len(_BLOCKS) - 2) * (value - low) / (high - low))] if high > low else "▄")
    return "".join(result)
