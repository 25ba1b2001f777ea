"""A run's waveforms: chosen from a list, drawn by their extremes, drawn anew where one zooms in."""

from collections.abc import Mapping
from typing import Any

from nicegui import events, ui
from nicegui import run as background

from bench.journal.waveforms import StoredWaveform, read_waveform
from bench.panel.live.live_run import LiveRun
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.plots import waveform_plot
from drivers.interfaces.text import text


class WaveformsPart:
    """The list of records and the plot of the one that is chosen."""

    def __init__(self, panel: Panel, run: LiveRun, reader: Reader) -> None:
        self._panel = panel
        self._run = run
        self._reader = reader
        self._waves: dict[str, StoredWaveform] = {}

    def build(self) -> None:
        """Build it; nothing where the run has no waveforms."""
        say = self._reader.say
        records = {
            number: f"{number + 1} · {say(self._panel.offer.title(record.procedure))} · {record.step}"
            for number, record in enumerate(self._run.view.waveforms)
        }
        if not records:
            return
        with named(ui.element("section").classes("mb-card mb-4"), say(text("Waveforms"))):
            ui.label(say(text("Waveforms"))).classes("text-lg font-semibold")
            ui.select(records, label=say(text("Record")), on_change=self._choose).props("outlined dense").classes(
                "w-96"
            )
            self._fault = ui.label().props("role=alert")
            self._chart = ui.echart({}).classes("w-full h-96")
            self._chart.set_visibility(False)
            self._chart.on("chart:datazoom", self._zoomed, throttle=0.1, leading_events=False)

    async def _choose(self, event: events.ValueChangeEventArguments[int]) -> None:
        record = self._run.view.waveforms[event.value]
        try:
            self._waves = await background.io_bound(self._read, record.taken.value) or {}
        except (OSError, KeyError) as error:
            self._fault.set_text(self._reader.say(text("The record cannot be read: {error}", error=error)))
            return
        self._draw(None, None)
        self._chart.set_visibility(True)

    def _read(self, channels: Mapping[str, Any]) -> dict[str, StoredWaveform]:
        return {
            self._reader.say(text("channel {number}", number=name)): self._one(part["waveform"])
            for name, part in channels.items()
        }

    def _one(self, reference: str) -> StoredWaveform:
        return read_waveform(self._run.folder.path / reference.partition("#")[0], reference)

    def _draw(self, start: float | None, end: float | None) -> None:
        options = waveform_plot(self._waves, start=start, end=end)
        if start is not None:
            # The window stays where the reader has put it.
            options.pop("dataZoom")
        self._chart.options.clear()
        self._chart.options.update(options)
        self._chart.update()

    def _zoomed(self, event: events.GenericEventArguments) -> None:
        if not self._waves:
            return
        zoom = (event.args.get("batch") or [event.args])[0]
        times = next(iter(self._waves.values())).time
        span = float(times[-1] - times[0])
        start, end = (float(times[0]) + span * float(zoom[edge]) / 100.0 for edge in ("start", "end"))
        self._draw(start, end)
