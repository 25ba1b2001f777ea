"""What a run's records show beyond their models: each cause in words, and the residual in which it is to be seen."""

from typing import Any

from nicegui import ui

from bench.panel.live_run import LiveRun
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.plots import axes as empty_axes
from bench.panel.plots import line, thinned
from drivers.interfaces.text import Text, lines, text
from procedures.core.misfit_text import told_again
from procedures.core.result import ProcedureResult
from reports.document.record import ProcedureRecord
from reports.plots.misfit import causes, is_residual
from reports.plots.model import Axes, Manner
from reports.plots.of_procedures import plots


def misfits_part(panel: Panel, run: LiveRun, reader: Reader) -> None:
    """Build it; nothing where every record is as its model says."""
    found = [result for result in run.view.run.finished.values() if result.findings.get("misfit")]
    if not found:
        return
    title = reader.say(text("Beyond the model"))
    with named(ui.element("section").classes("mb-card mb-4"), title):
        ui.label(title).classes("text-lg font-semibold")
        for result in found:
            _one(result, reader.say(panel.offer.title(result.procedure)), reader)


def _one(result: ProcedureResult, title: str, reader: Reader) -> None:
    ui.label(title).classes("text-base font-semibold mt-2")
    rows = [told_again(row, reader.translate) for row in result.findings["misfit"]]
    for sentence in dict.fromkeys(f"{row['cause']}: {row['message']}" for row in rows):
        ui.label(sentence).classes("text-base py-1")
    named_causes = reader.say(lines(causes(result.findings), between=", "))
    record = ProcedureRecord(result.procedure, Text(title), result.section, {}, (), result)
    for plot in plots(record):
        for axes in (axes for row in plot.rows for axes in row if is_residual(axes)):
            ui.echart(residual_plot(axes, named_causes, reader)).classes("w-full h-64")


def residual_plot(axes: Axes, title: str, reader: Reader) -> dict[str, Any]:
    """Return the plot of what a fit leaves, the causes in its title."""
    say = reader.say
    labels = [
        f"{say(label)} / {unit}" if unit else say(label)
        for label, unit in ((axes.x_label, axes.x_unit), (axes.y_label, axes.y_unit))
    ]
    drawn = empty_axes(title, *labels)
    for curve in axes.curves:
        lone = curve.manner is Manner.READING
        series = line(say(curve.name), thinned(curve.x, curve.y), marks=lone)
        drawn["series"].append(series | ({"lineStyle": {"width": 0}} if lone else {}))
    return drawn
