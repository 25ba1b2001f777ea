"""The uncertainty budget of every parameter, opened one at a time."""

from nicegui import ui

from bench.panel.live_run import LiveRun
from bench.panel.pages.frame import Reader
from bench.panel.pages.parts import named, table
from drivers.interfaces.text import text
from procedures.core.result import Parameter
from reports.document.model import Cell
from reports.document.parameters import budget_table
from reports.labels import parameter_name, phrase


def budgets_part(run: LiveRun, reader: Reader) -> None:
    """Build the budgets of a run's parameters."""
    say, found = reader.say, run.view.run.parameters()
    with_budget = [p for p in found.parameters.values() if p.budget]
    if not with_budget:
        return
    with named(ui.element("section").classes("mb-card mb-4"), say(text("Uncertainty budgets"))):
        ui.label(say(text("Uncertainty budgets"))).classes("text-lg font-semibold")
        for parameter in with_budget:
            title = f"{say(parameter_name(parameter.name))} ({parameter.procedure}): {say(phrase(parameter.estimator))}"
            with ui.expansion(title).classes("w-full text-base"):
                _table(parameter, reader)


def _table(parameter: Parameter, reader: Reader) -> None:
    told = budget_table(parameter)
    if told is None:
        return
    lines = [[_said(cell, reader) for cell in row.cells] for row in told.rows]
    numeric = frozenset(number for number, column in enumerate(told.columns) if column.right)
    table([_said(column.title, reader) for column in told.columns], lines, numeric=numeric)


def _said(cell: Cell, reader: Reader) -> str:
    return cell if isinstance(cell, str) else reader.say(cell)
