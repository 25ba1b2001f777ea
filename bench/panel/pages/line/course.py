"""The course of what fails most in a batch: its latest motors against the control limits, read from the records."""

from collections.abc import Mapping
from typing import Any

from nicegui import run as background
from nicegui import ui

from bench.panel.line_records import Choice, StatisticsView, read_statistics
from bench.panel.motor_records import motor_address
from bench.panel.pages.parts import named, plot
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import text

#: The records are read again at most so often (s): a line ends a motor every few seconds, and a drift takes hours.
_READ = 5.0


class Course:
    """The card of the chart, and what it says in words."""

    def __init__(self, records: str, reader: Reader) -> None:
        self._records, self._reader = records, reader
        self._wanted: tuple[str, int] = ("", 0)
        self._shown = self._wanted
        self._card = named(ui.element("section").classes("mb-card"), reader.say(text("Course of a figure")))
        self._card.props("data-part=course").set_visibility(False)
        ui.timer(_READ, self._read)

    def wanted(self, state: Mapping[str, Any]) -> None:
        """Hear how far the batch is."""
        self._wanted = (state["batch"], sum(state["counts"]["verdicts"].values()))

    async def _read(self) -> None:
        wanted = self._wanted
        if wanted == self._shown or wanted[1] < 2:
            return
        self._shown = wanted
        view = await background.io_bound(read_statistics, self._records, Choice(batch=wanted[0]))
        if view is not None and not self._card.is_deleted:
            self._show(view)

    def _show(self, view: StatisticsView) -> None:
        from bench.eol.statistics_messages import rule_words, scale_for, signals
        from bench.panel.statistics_plots import control_plot

        each = None if view.statistics is None else view.statistics.parameters.get(view.choice.parameter)
        chart = None if each is None else each.chart
        self._card.set_visibility(chart is not None)
        if each is None or chart is None:
            return
        say, name = self._reader.say, view.labels[each.distribution.parameter]
        broken = [rule_words(rule, chart) for rule in signals(each)]
        self._card.clear()
        with self._card:
            title = text("{parameter}, latest motors: {count}", parameter=name, count=len(each.values))
            ui.label(say(title)).classes("text-base font-semibold").props("role=heading aria-level=2")
            options = control_plot(each, name, self._reader.translate)
            # The parameter is the card's title; a long one would leave its axis.
            options["yAxis"]["name"] = scale_for(each).unit
            plot(options, lambda _, serial: _go_to(serial))
            for words in broken or [text("No rule is broken.")]:
                ui.label(say(words)).classes("text-base")


def _go_to(serial_number: str) -> None:
    ui.navigate.to(motor_address(serial_number))
