"""The uncertainty budget of every parameter, opened one at a time."""

from nicegui import ui

from bench.panel.live.live_run import LiveRun
from bench.panel.pages.parts import expansion, named, table
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from drivers.interfaces.text import text
from procedures.core.result import Parameter
from reports.document.model import Cell
from reports.document.parameters import budget_table
from reports.labels import phrase


def budgets_part(panel: Panel, run: LiveRun, reader: Reader) -> None:
    """Build the budgets of a run's parameters."""
    say, parameters = reader.say, run.view.run.parameters().parameters
    with_budget = [p for p in parameters.values() if p.budget]
    if not with_budget:
        return
    with named(ui.element("section").classes("mb-card mb-4"), say(text("Uncertainty budgets"))):
        ui.label(say(text("Uncertainty budgets"))).classes("text-lg font-semibold")
        for parameter in with_budget:
            title = say(
                text(
                    "{parameter} · {procedure}: {estimator}",
                    parameter=parameter.label,
                    procedure=panel.offer.title(parameter.procedure),
                    estimator=phrase(parameter.estimator),
                )
            )
            with expansion(title):
                _table(parameter, reader)


def _table(parameter: Parameter, reader: Reader) -> None:
    budget = budget_table(parameter)
    if budget is None:
        return
    lines = [[_cell_text(cell, reader) for cell in row.cells] for row in budget.rows]
    numeric = frozenset(number for number, column in enumerate(budget.columns) if column.right)
    table([_cell_text(column.title, reader) for column in budget.columns], lines, numeric=numeric)


def _cell_text(cell: Cell, reader: Reader) -> str:
    return cell if isinstance(cell, str) else reader.say(cell)
