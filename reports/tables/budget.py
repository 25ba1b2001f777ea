"""A parameter's uncertainty budget as a table: every input, how it reaches the result, and what the rows come to."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

from drivers.interfaces.text import Text, Translate, text, word
from procedures.core.result import Parameter
from reports.labels import section_name
from reports.tables.figures import decimals_for, figure, general, percent, scale_of
from reports.tables.fitted import FittedColumn, fitted

#: Below this share of the whole a contribution is not written out.
_NEGLIGIBLE = 1e-6
#: Above so many degrees of freedom Student's factor differs from the normal one by 0.01 % or less.
_MANY = 1e4

if TYPE_CHECKING:
    from rich.console import Group


def budgets(parameters: Sequence[Parameter], translate: Translate, width: int) -> "Group":
    """Return one table a parameter, in the order given, for a terminal of `width` columns."""
    from rich.console import Group

    return Group(*(_budget(parameter, translate, width) for parameter in parameters))


def combined(parameter: Parameter) -> float:
    """Return what the rows come to: the root of the sum of their squared contributions, in the parameter's unit."""
    return math.hypot(*(row.contribution for row in parameter.budget))


def budget_rows(parameter: Parameter, factor: float) -> list[list[Text | str]]:
    """Return each input's source, kind, estimate, u, sensitivity, contribution (in units of `factor`) and share, as written."""
    total = combined(parameter)
    return [
        [
            row.source,
            row.kind,
            general(row.value, 6),
            general(row.standard_uncertainty, 3),
            general(row.sensitivity, 4),
            contribution(row.contribution, total, factor),
            _share((row.contribution / total) ** 2),
        ]
        for row in parameter.budget
    ]


def contribution(size: float, total: float, factor: float) -> str:
    """Return a row's contribution in the scaled unit, two digits; what rounding left of nothing as a power of ten."""
    if size < _NEGLIGIBLE * total:
        return general(size / factor, 2)
    return figure(size / factor, decimals_for(size / factor, 0.0))


def freedom(parameter: Parameter) -> str:
    """Return the effective degrees of freedom; ten thousand and more change nothing against ∞."""
    degrees = parameter.degrees_of_freedom
    return (
        "∞"
        if not math.isfinite(degrees) or degrees > _MANY
        else f"{degrees:.0f}"
        if degrees >= 100
        else f"{degrees:.3g}"
    )


def _budget(parameter: Parameter, translate: Translate, width: int) -> "Group":
    from rich.console import Group
    from rich.text import Text as Words

    head = Words(f"{parameter.label.render(translate)} ", style="bold")
    where = text(
        "({procedure}, {section})", procedure=word(parameter.procedure), section=section_name(parameter.section)
    )
    head.append(where.render(translate), style="not bold dim")
    said = [head, Words(_stated(parameter).render(translate))]
    if not parameter.budget:
        return Group(head, Words(text("It has no uncertainty, and so no budget.").render(translate)), Words(""))
    scale = scale_of(parameter.value, parameter.reader_unit)
    total = combined(parameter)
    said_total = figure(total / scale.factor, decimals_for(total / scale.factor, 0.0))
    columns = [
        FittedColumn(
            text("Source").render(translate), breaks=30, footer=text("all rows, root sum of squares").render(translate)
        ),
        FittedColumn(text("Type").render(translate)),
        FittedColumn(text("Estimate").render(translate), 2, right=True),
        FittedColumn(text("u").render(translate), 3, right=True),
        FittedColumn(text("Sensitivity").render(translate), 1, right=True),
        FittedColumn(
            text("Contribution, {unit}", unit=scale.unit or "1").render(translate), right=True, footer=said_total
        ),
        FittedColumn(text("Share").render(translate), right=True, footer="100 %"),
    ]
    rows = [
        [cell if isinstance(cell, str) else cell.render(translate) for cell in row]
        for row in budget_rows(parameter, scale.factor)
    ]
    result = fitted(columns, rows, width)
    legend = text(
        "Type A: from statistics; B: from a specification, a certificate or what was entered. u: standard uncertainty."
    )
    return Group(*said, result, Words(legend.render(translate), style="dim"), Words(""))


def _share(part: float) -> str:
    return f"{percent(part)} %" if part >= 1e-4 else "< 0.01 %"


def _stated(parameter: Parameter) -> Text:
    scale = scale_of(parameter.value, parameter.reader_unit)
    spread = parameter.standard_uncertainty / scale.factor
    decimals = decimals_for(spread, parameter.value / scale.factor)
    low, high = (figure(bound / scale.factor, decimals) for bound in parameter.coverage_interval)
    return text(
        "{value} {unit}, standard uncertainty {spread}, {freedom} effective degrees of freedom, 95 %: {low} … {high}",
        value=figure(parameter.value / scale.factor, decimals),
        unit=scale.unit,
        spread=figure(spread, decimals),
        freedom=freedom(parameter),
        low=low,
        high=high,
    )
