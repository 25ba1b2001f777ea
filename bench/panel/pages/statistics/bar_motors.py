"""The motors of a plot's bar: by pressing the bar, or by choosing it from a list."""

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

from nicegui import events, ui
from nicegui import run as background

from bench.panel.line_records import motors_of_bar
from bench.panel.motor_records import motor_address
from bench.panel.pages.parts import link_row
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text

if TYPE_CHECKING:
    from bench.eol.store.selection import Selection
    from bench.panel.line_records import Bar

#: Motors of a bar that are named; the command line finds the rest.
_MOST = 50


class BarMotors:
    """A list of bars, each with its words, that is shown with the links to the chosen one's motors."""

    def __init__(
        self, chart: ui.echart, records: str, selection: "Selection", bars: Sequence[tuple[str, "Bar"]], reader: Reader
    ) -> None:
        self._reader, self._bars = reader, bars
        self._read: Callable[[Bar], list[str] | Text] = lambda bar: motors_of_bar(records, selection, bar, _MOST)
        words = {number: said for number, (said, _) in enumerate(bars)}
        self._select = ui.select(words, label=reader.say(text("Motors of a bar")), on_change=self._chosen)
        self._select.props("outlined dense").classes("w-72 mt-2")
        self._place = ui.element("div").props("role=status").classes("mt-2")
        # The line of the shares has a point to each bar too.
        chart.on_point_click(lambda event: self._select.set_value(event.data_index))

    async def _chosen(self, event: events.ValueChangeEventArguments[int | None]) -> None:
        if event.value is None:
            return
        found = await background.io_bound(self._read, self._bars[event.value][1])
        if found is None or self._place.is_deleted or event.value != self._select.value:
            return
        say = self._reader.say
        self._place.clear()
        with self._place:
            if isinstance(found, Text):
                ui.label(say(found)).classes("mb-note")
                return
            link_row(tuple((serial, motor_address(serial)) for serial in found))
            if len(found) == _MOST:
                ui.label(say(text("There may be more: the first {count} are shown.", count=_MOST))).classes("text-sm")
