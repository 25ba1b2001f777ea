"""A gauge: the band that a hand is to reach, and a needle that shows where the value is."""

from nicegui import ui

from bench.panel.gauge import shown_gauge
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from procedures.core.live_plot import Gauge


class GaugeView:
    """The gauge at one place of the page, hidden where there is none; a `brief` one has its reading in the line of the verdict."""

    def __init__(self, reader: Reader, *, brief: bool = False) -> None:
        self._reader = reader
        self._brief = brief
        self._shown: Gauge | None = None
        with ui.element("div").classes("mb-gauge").props("role=img") as self._box:
            with ui.element("div").classes("mb-gauge-head"):
                self._quantity = ui.label()
                self._verdict = ui.label().classes("mb-gauge-verdict")
            self._reading = ui.label().classes("mb-gauge-reading")
            with ui.element("div").classes("mb-gauge-bar"):
                self._band = ui.element("i").props("data-mark=band")
                self._needle = ui.element("i").props("data-mark=needle")
            self._limits = ui.label().classes("mb-gauge-limits")
        self._box.set_visibility(False)

    def show(self, gauge: Gauge | None) -> None:
        """Show it where it has changed."""
        if gauge == self._shown:
            return
        self._shown = gauge
        self._box.set_visibility(gauge is not None)
        if gauge is None:
            return
        say, shown = self._reader.say, shown_gauge(gauge)
        quantity, verdict = say(gauge.quantity), say(shown.verdict)
        self._quantity.set_text(quantity[:1].upper() + quantity[1:])
        self._verdict.set_text(f"{shown.reading} · {verdict}" if self._brief else verdict)
        self._reading.set_text(shown.reading)
        self._limits.set_text(shown.band)
        self._band.style["left"] = f"{shown.low:.1f}%"
        self._band.style["width"] = f"{shown.high - shown.low:.1f}%"
        self._needle.style["left"] = f"{shown.at:.1f}%"
        self._band.update()
        self._needle.update()
        self._box.props["data-place"] = shown.place.value
        named(self._box, f"{quantity}: {shown.reading}, {verdict}, {shown.band}").update()
