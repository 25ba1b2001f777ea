"""How a line's statistics are put for people, at the terminal and at the panel."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

from bench.eol.statistics.capability import Capability
from bench.eol.statistics.drift import Drift
from bench.eol.statistics.proportion import Proportion
from bench.eol.verdict import Verdict
from drivers.interfaces.text import Text, text
from reports.tables.figures import Scale, decimals_for, figure, scale_of

if TYPE_CHECKING:
    # The database's library takes a second to load; who only writes figures down need not have it.
    from bench.eol.line_statistics import Golden, ParameterStatistics
    from bench.eol.store.tallies import Histogram

VERDICTS: Mapping[Verdict, Text] = {
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


def scale_for(each: "ParameterStatistics") -> Scale:
    """Return the scale in which a parameter's figures are written; its limits' where no motor has a figure."""
    about = (each.distribution.mean, each.distribution.limits.high, each.distribution.limits.low)
    return scale_of(next((value for value in about if math.isfinite(value)), 1.0), each.distribution.unit)


def bounds(low: float, high: float, scale: Scale, digits: int) -> str:
    """Return an interval; an open side is a dash."""
    return " … ".join(figure(side / scale.factor, digits) if math.isfinite(side) else "–" for side in (low, high))


def index(capability: Capability, which: str) -> str:
    """Return `cp` or `cpk` with its interval."""
    value = capability.cp if which == "cp" else capability.cpk
    low, high = capability.cp_interval if which == "cp" else capability.cpk_interval
    return "–" if math.isnan(value) else f"{value:.2f} [{low:.2f}, {high:.2f}]"


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
