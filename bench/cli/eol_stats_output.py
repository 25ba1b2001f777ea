"""What `motorbench eol stats` prints for people."""

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING, Literal

from bench.eol.line_statistics import LineStatistics, ParameterStatistics
from bench.eol.statistics.gauge import GaugeStudy
from bench.eol.statistics.pareto import pareto
from bench.eol.statistics_messages import (
    RULE_WORDS,
    VERDICTS,
    bounds,
    drift_figures,
    drift_words,
    index,
    interval,
    latest_of,
    outside,
    percentage,
    scale_for,
    signals,
    trimmed,
)
from bench.eol.store.tallies import Failures
from bench.eol.verdict import Verdict
from bench.run.console import console_on
from drivers.interfaces.text import Text, Translate, text
from reports.labels import ParameterLabels
from reports.tables.figures import decimals_for, figure, scale_of

if TYPE_CHECKING:
    from rich.table import Table

_BLOCKS = " ▁▂▃▄▅▆▇█"
_WIDEST = 50


def print_statistics(
    found: LineStatistics, labels: ParameterLabels, confidence: float, translate: Translate, *, detailed: bool
) -> None:
    """Print the yields, what failed, a line a parameter; `detailed` adds histogram and chart of each."""
    console = console_on(sys.stdout)

    def say(words: Text) -> None:
        console.print(words.render(translate), markup=False, soft_wrap=True)

    selection = found.selection
    batches = ", ".join(selection.batches[:5]) + (" …" if len(selection.batches) > 5 else "")
    say(
        text(
            "{model}, motors: {count}, batches: {names}",
            model=selection.model,
            count=selection.count,
            names=batches,
        )
    )
    console.print(_yields(found, confidence, translate))
    for title, failures in (
        (text("Parameter"), found.by_parameter),
        (text("Procedure"), found.by_procedure),
    ):
        if failures:
            console.print(_pareto(title, failures, labels, translate))
    console.print(_figures(found.parameters, labels, translate))
    console.print(_capabilities(found.parameters, labels, translate))
    say(
        text(
            "Cp and Cpk by the spread within (moving range of neighbours), Pp and Ppk by the overall one; in brackets the "
            "{confidence:.0%} interval.",
            confidence=confidence,
        )
    )
    for name, each in found.parameters.items():
        if each.distribution.changed:
            say(
                text(
                    "{parameter}: the limits were others at first; shown are those of the latest motor",
                    parameter=labels[name],
                )
            )
        if detailed:
            console.print(_histogram(each, labels[name], translate))
        _print_chart(say, labels[name], each)
        _print_golden(say, labels[name], each)


def print_gauge(
    studies: Mapping[str, tuple[GaugeStudy, str]], labels: ParameterLabels, confidence: float, translate: Translate
) -> None:
    """Print a gauge study, a line a parameter."""
    console = console_on(sys.stdout)
    made = _table(
        translate,
        text("Parameter"),
        text("Unit"),
        text("Repeatability"),
        text("Reproducibility"),
        Text("R&R"),
        text("R&R, {confidence:.0%} interval", confidence=confidence),
        text("Parts"),
        text("R&R, %"),
        text("Categories"),
        text("Interaction"),
        left=2,
    )
    for name, (study, unit) in studies.items():
        scale = scale_of(study.total, unit)
        digits = decimals_for(study.grr / scale.factor, 0.0, 3)
        numbers = (study.repeatability, study.reproducibility, study.grr)
        low, high = study.grr_interval
        pooled = text("p = {p:.3f}, pooled", p=study.interaction_p)
        kept = text("p = {p:.3f}, kept", p=study.interaction_p)
        made.add_row(
            labels[name].render(translate),
            scale.unit,
            *(figure(number / scale.factor, digits) for number in numbers),
            f"{figure(low / scale.factor, digits)} … {figure(high / scale.factor, digits)}",
            figure(study.parts / scale.factor, digits),
            f"{100.0 * study.grr_share:.1f}",
            str(study.categories),
            (pooled if study.pooled else kept).render(translate),
        )
    console.print(made)
    alpha = next(iter(studies.values()))[0].alpha if studies else 0.05
    said = text(
        "Standard deviations; R&R in % of the total variation. The interaction of part and appraiser is pooled into "
        "repeatability where its p is above {alpha:g}.",
        alpha=alpha,
    )
    console.print(said.render(translate), markup=False)


def _table(translate: Translate, *headings: Text, left: int = 1) -> "Table":
    from rich import box
    from rich.table import Table

    made = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    for n, heading in enumerate(headings):
        justify: Literal["left", "right"] = "left" if n < left else "right"
        made.add_column(heading.render(translate), justify=justify, no_wrap=n > 0, overflow="ellipsis" if n else "fold")
    return made


