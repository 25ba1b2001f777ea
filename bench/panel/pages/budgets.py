"""The uncertainty budget of every parameter, opened one at a time."""

import math

from nicegui import ui

from bench.panel.live_run import LiveRun
from bench.panel.pages.frame import Reader
from bench.panel.pages.tables import html_table
from procedures.result import Parameter
from procedures.text import text
from reports.names import parameter_name, phrase


def budgets_part(run: LiveRun, reader: Reader) -> None:
    """Build the budgets of a run's parameters."""
    say, found = reader.say, run.view.run.parameters()
    with_budget = [p for p in found.parameters.values() if p.budget]
    if not with_budget:
        return
    with ui.element("section").classes("mb-card mb-4").props(f'aria-label="{say(text("Uncertainty budgets"))}"'):
        ui.label(say(text("Uncertainty budgets"))).classes("text-lg font-semibold")
        for parameter in with_budget:
            title = f"{say(parameter_name(parameter.name))} ({parameter.procedure}): {say(phrase(parameter.estimator))}"
            with ui.expansion(title).classes("w-full text-base"):
                ui.html(_table(parameter, reader), sanitize=False)


def _table(parameter: Parameter, reader: Reader) -> str:
    say = reader.say
    total = math.hypot(*(row.contribution for row in parameter.budget))
    head = [text("Source"), text("Type"), text("Estimate"), text("u"), text("Sensitivity")]
    titles = [*map(say, head), say(text("Contribution, {unit}", unit=parameter.unit)), say(text("Share"))]
    lines = [
        [
            row.source,
            row.kind,
            f"{row.value:.6g}",
            f"{row.standard_uncertainty:.3g}",
            f"{row.sensitivity:.4g}",
            f"{row.contribution:.3g}",
            f"{100.0 * (row.contribution / total) ** 2:.1f} %" if total else "–",
        ]
        for row in parameter.budget
    ]
    lines.append([say(text("all rows, root sum of squares")), "", "", "", "", f"{total:.3g}", "100 %"])
    return html_table(titles, lines, numeric=frozenset({2, 3, 4, 5, 6}))
