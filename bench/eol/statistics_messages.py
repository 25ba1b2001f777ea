"""Wording of a line's statistics for people, at the terminal and at the panel."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from bench.eol.statistics.association import Association
from bench.eol.statistics.capability import Capability
from bench.eol.statistics.control_chart import SHIFT, Chart
from bench.eol.statistics.drift import Drift
from bench.eol.statistics.percentile_capability import FEWEST
from bench.eol.statistics.proportion import Proportion, proportion
from bench.eol.verdict import Verdict
from drivers.interfaces.text import Text, text
from reports.labels import ParameterLabels
from reports.tables.figures import Scale, decimals_for, figure, scale_of

if TYPE_CHECKING:
    # The database's library takes a second to load; who only writes figures down need not have it.
    from bench.eol.line_statistics import Golden, ParameterStatistics
    from bench.eol.store.distribution import Histogram

#: No limit is shown with more decimals, unless its parameter's figures are.
_MOST_DECIMALS = 12
VERDICTS: Mapping[Verdict, Text] = {
    Verdict.PASS: text("pass"),
    Verdict.FAIL: text("fail"),
    Verdict.ERROR: text("not measured"),
    Verdict.ABORTED: text("aborted"),
    Verdict.NOT_JUDGED: text("not judged"),
}
GROUPING_WORDS: Mapping[str, Text] = {
    "station": text("Station"),
    "socket": text("Socket"),
    "shift": text("Shift"),
    "date": text("Date"),
    "plan": text("Plan"),
}
_RULES: Mapping[int, Text] = {
    2: text("nine in a row on one side"),
    3: text("six in a row rising or falling"),
    4: text("fourteen in a row up and down in turn"),
    5: text("two of three beyond 2 sigma on one side"),
    6: text("four of five beyond 1 sigma on one side"),
    7: text("fifteen in a row within 1 sigma"),
    8: text("eight in a row beyond 1 sigma on both sides"),
    SHIFT: text("the level has changed permanently after this motor"),
}


def rule_words(rule: int, chart: Chart) -> Text:
    """Return a rule of a control chart in words."""
    if rule == SHIFT:
        return _RULES[rule]
    if rule == 1:
        words = text("a point beyond {reach} sigma", reach=f"{chart.reach:.3g}")
        return text("rule {rule}, {words}", rule=rule, words=words)
    return text("rule {rule}, {words}", rule=rule, words=_RULES[rule])


def false_alarm_words(chart: Chart, points: int, *, named: bool) -> Text:
    """Return how often a chart signals where nothing has changed; `named` tells that its rules were asked for."""
    if named:
        return text(
            "With these rules, {share:.0%} of charts of {points} motors signal without any change (by simulation)",
            share=chart.false_alarms,
            points=points,
        )
    return text(
        "At most {share:.1%} of charts of {points} motors signal without any change",
        share=chart.false_alarms,
        points=points,
    )


def indices(each: "ParameterStatistics") -> tuple[str, str, str, str]:
    """Return Cp, Cpk, Pp and Ppk with their intervals; by percentiles, where the figures are not normal, the former are dashes."""
    other = each.percentiles
    if other is None:
        of_moments = [index(by, which) for by in (each.within, each.overall) for which in ("cp", "cpk")]
        return of_moments[0], of_moments[1], of_moments[2], of_moments[3]
    return "–", "–", with_interval(other.pp, other.pp_interval), with_interval(other.ppk, other.ppk_interval)


def distribution_words(each: "ParameterStatistics", label: Text) -> Text | None:
    """Return what a reader must know of how a parameter's indices were made; None where the figures may be normal."""
    found, other = each.normality, each.percentiles
    if math.isnan(found.p):
        if each.distribution.count < 2:
            return None
        if (
            math.isnan(each.overall.cpk)
            and math.isnan(each.overall.cp)
            and each.distribution.least == each.distribution.most
        ):
            return text(
                "{parameter}: all {count} figures are alike: their spread is below the resolution, so that it tells of no capability",
                parameter=label,
                count=each.distribution.count,
            )
        return text(
            "{parameter}: {count} motors are too few to tell whether the figures are normal; the indices take them to be",
            parameter=label,
            count=each.distribution.count,
        )
    if other is None:
        return None
    message = text(
        "{parameter}: the figures are not normal (Anderson-Darling A² = {statistic:.2f} of {count} motors, p {p}): Pp and Ppk "
        "are by the percentiles 0.135, 50 and 99.865 % (ISO 22514-2), their intervals by order statistics, without any "
        "assumption; Cp and Cpk, which assume a normal distribution, are not given",
        parameter=label,
        statistic=found.statistic,
        count=found.count,
        p="< 0.0001" if found.p < 1e-4 else f"= {found.p:.4f}",
    )
    if other.alike:
        same = text(
            "nearly all figures are alike: the spread is below their resolution, so that no Ppk is given",
        )
        return Text("{said}; {few}", {"said": message, "few": same})
    if other.count >= FEWEST:
        return message
    few = text(
        "{count} motors are too few for the outer percentiles ({fewest} are needed): of Ppk only the interval is given",
        count=other.count,
        fewest=FEWEST,
    )
    return Text("{said}; {few}", {"said": message, "few": few})


