"""What `motorbench eol stats` prints for people."""

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import TYPE_CHECKING

from bench.commands.output import console_on
from bench.eol.line_statistics import LineStatistics, ParameterStatistics
from bench.eol.statistics.capability import Capability
from bench.eol.statistics.drift import Drift
from bench.eol.statistics.gauge import GaugeStudy
from bench.eol.statistics.proportion import Proportion
from bench.eol.store.tallies import Failures, Histogram
from bench.eol.verdict import Verdict
from procedures.text import Text, Translate, text
from reports.figures import Scale, decimals_for, figure, scale_of
from reports.names import parameter_name

if TYPE_CHECKING:
    from rich.table import Table

_BLOCKS = " ▁▂▃▄▅▆▇█"
_WIDEST = 50
_VERDICTS = {
    Verdict.PASS: text("passed"),
    Verdict.FAIL: text("failed"),
    Verdict.ERROR: text("not measured"),
    Verdict.ABORTED: text("aborted"),
}
RULE_WORDS: Mapping[int, Text] = {
    1: text("a point beyond 3 sigma"),
    2: text("nine in a row on one side"),
    3: text("six in a row rising or falling"),
    4: text("fourteen in a row up and down in turn"),
    5: text("two of three beyond 2 sigma on one side"),
    6: text("four of five beyond 1 sigma on one side"),
    7: text("fifteen in a row within 1 sigma"),
    8: text("eight in a row beyond 1 sigma on both sides"),
}


def print_statistics(found: LineStatistics, confidence: float, translate: Translate, *, detailed: bool) -> None:
    """Print the yields, what failed, a line a parameter; `detailed` adds histogram and chart of each."""
    console = console_on(sys.stdout)

    def say(words: Text) -> None:
        console.print(words.render(translate), markup=False, soft_wrap=True)

    selection = found.selection
    batches = ", ".join(selection.batches[:5]) + (" …" if len(selection.batches) > 5 else "")
    say(
        text(
            "{model}: {count} motors, batches: {names}",
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
            console.print(_pareto(title, failures, translate))
    console.print(_figures(found.parameters, translate))
    console.print(_capabilities(found.parameters, translate))
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
                    parameter=parameter_name(name),
                )
            )
        if detailed:
            console.print(_histogram(each, translate))
        _print_chart(say, name, each)
        _print_golden(say, name, each)


def print_gauge(studies: Mapping[str, tuple[GaugeStudy, str]], confidence: float, translate: Translate) -> None:
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
            parameter_name(name).render(translate),
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
        made.add_column(heading.render(translate), justify="left" if n < left else "right", no_wrap=True)
    return made


def _yields(found: LineStatistics, confidence: float, translate: Translate) -> "Table":
    interval = text("{confidence:.0%} interval", confidence=confidence)
    made = _table(translate, text("Yield"), text("Motors"), Text("%"), interval)
    for words, share in ((text("First pass"), found.yields.first_pass), (text("Final"), found.yields.final)):
        made.add_row(words.render(translate), f"{share.hits} / {share.count}", _percent(share.share), _interval(share))
    for verdict, count in found.yields.verdicts.items():
        if verdict in (Verdict.ERROR, Verdict.ABORTED) and count:
            made.add_row(_VERDICTS[verdict].render(translate), str(count), "", "")
    return made


def _pareto(title: Text, failures: Sequence[Failures], translate: Translate) -> "Table":
    made = _table(
        translate, title, text("Failed"), text("% of failures"), text("Cumulative, %"), text("Errors"), text("")
    )
    made.columns[-1].justify = "left"
    total, so_far = sum(each.failed for each in failures), 0
    for each in failures:
        so_far += each.failed
        share = each.failed / total if total else 0.0
        made.add_row(
            parameter_name(each.name).render(translate),
            str(each.failed),
            f"{100.0 * share:.1f}" if total else "–",
            f"{100.0 * so_far / total:.1f}" if total else "–",
            str(each.errors) if each.errors else "",
            "█" * round(30.0 * share),
        )
    return made


def _figures(parameters: Mapping[str, ParameterStatistics], translate: Translate) -> "Table":
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
        found, scale = each.distribution, _scale(each)
        spread = found.standard_deviation / scale.factor
        digits = decimals_for(spread, found.mean / scale.factor)
        made.add_row(
            parameter_name(name).render(translate),
            scale.unit,
            str(found.count),
            figure(found.mean / scale.factor, digits),
            figure(spread, digits + 1),
            _bounds(found.limits.low, found.limits.high, scale, digits),
            _bounds(found.least, found.most, scale, digits),
        )
    return made


def _capabilities(parameters: Mapping[str, ParameterStatistics], translate: Translate) -> "Table":
    made = _table(translate, text("Parameter"), Text("Cp"), Text("Cpk"), Text("Pp"), Text("Ppk"))
    for name, each in parameters.items():
        made.add_row(
            parameter_name(name).render(translate),
            *(_index(by, which) for by in (each.within, each.overall) for which in ("cp", "cpk")),
        )
    return made


