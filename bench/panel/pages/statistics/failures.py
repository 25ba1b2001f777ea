"""Failures on the page of statistics: parameters and procedures by frequency, and other figures in which their motors stand out."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

from nicegui import ui

from bench.eol.statistics.proportion import pareto
from bench.eol.statistics_messages import association_words, percentage
from bench.panel.line_records import Bar
from bench.panel.pages.parts import beside, plot, table
from bench.panel.pages.reader import Reader
from bench.panel.pages.statistics.bar_motors import BarMotors
from bench.panel.statistics_plots import BARS, pareto_plot
from drivers.interfaces.text import Text, text
from reports.labels import ParameterLabels

if TYPE_CHECKING:
    from bench.eol.line_statistics import LineStatistics
    from bench.eol.store.tallies import Failures

#: Figures in which failed motors stand out, so many.
_SHOWN = 5


def show_failures(statistics: "LineStatistics", labels: ParameterLabels, reader: Reader, records: str) -> None:
    """Show plot and tables of what failed, and in which figures the motors that failed stand out."""
    by_parameter, by_procedure = statistics.by_parameter, statistics.by_procedure
    if not by_parameter and not by_procedure:
        motors = statistics.yields.motors
        again = motors.first_pass.hits < motors.first_pass.count
        message = text("Nothing failed in the end; some motors passed only when tried again.")
        ui.label(reader.say(message if again else text("Nothing failed."))).classes("text-base")
        return
    with beside():
        with ui.element("div"):
            if worst := [each for each in by_parameter if each.failed][:BARS]:
                chart = plot(pareto_plot(by_parameter, labels, reader.translate))
                bars = [(f"{reader.say(labels[each.name])}: {each.failed}", Bar(failed_at=each.name)) for each in worst]
                BarMotors(chart, records, statistics.selection, bars, reader)
        with ui.element("div").classes("flex flex-col flex-nowrap gap-4"):
            for title, failures in ((text("Parameter"), by_parameter), (text("Procedure"), by_procedure)):
                if failures:
                    _pareto(title, failures, labels, reader)
            for each in statistics.associations[:_SHOWN]:
                ui.label(reader.say(association_words(each, labels))).classes("text-base")


def _pareto(title: Text, failures: Sequence["Failures"], labels: ParameterLabels, reader: Reader) -> None:
    rows = [
        [
            reader.say(labels[each.name]),
            str(each.failed),
            percentage(row.share, 1),
            percentage(row.cumulative, 1),
            str(each.errors),
        ]
        for each, row in zip(failures, pareto([each.failed for each in failures]), strict=True)
    ]
    head = [title, text("Failed"), text("% of failures"), text("Cumulative, %"), text("Errors")]
    table([reader.say(words) for words in head], rows, numeric=frozenset({1, 2, 3, 4}))
