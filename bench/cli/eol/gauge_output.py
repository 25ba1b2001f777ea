"""Output of `motorbench eol stats --gauge` and `--study` for people."""

import math
import sys
from collections.abc import Mapping

from bench.cli.plain_table import plain_table
from bench.eol.statistics.gauge import GaugeStudy
from bench.eol.statistics.gauge_types import Linearity, RangeStudy, TypeOneStudy
from bench.eol.statistics_messages import with_interval
from bench.run.console import console_on
from drivers.interfaces.text import Text, Translate, text
from reports.labels import ParameterLabels
from reports.tables.figures import decimals_for, figure, scale_of


def print_gauge(
    studies: Mapping[str, tuple[GaugeStudy, str]], labels: ParameterLabels, confidence: float, translate: Translate
) -> None:
    """Print a gauge study, a line a parameter."""
    console = console_on(sys.stdout, markup=False)
    table = plain_table(
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
        table.add_row(
            labels[name].render(translate),
            scale.unit,
            *(figure(number / scale.factor, digits) for number in numbers),
            f"{figure(low / scale.factor, digits)} … {figure(high / scale.factor, digits)}",
            figure(study.parts / scale.factor, digits),
            f"{100.0 * study.grr_share:.1f}",
            str(study.categories),
            (pooled if study.pooled else kept).render(translate),
        )
    console.print(table)
    alpha = next(iter(studies.values()))[0].alpha if studies else 0.05
    message = text(
        "Standard deviations; R&R in % of the total variation. The interaction of part and appraiser is pooled into "
        "repeatability where its p is above {alpha:g}.",
        alpha=alpha,
    )
    console.print(message.render(translate))


def print_type_one(
    studies: Mapping[str, tuple[TypeOneStudy, str]], labels: ParameterLabels, confidence: float, translate: Translate
) -> None:
    """Print type-1 studies, a line a parameter."""
    table = plain_table(
        translate,
        text("Parameter"),
        text("Unit"),
        text("Values"),
        text("Reference"),
        text("Bias"),
        text("Bias, {confidence:.0%} interval", confidence=confidence),
        Text("s"),
        Text("Cg"),
        Text("Cgk"),
        left=2,
    )
    for name, (study, unit) in studies.items():
        scale = scale_of(study.reference, unit)
        digits = decimals_for(study.standard_deviation / scale.factor, 0.0, 3)
        low, high = study.bias_interval
        table.add_row(
            labels[name].render(translate),
            scale.unit,
            str(study.count),
            *(figure(number / scale.factor, digits) for number in (study.reference, study.bias)),
            f"{figure(low / scale.factor, digits)} … {figure(high / scale.factor, digits)}",
            figure(study.standard_deviation / scale.factor, digits),
            with_interval(study.cg, study.cg_interval),
            with_interval(study.cgk, study.cgk_interval),
        )
    _print(table, text("Cg and Cgk of 20 % of the tolerance over 6 s; 1.33 is usually asked for."), translate)


def print_range(
    studies: Mapping[str, tuple[RangeStudy, str]], labels: ParameterLabels, confidence: float, translate: Translate
) -> None:
    """Print studies by the range method, a line a parameter."""
    table = plain_table(
        translate,
        text("Parameter"),
        text("Unit"),
        text("Mean range"),
        text("R&R"),
        text("R&R, {confidence:.0%} interval", confidence=confidence),
        text("R&R, %"),
        left=2,
    )
    for name, (study, unit) in studies.items():
        scale = scale_of(study.grr, unit)
        digits = decimals_for(study.grr / scale.factor, 0.0, 3)
        low, high = study.grr_interval
        table.add_row(
            labels[name].render(translate),
            scale.unit,
            *(figure(number / scale.factor, digits) for number in (study.mean_range, study.grr)),
            f"{figure(low / scale.factor, digits)} … {figure(high / scale.factor, digits)}",
            "–" if math.isnan(study.share) else f"{100.0 * study.share:.1f}",
        )
    _print(
        table,
        text("R&R in % of a sixth of the tolerance; repeatability and reproducibility are not told apart."),
        translate,
    )


def print_linearity(
    studies: Mapping[str, tuple[Linearity, str]], labels: ParameterLabels, confidence: float, translate: Translate
) -> None:
    """Print studies of linearity: the bias at each reference value, and the line through them."""
    for name, (study, unit) in studies.items():
        scale = scale_of(max(abs(each.reference) for each in study.biases), unit)
        digits = decimals_for(study.standard_deviation / scale.factor, 0.0, 3)
        table = plain_table(
            translate,
            labels[name],
            text("Values"),
            text("Bias"),
            text("Bias, {confidence:.0%} interval", confidence=confidence),
        )
        for each in study.biases:
            low, high = each.interval
            table.add_row(
                f"{each.reference / scale.factor:.6g} {scale.unit}",
                str(each.count),
                figure(each.bias / scale.factor, digits),
                f"{figure(low / scale.factor, digits)} … {figure(high / scale.factor, digits)}",
            )
        verdict = (
            text(
                "neither slope nor intercept differs significantly from zero: this study shows no sign that the "
                "gauge is not linear"
            )
            if study.acceptable
            else text("the gauge is not linear, or has a bias")
        )
        _print(
            table,
            text(
                "Bias = {slope:.4g} × reference {intercept:+.4g} {unit}; slope {slope_low:.4g} … {slope_high:.4g} (t = {slope_t:.2f}), "
                "intercept {low:.4g} … {high:.4g} {unit} (t = {t:.2f}), R² = {r_squared:.3f}: {verdict}",
                slope=study.slope,
                intercept=study.intercept / scale.factor,
                slope_low=study.slope_interval[0],
                slope_high=study.slope_interval[1],
                slope_t=study.slope_t,
                low=study.intercept_interval[0] / scale.factor,
                high=study.intercept_interval[1] / scale.factor,
                t=study.intercept_t,
                r_squared=study.r_squared,
                unit=scale.unit,
                verdict=verdict,
            ),
            translate,
        )


def _print(made: object, words: Text, translate: Translate) -> None:
    console = console_on(sys.stdout, markup=False)
    console.print(made)
    console.print(words.render(translate), soft_wrap=True)