def _histogram(each: ParameterStatistics, translate: Translate) -> "Table":
    found, scale = each.distribution, _scale(each)
    made = _table(
        translate,
        text(
            "From ({parameter}, {unit})", parameter=parameter_name(found.parameter).render(translate), unit=scale.unit
        ),
        text("Motors"),
        text(""),
        left=0,
    )
    made.columns[-1].justify = "left"
    histogram = _shown(found.histogram)
    width = histogram.edges[1] - histogram.edges[0]
    digits = decimals_for(width / scale.factor, 0.0)
    most = max(histogram.counts)
    for edge, count in zip(histogram.edges[:-1], histogram.counts, strict=True):
        outside = edge < found.limits.low - 0.5 * width or edge > found.limits.high - 0.5 * width
        made.add_row(
            figure(edge / scale.factor, digits),
            str(count),
            "█" * math.ceil(_WIDEST * count / most) if most else "",
            style="red" if outside else None,
        )
    return made


def _shown(histogram: Histogram) -> Histogram:
    """Leave out the empty bins at both ends."""
    full = [n for n, count in enumerate(histogram.counts) if count]
    if not full:
        return histogram
    first, last = full[0], full[-1]
    return Histogram(histogram.edges[first : last + 2], histogram.counts[first : last + 1])


def _print_chart(say: Callable[[Text], None], name: str, each: ParameterStatistics) -> None:
    chart, scale = each.chart, _scale(each)
    if chart is None:
        return
    digits = decimals_for(chart.sigma / scale.factor, chart.centre / scale.factor)
    say(
        text(
            "{parameter}: last {count}: {line}  centre {centre}, control limits {low} … {high} {unit}",
            parameter=parameter_name(name),
            count=len(each.values),
            line=_spark(each.values[-60:], chart.low, chart.high),
            centre=figure(chart.centre / scale.factor, digits),
            low=figure(chart.low / scale.factor, digits),
            high=figure(chart.high / scale.factor, digits),
            unit=scale.unit,
        )
    )
    for rule in sorted({signal.rule for signal in chart.signals}):
        at = [each.serial_numbers[signal.index] for signal in chart.signals if signal.rule == rule]
        say(
            text(
                "  rule {rule}, {words}: {motors}",
                rule=rule,
                words=RULE_WORDS[rule],
                motors=", ".join(at[-5:]) + (" …" if len(at) > 5 else ""),
            )
        )


def _print_golden(say: Callable[[Text], None], name: str, each: ParameterStatistics) -> None:
    for golden in each.golden:
        scale, found = _scale(each), golden.drift
        digits = decimals_for(found.standard_deviation / scale.factor, found.mean / scale.factor, 3)
        slopes = [bound / scale.factor for bound in (found.slope, *found.slope_interval)]
        finer = decimals_for(slopes[2] - slopes[1], 0.0) if math.isfinite(slopes[0]) else 0
        slope, low, high = (figure(bound, finer) for bound in slopes)
        say(
            text(
                "{parameter}: golden motor {serial}: {count} times, mean {mean}, s {s} {unit}, drift {slope} ({low} … {high}) "
                "{unit} a day: {said}",
                parameter=parameter_name(name),
                serial=golden.serial_number,
                count=found.count,
                mean=figure(found.mean / scale.factor, digits),
                s=figure(found.standard_deviation / scale.factor, digits),
                unit=scale.unit,
                slope=slope,
                low=low,
                high=high,
                said=_drifts(found),
            )
        )


def _drifts(found: Drift) -> Text:
    if math.isnan(found.slope):
        return text("too few to tell")
    return text("the station drifts") if found.significant else text("no drift to be seen")


def _spark(values: Sequence[float], low: float, high: float) -> str:
    """Draw values as blocks between the control limits; what lies beyond them is marked."""
    made = []
    for value in values:
        if not low <= value <= high:
            made.append("▽" if value < low else "△")
        else:
            made.append(_BLOCKS[1 + round((len(_BLOCKS) - 2) * (value - low) / (high - low))] if high > low else "▄")
    return "".join(made)


def _scale(each: ParameterStatistics) -> Scale:
    return scale_of(each.distribution.mean, each.distribution.unit)


def _bounds(low: float, high: float, scale: Scale, digits: int) -> str:
    return " … ".join(figure(side / scale.factor, digits) if math.isfinite(side) else "–" for side in (low, high))


def _index(found: Capability, which: str) -> str:
    value = found.cp if which == "cp" else found.cpk
    low, high = found.cp_interval if which == "cp" else found.cpk_interval
    return "–" if math.isnan(value) else f"{value:.2f} [{low:.2f}, {high:.2f}]"


def _percent(share: float) -> str:
    return "–" if math.isnan(share) else f"{100.0 * share:.2f}"


def _interval(share: Proportion) -> str:
    return " … ".join(_percent(bound) for bound in share.interval)
