"""The live reading, in digits that can be read from the bench, and its course."""

import math
from collections.abc import Sequence
from datetime import UTC, datetime
from time import monotonic

from nicegui import ui

from bench.panel.live.live_run import LiveRun
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.pages.run.plot_area import DRAWN, PlotArea
from bench.panel.plots import axes, line, thinned
from drivers.catalogue import MANUAL
from drivers.interfaces.text import text
from reports.labels import role_name
from reports.tables.figures import decimals_for, figure, scale_of

#: A reading younger than this (s) is of this moment.
_LIVE = 2.0


class ReadingCard:
    """The newest reading and the plot of its kind."""

    def __init__(self, run: LiveRun, reader: Reader) -> None:
        self._run = run
        self._reader = reader
        self._plotted = 0.0
        self._dirty = False
        say = reader.say
        self._arrived: float | None = None
        self._newest: object = None
        with named(ui.element("section").classes("mb-card"), say(text("Live reading"))) as self._card:
            with ui.element("div").classes("mb-what"):
                self._what = ui.label(say(text("No reading yet")))
                self._age = ui.label().props("data-age")
            with ui.element("div").classes("mb-reading"):
                self._value = ui.label("–").classes("mb-big").props("data-reading")
            with ui.element("div").classes("mb-side-plot mb-trend") as self._trend:
                self._chart = ui.echart(axes("", say(text("bench time / s")), "")).classes("mb-chart")
                self._chart.props("aria-hidden=true")
            with ui.element("div").classes("mb-side-plot") as self._beside:
                self._plot = PlotArea(reader, small=True)
            self._beside.set_visibility(False)

    def show(self, *, plotted: bool) -> None:
        """Show the newest reading at once, the plot when it is due; its course, where the run's plot is `plotted` elsewhere."""
        self._beside.set_visibility(not plotted and self._run.line.plot is not None)
        self._trend.set_visibility(not self._beside.visible)
        say, latest = self._reader.say, self._run.view.latest
        self._card.classes(add="mb-unread") if latest is None else self._card.classes(remove="mb-unread")
        if latest is None:
            self._what.set_text(say(text("No reading yet")))
            self._value.set_text("–")
            self._arrived = None
        else:
            values, unit = _for_people([latest.values[-1]], latest.unit)
            scale = scale_of(values[0], unit)
            shown = values[0] / scale.factor
            newest = (latest.instrument, str(latest.quantity), latest.times[-1], len(latest.times))
            if newest != self._newest:
                self._newest, self._arrived = newest, monotonic()
            self._what.set_text(f"{say(role_name(latest.instrument))} · {say(latest.quantity)}")
            self._value.set_text(f"{figure(shown, min(decimals_for(0.0, shown), 6))} {scale.unit}")
        self._dirty = True
        self.tick()

    def tick(self) -> None:
        """Draw the plot where there is something new and the last drawing is old enough."""
        self._age.set_text(self._aged())
        plot = self._run.line.plot
        if plot is not None and self._beside.visible:
            self._plot.show(plot, self._run.view.readings)
            return
        # Beside the plot of the same readings the course is drawn now and then.
        wait = DRAWN if plot is None else 4.0 * DRAWN
        if not self._dirty or monotonic() - self._plotted < wait:
            return
        self._plotted, self._dirty = monotonic(), False
        say, latest = self._reader.say, self._run.view.latest
        options = axes("", say(text("bench time / s")), "")
        if latest is not None:
            values, unit = _for_people(list(latest.values), latest.unit)
            scale = scale_of(max(map(abs, values)), unit)
            # The digits above may be another quantity's by now.
            options = axes("", say(text("bench time / s")), f"{say(latest.quantity)} / {scale.unit}")
            points = thinned(list(latest.times), [value / scale.factor for value in values], 600)
            options["series"] = [line(say(latest.quantity), points, marks=len(values) < 60)]
        self._chart.options.clear()
        self._chart.options.update(options)
        self._chart.update()

    def _aged(self) -> str:
        say = self._reader.say
        if self._arrived is None:
            return ""
        view = self._run.view
        if view.outdated:
            return say(text("before switching off"))
        # It may have stood there before this page came; and a clock that was set back makes nothing young.
        recorded = datetime.now(UTC) - datetime.fromisoformat(view.latest_wall)
        age = max(monotonic() - self._arrived, recorded.total_seconds())
        opened = None if view.latest is None else view.instruments.get(view.latest.instrument)
        if opened is not None and opened.driver == MANUAL:
            return say(text("typed {age} s ago", age=f"{age:.0f}"))
        return say(text("● live")) if age < _LIVE else say(text("{age} s old", age=f"{age:.0f}"))


def _for_people(values: Sequence[float], unit: str) -> tuple[list[float], str]:
    """Return speeds in revolutions a minute, which tachometers show; all else as it is."""
    if unit == "rad/s":
        return [value * 30.0 / math.pi for value in values], "rpm"
    return list(values), unit
