"""The runs there are: found by words, opened, compared two by two or against the type."""

import math
import tomllib
from collections.abc import Mapping
from dataclasses import replace
from typing import Any
from urllib.parse import quote

from nicegui import run as background
from nicegui import ui

from bench.panel.archive import Archived, Figure
from bench.panel.pages.frame import frame
from bench.panel.pages.parts import named, table
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, text
from reports.tables.comparison import Compared, compare
from reports.tables.figures import decimals_for, figure, percent, scale_of

#: So many runs are shown; words find the rest.
_SHOWN = 200

STATUS: Mapping[str, Text] = {
    "completed": text("completed"),
    "failed": text("failed"),
    "aborted": text("was aborted"),
    "interrupted": text("was interrupted"),
}


def history_page(panel: Panel, session: Session) -> None:
    """Build the page."""
    with frame(panel, session, text("Runs"), "/history") as reader:
        _History(panel, reader).build()


class _History:
    def __init__(self, panel: Panel, reader: Reader) -> None:
        self._panel = panel
        self._reader = reader
        self._runs: list[Archived] = []
        self._chosen: list[str] = []
        self._labels: dict[str, Text] = {}

    def build(self) -> None:
        say = self._reader.say
        with ui.row().classes("w-full items-center gap-4 mb-3"):
            self._words = ui.input(say(text("Search")), on_change=self._show).props("outlined autofocus clearable")
            self._words.classes("grow").props["hint"] = say(
                text("Serial number, motor, date (20261121), person, parameter")
            )
            parameters = ui.select([], label=say(text("Show parameter")), on_change=self._show).props(
                "outlined clearable"
            )
            self._parameter = parameters.classes("w-64")
            ui.button(say(text("Compare the two chosen")), on_click=self._compare).props("outline")
        # It stands from the start, empty: what appears in it is read aloud.
        self._fault = ui.label().classes("mb-note").props("role=alert")
        self._count = ui.label().props("role=status")
        self._table = ui.element("div").classes("mb-card w-full")
        with self._table:
            ui.spinner(size="2rem")
        ui.timer(0.01, self._read, once=True)

    async def _read(self) -> None:
        self._runs = await background.io_bound(self._panel.archive.list) or []
        # Of two that say it differently, the newest run counts.
        self._labels = {}
        for run in reversed(self._runs):
            self._labels |= {name: lacking.label for name, lacking in run.withheld.items()}
            self._labels |= {name: figure.label for name, figure in run.figures.items()}
        self._parameter.set_options({name: self._reader.say(label) for name, label in sorted(self._labels.items())})
        self._show()

    def _show(self) -> None:
        say = self._reader.say
        runs = [run for run in self._runs if run.matches(str(self._words.value or ""), self._words_of(run))]
        if self._parameter.value:
            runs = [run for run in runs if self._parameter.value in {*run.figures, *run.withheld}]
        every = len(self._runs)
        of = (
            text("{found} of 1 run", found=len(runs))
            if every == 1
            else text("{found} of {all} runs", found=len(runs), all=every)
        )
        self._count.set_text(say(of))
        self._table.clear()
        with self._table, ui.element("table").classes("mb-table mb-runs"):
            self._head()
            with ui.element("tbody"):
                for run in runs[:_SHOWN]:
                    self._line(run)

    def _head(self) -> None:
        titles = [text("Compare"), text("Run"), text("Motor"), text("Serial number"), text("Operator"), text("Status")]
        with ui.element("thead"), ui.element("tr"):
            for title in titles:
                with ui.element("th").props("scope=col"):
                    ui.label(self._reader.say(title))
            if self._parameter.value:
                with ui.element("th").props("scope=col").classes("num"):
                    ui.label(self._reader.say(self._labels[self._parameter.value]))

    def _line(self, run: Archived) -> None:
        with ui.element("tr"):
            with ui.element("td"):
                box = ui.checkbox(
                    value=run.name in self._chosen, on_change=lambda event: self._choose(run.name, on=event.value)
                )
                named(box.props("dense"), self._reader.say(text("Choose {name}", name=run.name)))
            with ui.element("td"):
                ui.link(run.name, f"/runs/{quote(run.name, safe='')}")
            for words in (run.motor, run.serial_number, run.person, self._reader.say(_ended(run))):
                with ui.element("td"):
                    ui.label(words)
            if self._parameter.value:
                with ui.element("td").classes("num"):
                    ui.label(self._figure(run, self._parameter.value))

    def _words_of(self, run: Archived) -> list[str]:
        """Return what stands in the run's line, and what its parameters are called."""
        say = self._reader.say
        measured = (each.label for each in run.figures.values())
        lacking = (each.label for each in run.withheld.values())
        return [say(_ended(run)), *(say(label) for label in (*measured, *lacking))]

    def _figure(self, run: Archived, name: str) -> str:
        if name in run.figures:
            return _shown(run.figures[name])
        return self._reader.say(text("withheld: {cause}", cause=run.withheld[name].cause))

    def _choose(self, name: str, *, on: bool) -> None:
        self._chosen = [chosen for chosen in self._chosen if chosen != name] + ([name] if on else [])
        self._fault.set_text("")

    def _compare(self) -> None:
        if len(self._chosen) != 2:
            fault = text("Choose two runs in the list, by their boxes. Chosen now: {count}.", count=len(self._chosen))
            self._fault.set_text(self._reader.say(fault))
            return
        ui.navigate.to("/".join(("/compare", *(quote(name, safe="") for name in self._chosen))))


