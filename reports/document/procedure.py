"""One procedure of a run: its steps as the document has them, what was set and read, the plots, the results and their budgets."""

from collections.abc import Iterator, Mapping, Sequence

from drivers.interfaces.text import Text, lines, text, word
from procedures.core.result import Parameter
from reports.document.model import (
    Block,
    Cell,
    Column,
    Drawings,
    Facts,
    Notices,
    Paragraph,
    PlotFigure,
    ReportSection,
    Table,
    TableRow,
)
from reports.document.parameters import budget_table, result_table, withheld_notices
from reports.document.readings import readings_table
from reports.document.record import ConnectionRecord, ProcedureRecord, ProcedureStepRecord
from reports.document.wiring import wiring_table
from reports.labels import section_name
from reports.plots.of_procedures import plots
from reports.tables.budget import combined

STATUS: dict[str, Text] = {
    "finished": text("done"),
    "failed": text("failed"),
    "started": text("not finished"),
}


def procedure_section(procedure: ProcedureRecord, colours: Mapping[str, str]) -> ReportSection:
    """Return the procedure's section; one that failed says why and shows how far it came. `colours` are the motor's wires'."""
    return ReportSection(_heading(procedure), procedure.name, tuple(_blocks(procedure, colours)), level=2)


def _heading(procedure: ProcedureRecord) -> Text:
    return Text("{title} ({section})", {"title": procedure.title, "section": section_name(procedure.section)})


def _blocks(procedure: ProcedureRecord, colours: Mapping[str, str]) -> Iterator[Block]:
    result = procedure.result
    if procedure.cause:
        yield Notices((("", text("The procedure failed: {cause}", cause=procedure.cause)),), grave=True)
    elif result is None:
        yield Notices((("", text("The procedure was not finished.")),), grave=True)
    if result is not None and result.withheld:
        yield withheld_notices(result.withheld)
    said = [(reason.cause, reason.message) for reason in result.withheld] if result is not None else []
    warnings = [(n.identifier, n.message) for n in (result.warnings if result is not None else ())]
    warnings = [warning for warning in warnings if warning not in said]
    if warnings:
        yield Notices(tuple(warnings))
    yield _steps(procedure.steps)
    if procedure.settings:
        yield Facts(((text("Settings"), _settings(procedure)),))
    if procedure.connections:
        yield Drawings([(made.draw, _caption(made)) for made in procedure.connections])
    checks = wiring_table(result.findings.get("wiring", ()) if result is not None else (), colours)
    yield from (table for table in (checks, readings_table(procedure.steps)) if table is not None)
    yield from (PlotFigure(plot) for plot in plots(procedure))
    if result is None or not result.parameters:
        return
    yield result_table(result.parameters)
    yield from _budgets(result.parameters)


def _caption(made: ConnectionRecord) -> Text:
    steps = list(dict.fromkeys(made.steps))
    if made.alike:
        return text("Connections at {steps}; {count} more with the terminals exchanged", steps=steps, count=made.alike)
    return text("Connections at {steps}", steps=steps)


def _budgets(parameters: Sequence[Parameter]) -> Iterator[Block]:
    """Give each parameter's budget; one that is another's in another unit is only named."""
    told: dict[tuple[tuple[str, float], ...], Parameter] = {}
    for parameter in parameters:
        table = budget_table(parameter)
        if table is None:
            continue
        same = told.setdefault(_shares(parameter), parameter)
        if same is parameter:
            yield table
        else:
            words = text(
                "{name}: the budget of {other} in another unit.",
                name=parameter.label,
                other=same.label,
            )
            yield Paragraph(words, small=True)
    if told:
        yield Paragraph(
            text(
                "Type A: from statistics; B: from a specification, a certificate or what was entered. u: standard uncertainty."
            ),
            small=True,
        )


def _shares(parameter: Parameter) -> tuple[tuple[str, float], ...]:
    total = combined(parameter)
    return tuple((row.identity or str(row.source), round(row.contribution / total, 9)) for row in parameter.budget)


def _steps(steps: Sequence[ProcedureStepRecord]) -> Table:
    rows = []
    for step in steps:
        ended: Cell = STATUS.get(step.status, text("not finished"))
        took = "" if step.ended is None else f"{step.ended - step.started:.1f}"
        words: Cell = (
            step.words if not step.error else Text("{words}: {error}", {"words": step.words, "error": step.error})
        )
        rows.append(TableRow([step.identifier, words, text("by hand") if step.by_hand else "", took, ended]))
    return Table(
        [
            Column(text("Step")),
            Column(text("What was done"), wide=True),
            Column(""),
            Column(text("Time, s"), right=True),
            Column(text("Outcome")),
        ],
        rows,
    )


def _settings(procedure: ProcedureRecord) -> Text:
    """Return the settings by what they are; one that no description is at hand for by its name."""
    result = (
        text("{name}: {value}", name=procedure.described.get(name, word(name)), value=_shown(value))
        for name, value in procedure.settings.items()
        if value is not None
    )
    return lines(result, "; ")


def _shown(value: object) -> Text | str:
    if isinstance(value, list | tuple):
        return lines((_shown(item) for item in value), ", ")
    if isinstance(value, bool):
        return text("yes") if value else text("no")
    return f"{value:g}" if isinstance(value, float) else str(value)