def _yields(found: LineStatistics, confidence: float, translate: Translate) -> "Table":
    surely = text("{confidence:.0%} interval", confidence=confidence)
    made = _table(translate, text("Yield"), text("Motors"), Text("%"), surely)
    for words, share in ((text("First pass"), found.yields.first_pass), (text("Final"), found.yields.final)):
        made.add_row(words.render(translate), f"{share.hits} / {share.count}", percentage(share.share), interval(share))
    for verdict, count in found.yields.verdicts.items():
        if verdict in (Verdict.ERROR, Verdict.ABORTED) and count:
            made.add_row(VERDICTS[verdict].render(translate), str(count), "", "")
    return made


def _pareto(title: Text, failures: Sequence[Failures], labels: ParameterLabels, translate: Translate) -> "Table":
    made = _table(
        translate, title, text("Failed"), text("% of failures"), text("Cumulative, %"), text("Errors"), text("")
    )
    made.columns[-1].justify = "left"
    for each, found in zip(failures, pareto([each.failed for each in failures]), strict=True):
        made.add_row(
            labels[each.name].render(translate),
            str(each.failed),
            percentage(found.share, 1),
            percentage(found.cumulative, 1),
            str(each.errors) if each.errors else "",
            "█" * round(30.0 * found.share) if each.failed else "",
        )
    return made


def _figures(parameters: Mapping[str, ParameterStatistics], labels: ParameterLabels, translate: Translate) -> "Table":
    made = _table(
        translate,
        text("Parameter"),
        text("Unit"),
        text("Motors"),
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
        made.add_row(
            labels[name].render(translate),
            scale.unit,
            str(found.count),
            figure(found.mean / scale.factor, digits),
            figure(spread, digits + 1),
            bounds(found.limits.low, found.limits.high, scale, digits),
            bounds(found.least, found.most, scale, digits),
        )
    return made


def _capabilities(
    parameters: Mapping[str, ParameterStatistics], labels: ParameterLabels, translate: Translate
) -> "Table":
    made = _table(translate, text("Parameter"), Text("Cp"), Text("Cpk"), Text("Pp"), Text("Ppk"))
    for name, each in parameters.items():
        made.add_row(
            labels[name].render(translate),
            *(index(by, which) for by in (each.within, each.overall) for which in ("cp", "cpk")),
        )
    return made


def _histogram(each: ParameterStatistics, label: Text, translate: Translate) -> "Table":
    found, scale = each.distribution, scale_for(each)
    made = _table(
        translate,
        text("From ({parameter}, {unit})", parameter=label.render(translate), unit=scale.unit),
        text("Motors"),
        text(""),
        left=0,
    )
    made.columns[-1].justify = "left"
    histogram = trimmed(found.histogram)
    width = histogram.edges[1] - histogram.edges[0]
    digits = decimals_for(width / scale.factor, 0.0)
    most = max(histogram.counts)
    beyond = outside(histogram, found.limits.low, found.limits.high)
    for edge, count, out in zip(histogram.edges[:-1], histogram.counts, beyond, strict=True):
        made.add_row(
            figure(edge / scale.factor, digits),
            str(count),
            "█" * math.ceil(_WIDEST * count / most) if most else "",
            style="red" if out else None,
        )
    return made


def _print_chart(say: Callable[[Text], None], label: Text, each: ParameterStatistics) -> None:
    chart, scale = each.chart, scale_for(each)
    if chart is None:
        return
    digits = decimals_for(chart.sigma / scale.factor, chart.centre / scale.factor)
    say(
        text(
            "{parameter}: last {count}: {line}  centre {centre}, control limits {low} … {high} {unit}",
            parameter=label,
            count=len(each.values),
            line=_spark(each.values[-60:], chart.low, chart.high),
            centre=figure(chart.centre / scale.factor, digits),
            low=figure(chart.low / scale.factor, digits),
            high=figure(chart.high / scale.factor, digits),
            unit=scale.unit,
        )
    )
    for rule, at in signals(each).items():
        say(
            text(
                "  rule {rule}, {words}: {motors}",
                rule=rule,
                words=RULE_WORDS[rule],
                motors=latest_of(at),
            )
        )


def _print_golden(say: Callable[[Text], None], label: Text, each: ParameterStatistics) -> None:
    for golden in each.golden:
        scale, found = scale_for(each), golden.drift
        say(
            text(
                "{parameter}: golden motor {serial}: {count} ×, mean {mean}, s {s} {unit}, drift {slope} ({low} … {high}) "
                "{unit} a day: {said}",
                parameter=label,
                serial=golden.serial_number,
                count=found.count,
                unit=scale.unit,
                **drift_figures(golden, scale),
                said=drift_words(found),
            )
        )


def _spark(values: Sequence[float], low: float, high: float) -> str:
    """Draw values as blocks between the control limits; what lies beyond them is marked."""
    made = []
    for value in values:
        if not low <= value <= high:
            made.append("▽" if value < low else "△")
        else:
            made.append(_BLOCKS[1 + round((len(_BLOCKS) - 2) * (value - low) / (high - low))] if high > low else "▄")
    return "".join(made)
