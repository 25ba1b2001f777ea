"""The live reading, in digits that can be read from the bench, and its course."""

from time import monotonic

from nicegui import ui

from bench.panel.live_run import LiveRun
from bench.panel.pages.frame import Reader
from bench.panel.pages.roles import role_name
from bench.panel.plots import axes, line, thinned
from procedures.text import text
from reports.figures import decimals_for, figure, scale_of

#: A plot is drawn anew at most so often (s): drawing costs the browser more than digits do.
_PLOT = 0.25


class ReadingCard:
    """The newest reading and the plot of its kind."""

    def __init__(self, run: LiveRun, reader: Reader) -> None:
        self._run = run
        self._reader = reader
        self._plotted = 0.0
        self._dirty = False
        say = reader.say
        with ui.element("section").classes("mb-card").props(f'aria-label="{say(text("Live reading"))}"'):
            self._what = ui.label(say(text("No reading yet"))).classes("text-base").style("color:#44505c")
            self._value = ui.label("–").classes("text-5xl font-bold mb-number").props("data-reading")
            self._chart = ui.echart(axes("", say(text("bench time / s")), "")).classes("w-full h-64")

    def show(self) -> None:
        """Show the newest reading at once, the plot when it is due."""
        latest = self._run.view.latest
        if latest is None:
            return
        (instrument, call), value, unit = latest
        scale = scale_of(value, unit)
        shown = value / scale.factor
        self._what.set_text(f"{self._reader.say(role_name(instrument))} · {call.replace('_', ' ')}")
        self._value.set_text(f"{figure(shown, min(decimals_for(0.0, shown), 6))} {scale.unit}")
        self._dirty = True
        self.tick()

    def tick(self) -> None:
        """Draw the plot where there is something new and the last drawing is old enough."""
        latest = self._run.view.latest
        if not self._dirty or latest is None or monotonic() - self._plotted < _PLOT:
            return
        self._plotted, self._dirty = monotonic(), False
        kept = self._run.view.readings[latest[0]]
        options = axes("", self._reader.say(text("bench time / s")), kept.unit)
        options["series"] = [
            line(latest[0][1], thinned(list(kept.times), list(kept.values), 600), marks=len(kept.values) < 60)
        ]
        self._chart.options.clear()
        self._chart.options.update(options)
        self._chart.update()