def _ended(run: Archived) -> Text:
    ended = STATUS.get(run.status, Text("{status}", {"status": run.status}))
    return text("{status}, {count} withheld", status=ended, count=len(run.withheld)) if run.withheld else ended


def compare_page(panel: Panel, session: Session, first: str, second: str) -> None:
    """Build the comparison of two runs; `second` is `type` for the type values of the first one's motor file."""
    with frame(panel, session, text("Compare"), "/history") as reader:
        say = reader.say
        known = {run.name: run for run in panel.archive.list()}
        missing = [name for name in (first, second) if name not in known and name != "type"]
        if missing:
            ui.label(say(text("There is no run {name}.", name=missing[0]))).classes("text-xl")
            return
        other = _type_figures(panel, first, known[first].figures) if second == "type" else known[second].figures
        names = [first, say(text("Type values")) if second == "type" else second]
        ui.label(" ↔ ".join(names)).classes("text-2xl font-bold")
        # Two runs are told apart by their motors, not by when they began.
        motors = [known[name] for name in (first, second) if name in known]
        told = (" · ".join(part for part in (run.motor, run.serial_number) if part) for run in motors)
        ui.label(" ↔ ".join(told)).classes("text-base mb-3")
        compared = compare(known[first].figures, other)
        with ui.element("section").classes("mb-card"):
            if not compared and second == "type" and not other:
                words = text(
                    "The motor's file has no type values for what was measured; its table [expected] holds them."
                )
                ui.label(say(words))
                return
            if not compared:
                ui.label(say(text("They have no parameter in common.")))
                return
            _compared_table(compared, known[first].figures, names, reader)
            ui.label(
                say(text("E_n: difference over its expanded uncertainty (k = 2); above 1 the two disagree."))
            ).classes("text-sm mt-2")


def _compared_table(compared: list[Compared], figures: Mapping[str, Figure], names: list[str], reader: Reader) -> None:
    say = reader.say
    head = [say(text("Parameter")), *names, say(text("Unit")), say(text("Difference, %")), "E_n", ""]
    lines = []
    for pair in compared:
        scale = scale_of(pair.first, figures[pair.name].reader_unit)
        values = [v / scale.factor for v in (pair.first, pair.second)]
        counts = all(value == round(value) for value in values)
        decimals = 0 if counts else decimals_for(0.0, values[0]) + 1
        lines.append(
            [
                say(figures[pair.name].label),
                *(figure(value, decimals) for value in values),
                scale.unit,
                _signed(100.0 * pair.difference),
                _signed(pair.normalised_error),
                say(text("disagree")) if pair.disagree else "",
            ]
        )
    table(head, lines, numeric=frozenset({1, 2, 4, 5}), stacked=True)


def _type_figures(panel: Panel, run: str, figures: Mapping[str, Figure]) -> dict[str, Figure]:
    """Return the type values of a run's motor file; they are taken as exact."""
    begun = next(iter(panel.beginning(run)), {})
    try:
        expected: Mapping[str, Any] = tomllib.loads(str(begun.get("motor_file", ""))).get("expected", {})
    except tomllib.TOMLDecodeError:
        expected = {}
    return {
        name: replace(figures[name], value=float(value), uncertainty=0.0)
        for name, value in expected.items()
        if name in figures
    }


def _shown(shown: Figure) -> str:
    scale = scale_of(shown.value, shown.reader_unit)
    value, spread = shown.value / scale.factor, shown.uncertainty / scale.factor
    share = percent(abs(spread / value)) if value else "–"
    return f"{figure(value, decimals_for(spread, value))} {scale.unit}, u {share} %"


def _signed(value: float) -> str:
    return f"{value:+.2f}".replace("-", "−") if math.isfinite(value) else "–"
