"""The parameters as tables: all of them at a glance, and each one's budget."""

from collections.abc import Iterable, Mapping

from drivers.interfaces.text import Text, text, word
from procedures.core.parameter_set import ParameterSet
from procedures.core.result import Parameter, Withheld, said_of
from reports.document.model import Cell, Column, Notices, Table, TableRow
from reports.labels import phrase
from reports.tables.budget import budget_rows, combined, freedom
from reports.tables.figures import decimals_for, figure, scale_of
from reports.tables.parameter_figures import shown, shown_withheld


def parameter_table(found: ParameterSet, truth: Mapping[str, float]) -> Table:
    """Return every reported figure, beneath it those of other procedures; the truth of a virtual motor beside them.

    What was withheld stands at the end, with the cause in place of figures.
    """
    columns = [
        Column(text("Parameter"), wide=True),
        Column(text("Value"), right=True),
        Column(text("Unit")),
        Column(text("u"), right=True),
        Column(text("u, %"), right=True),
        Column(text("95 % interval"), right=True),
        Column(text("Note's formula"), right=True),
        *([Column(text("Truth"), right=True)] if truth else []),
        Column("§"),
    ]
    rows = []
    for name, parameter in found.parameters.items():
        rows.append(_row(parameter, parameter.label, truth.get(name), with_truth=bool(truth)))
        for other in found.alternatives.get(name, ()):
            by = (
                text("· {procedure}", procedure=word(other.procedure))
                if other.procedure != parameter.procedure
                else text("· by another method")
            )
            rows.append(_row(other, by, None, with_truth=bool(truth), faint=True))
    rows += [
        _not_given(reasons[0], truth.get(name), with_truth=bool(truth)) for name, reasons in found.withheld.items()
    ]
    return Table(
        columns,
        rows,
        remark=text(
            "u: standard uncertainty. 95 % interval: coverage interval. Note's formula: its result on the same readings. "
            "Resistance, inductance and flux linkage are those of the Y-equivalent; what depends on temperature is at 25 °C."
        ),
    )


def _row(parameter: Parameter, name: Text, truth: float | None, *, with_truth: bool, faint: bool = False) -> TableRow:
    figures = shown(parameter, truth)
    uncertainty: Cell = text("data sheet") if parameter.source != "measured" else figures.uncertainty
    cells: list[Cell] = [
        name,
        figures.value,
        figures.unit,
        uncertainty,
        figures.relative,
        figures.interval,
        figures.note,
    ]
    if with_truth:
        cells.append(figures.truth)
    return TableRow([*cells, parameter.section], faint=faint)


def _not_given(reason: Withheld, truth: float | None, *, with_truth: bool) -> TableRow:
    figures = shown_withheld(truth, reason.reader_unit)
    cells: list[Cell] = [reason.label, text("withheld"), figures.unit, "–", "–", word(reason.cause), "–"]
    if with_truth:
        cells.append(figures.truth)
    return TableRow([*cells, reason.section])


def withheld_notices(reasons: Iterable[Withheld]) -> Notices:
    """Return what is not given, by which procedure, with the cause and what to do."""
    return Notices(tuple(("withheld", sentence) for sentence in said_of(reasons)), grave=True)


def result_table(parameters: tuple[Parameter, ...]) -> Table:
    """Return one procedure's parameters with the estimator behind each, and a delta's winding where there is one."""
    winding = any(parameter.winding is not None for parameter in parameters)
    columns = [
        Column(text("Parameter")),
        Column(text("Value"), right=True),
        Column(text("Unit")),
        Column(text("u"), right=True),
        Column(text("Note's formula"), right=True),
        *([Column(text("One winding"), right=True)] if winding else []),
        Column(text("Estimator and convention"), wide=True),
    ]
    rows = []
    for parameter in parameters:
        figures = shown(parameter)
        scale = scale_of(parameter.value, parameter.reader_unit)
        cells: list[Cell] = [
            parameter.label,
            figures.value,
            figures.unit,
            figures.uncertainty,
            figures.note,
        ]
        if winding:
            decimals = decimals_for(parameter.standard_uncertainty / scale.factor, parameter.value / scale.factor)
            cells.append(figure(None if parameter.winding is None else parameter.winding / scale.factor, decimals))
        message = phrase(parameter.estimator)
        if parameter.convention:
            message = Text(
                "{estimator}; {convention}", {"estimator": message, "convention": phrase(parameter.convention)}
            )
        rows.append(TableRow([*cells, message]))
    return Table(columns, rows)


def budget_table(parameter: Parameter) -> Table | None:
    """Return every input of a parameter's uncertainty and what they come to; None for a figure without uncertainty."""
    if not parameter.budget:
        return None
    scale = scale_of(parameter.value, parameter.reader_unit)
    total = combined(parameter)
    decimals = decimals_for(total / scale.factor, 0.0)
    rows = [TableRow(cells) for cells in budget_rows(parameter, scale.factor)]
    rows.append(
        TableRow(
            [text("all rows, root sum of squares"), "", "", "", "", figure(total / scale.factor, decimals), "100 %"],
            total=True,
        )
    )
    figures = shown(parameter)
    return Table(
        [
            Column(text("Source"), wide=True),
            Column(text("Type")),
            Column(text("Estimate"), right=True),
            Column(text("u"), right=True),
            Column(text("Sensitivity"), right=True),
            Column(text("Contribution, {unit}", unit=scale.unit or "1"), right=True),
            Column(text("Share"), right=True),
        ],
        rows,
        title=text(
            "Uncertainty of {name}: {value} {unit}, u = {spread}, {freedom} effective degrees of freedom, 95 %: {interval}",
            name=parameter.label,
            value=figures.value,
            unit=figures.unit,
            spread=figures.uncertainty,
            freedom=freedom(parameter),
            interval=figures.interval,
        ),
    )
