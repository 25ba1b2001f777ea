"""The plot of a run's measurement, at a place of the page that is there before it and keeps its size."""

from time import monotonic
from typing import Any

from nicegui import ui

from bench.panel.live.live_plot import AllReadings, options_of, to_go, with_readings
from bench.panel.pages.reader import Reader
from bench.panel.pages.run.gauge_view import GaugeView
from procedures.core.live_plot import LivePlot

#: Points that have come are drawn at most so often (s): drawing costs the browser more than digits do.
DRAWN = 0.25


class PlotArea:
    """The newest plot of a run with its readings; `small` beside other things."""

    def __init__(self, reader: Reader, *, small: bool = False) -> None:
        self._reader = reader
        self._small = small
        self._plot: LivePlot | None = None
        self._titled = ""
        self._newest: object = None
        self._drawn = 0.0
        self._options: dict[str, Any] = {}
        self._title = ui.label().classes("mb-plot-title")
        self._place = ui.element("div").classes("mb-plot-place").props("aria-hidden=true")
        self._chart: ui.echart | None = None
        self._to_go = ui.label().classes("mb-plot-now")
        self._words = ui.label().classes("mb-plot-words whitespace-pre-line")
        self._gauge = GaugeView(reader, brief=True)

    def show(self, plot: LivePlot, readings: AllReadings) -> None:
        """Show a plot at once where it is another one, else the points that have come, where they are due."""
        if plot is self._plot:
            if plot.coming is None or monotonic() - self._drawn < DRAWN:
                return
            kept = readings.get((plot.coming.instrument, plot.coming.quantity))
            newest = kept.times[-1] if kept else None
            if newest == self._newest:
                return
            self._newest = newest
        self._drawn = monotonic()
        self._plot = plot
        whole, say = with_readings(plot, readings), self._reader.say
        goal = to_go(whole)
        self._to_go.set_text(say(goal) if goal else "")
        self._words.set_text("\n".join(say(sentence) for sentence in (plot.said[:1] if self._small else plot.said)))
        self._gauge.show(plot.gauge)
        self._draw(say(plot.title), options_of(whole, say, small=self._small))

    def _draw(self, title: str, options: dict[str, Any]) -> None:
        if self._chart is None or title != self._titled:
            # What belonged to another plot would be merged into this one.
            self._titled = title
            self._title.set_text(title)
            self._place.clear()
            with self._place:
                self._chart = ui.echart(options).classes("mb-plot-chart")
            self._options = options
            return
        before, self._options = self._options, options
        self._chart.options.clear()
        self._chart.options.update(options)
        if _frame(before) == _frame(options):
            # Only points have come: nothing else need be sent.
            self._chart.run_chart_method("setOption", {"series": [{"data": options["series"][0]["data"]}]})
        else:
            self._chart.update()


def _frame(options: dict[str, Any]) -> dict[str, Any]:
    """Return the options without the points of the first curve."""
    first, *others = options["series"] or [{}]
    return {**options, "series": [{**first, "data": None}, *others]}
