"""The batches that go on beside each other, other sockets each: one of them is on the page, the others a click away."""

from collections.abc import Sequence
from urllib.parse import urlencode

from nicegui import ui

from bench.panel.live.live_line import BatchLine
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text


class BatchList:
    """A row of links, there where there is something to choose."""

    def __init__(self, reader: Reader) -> None:
        self._reader = reader
        self._row = named(ui.element("nav").classes("mb-batches"), reader.say(text("Batches")))

    def show(self, batches: Sequence[BatchLine], shown: BatchLine | None) -> None:
        """Show the batches, and which of them the page is of."""
        self._row.set_visibility(any(batch is not shown for batch in batches))
        self._row.clear()
        with self._row:
            for batch in batches:
                link = ui.link(target=f"/line?{urlencode({'batch': batch.folder.name})}").classes("mb-batch")
                link.props("aria-current=page" if batch is shown else "")
                with link:
                    ui.label(batch.folder.name).classes("text-lg font-semibold")
                    ui.label(self._reader.say(_doing(batch))).classes("text-base")


def _doing(batch: BatchLine) -> Text:
    if not batch.alive:
        return text("broken off")
    sockets = [] if batch.state is None else batch.state["sockets"]
    measured = [str(socket["name"]) for socket in sockets if socket["serial_number"]]
    return text("measures: socket {names}", names=measured) if measured else text("No socket measures.")