def association_words(each: Association, labels: ParameterLabels) -> Text:
    """Return in which figure the motors that failed somewhere stand out."""
    low, high = each.interval
    return text(
        "{failure} failed: {parameter} of these motors lies {offset:+.1f} standard deviations off ({low:+.1f} … {high:+.1f}, "
        "{count} motors)",
        failure=labels[each.failure],
        parameter=labels[each.parameter],
        offset=each.offset,
        low=low,
        high=high,
        count=each.count,
    )


def share_outside(each: "ParameterStatistics", confidence: float) -> str:
    """Return the share of values beyond the limits with its interval, in per cent; a dash where there are no limits."""
    found = each.distribution
    if not math.isfinite(found.limits.low) and not math.isfinite(found.limits.high):
        return "–"
    share = proportion(found.outside, found.count, confidence)
    low, high = share.interval
    return f"{100.0 * share.share:.3g} [{100.0 * low:.3g}, {100.0 * high:.3g}]" if found.count else "–"


def scale_for(each: "ParameterStatistics") -> Scale:
    """Return the scale in which a parameter's figures are written; its limits' where no motor has a figure."""
    about = (each.distribution.mean, each.distribution.limits.high, each.distribution.limits.low)
    return scale_of(next((value for value in about if math.isfinite(value)), 1.0), each.distribution.unit)


def bounds(low: float, high: float, scale: Scale, digits: int) -> str:
    """Return an interval; an open side is a dash."""
    return " … ".join(figure(side / scale.factor, digits) if math.isfinite(side) else "–" for side in (low, high))


def stated_limits(low: float, high: float, scale: Scale, digits: int) -> str:
    """Return limits with `digits` decimals, or as many more as they were stated with, up to four significant ones."""
    sides = [abs(side / scale.factor) for side in (low, high) if math.isfinite(side)]
    while digits < _MOST_DECIMALS and any(abs(round(side, digits) - side) > 1e-4 * side for side in sides):
        digits += 1
    return bounds(low, high, scale, digits)


def index(capability: Capability, which: str) -> str:
    """Return `cp` or `cpk` with its interval."""
    value = capability.cp if which == "cp" else capability.cpk
    return with_interval(value, capability.cp_interval if which == "cp" else capability.cpk_interval)


def with_interval(value: float, interval: tuple[float, float]) -> str:
    """Return an index with its interval; what is not known of it is a dash."""
    low, high = (bound if math.isfinite(bound) else math.nan for bound in interval)
    if math.isnan(value) and math.isnan(low) and math.isnan(high):
        return "–"
    shown = ["–" if math.isnan(number) else f"{number:.2f}" for number in (value, low, high)]
    return f"{shown[0]} [{shown[1]}, {shown[2]}]"


def percentage(share: float, digits: int = 2) -> str:
    """Return a share in per cent, without the sign."""
    return "–" if math.isnan(share) else f"{100.0 * share:.{digits}f}"


def interval(share: Proportion) -> str:
    """Return a share's interval in per cent."""
    return " … ".join(percentage(bound) for bound in share.interval)


def trimmed(histogram: "Histogram") -> "Histogram":
    """Leave out the empty bins at both ends."""
    full = [n for n, count in enumerate(histogram.counts) if count]
    if not full:
        return histogram
    first, last = full[0], full[-1]
    return replace(histogram, edges=histogram.edges[first : last + 2], counts=histogram.counts[first : last + 1])


def outside(histogram: "Histogram", low: float, high: float) -> list[bool]:
    """Tell of each bin whether it lies beyond the limits, which are edges of bins."""
    half = 0.5 * (histogram.edges[1] - histogram.edges[0])
    return [edge < low - half or edge > high - half for edge in histogram.edges[:-1]]


def signals(each: "ParameterStatistics") -> dict[int, list[str]]:
    """Return the serial numbers at which each rule is broken, by rule."""
    broken = each.chart.signals if each.chart is not None else ()
    return {
        rule: [each.serial_numbers[signal.index] for signal in broken if signal.rule == rule]
        for rule in sorted({signal.rule for signal in broken})
    }


def latest_of(serial_numbers: list[str]) -> str:
    """Return the last five of a list."""
    return ", ".join(serial_numbers[-5:]) + (" …" if len(serial_numbers) > 5 else "")


def drift_figures(golden: "Golden", scale: Scale) -> dict[str, str]:
    """Return a golden motor's figures in a scale: mean, s, slope a day with low and high."""
    drift = golden.drift
    digits = decimals_for(drift.standard_deviation / scale.factor, drift.mean / scale.factor, 3)
    slopes = [bound / scale.factor for bound in (drift.slope, *drift.slope_interval)]
    finer = decimals_for(slopes[2] - slopes[1], 0.0) if math.isfinite(slopes[0]) else 0
    slope, low, high = (figure(bound, finer) for bound in slopes)
    return {
        "mean": figure(drift.mean / scale.factor, digits),
        "s": figure(drift.standard_deviation / scale.factor, digits),
        "slope": slope,
        "low": low,
        "high": high,
    }


def drift_words(drift: Drift) -> Text:
    """Return what a drift tells of the station."""
    if math.isnan(drift.slope):
        return text("too few to tell")
    return text("the station drifts") if drift.significant else text("no drift to be seen")
