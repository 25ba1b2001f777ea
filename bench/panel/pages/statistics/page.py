"""Statistics of motors, process and station from the line's records: yields, failures, capability, charts."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Any
from urllib.parse import urlencode

from nicegui import events, ui
from nicegui import run as background

from bench.eol.line.batch_log import broken_off
from bench.eol.statistics_messages import (
    bounds,
    distribution_words,
    drift_figures,
    drift_words,
    false_alarm_words,
    indices,
    rule_words,
    scale_for,
    share_outside,
    signals,
    stated_limits,
)
from bench.panel.line_records import ALL, Choice, StatisticsView, read_statistics, serial_numbers
from bench.panel.motor_records import motor_address
from bench.panel.pages.frame import frame
from bench.panel.pages.parts import Links, beside, expansion, link_row, named, plot, table
from bench.panel.pages.reader import Reader
from bench.panel.pages.statistics.bar_motors import BarMotors
from bench.panel.pages.statistics.failures import show_failures
from bench.panel.pages.statistics.yields import show_grouped_yields, show_yields
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from bench.panel.statistics_plots import control_plot, golden_names, golden_plot, histogram_bars, histogram_plot
from drivers.interfaces.text import Text, text
from reports.labels import ParameterLabels
from reports.tables.figures import decimals_for, figure

if TYPE_CHECKING:
    from bench.eol.line_statistics import LineStatistics, ParameterStatistics
    from bench.eol.store.selection import Selection

_TO_GROUPING = "setTimeout(() => document.querySelector('[data-part=yield-by] input')?.focus(), 50)"
#: So many motors that break a rule are named beside it.
_LINKED = 5
_STYLE = """
<style>
  .mb-yield { font-size: 2.6rem; line-height: 1.15; font-weight: 700; font-variant-numeric: tabular-nums; }
  .mb-beside { display: grid; gap: 1rem; grid-template-columns: minmax(0, 3fr) minmax(0, 2fr); align-items: start; }
  @media (max-width: 1000px) { .mb-beside { grid-template-columns: minmax(0, 1fr); } }
</style>
"""


def statistics_page(panel: Panel, session: Session, choice: Choice) -> None:
    """Build the page."""
    with frame(panel, session, text("Statistics"), "/statistics") as reader:
        ui.add_head_html(_STYLE)
        _Statistics(panel, reader, choice).build()


class _Statistics:
    def __init__(self, panel: Panel, reader: Reader, choice: Choice) -> None:
        self._panel, self._reader, self._choice = panel, reader, choice
        self._asked = 0
        self._labels = ParameterLabels({})

    def build(self) -> None:
        say = self._reader.say
        with named(ui.element("section").classes("mb-card w-full mb-4"), say(text("What is shown"))):
            with ui.row().classes("w-full items-center gap-4"):
                self._model = self._select(text("Motor type"), "model", batch=None, parameter="")
                self._batch = self._select(text("Batch"), "batch")
                self._parameter = self._select(text("Parameter"), "parameter")
                golden = ui.input(say(text("Golden motors (serial numbers)")), value=", ".join(self._choice.golden))
                golden.props("outlined dense").classes("w-72")
                for event in ("keydown.enter", "blur"):
                    golden.on(event, lambda: self._change(golden=serial_numbers(str(golden.value or ""))))
                ui.button(say(text("Read again")), on_click=self._read).props("outline no-caps")
                ui.link(say(text("One motor's tests")), "/motors").classes("mb-link text-base")
            self._status = ui.label().props("role=status").classes("text-base mt-2 whitespace-pre-line")
        self._fault = ui.label().props("role=alert").classes("mb-card mb-told whitespace-pre-line")
        self._content = ui.element("div").classes("w-full flex flex-col flex-nowrap gap-4")
        ui.timer(0.01, self._read, once=True)

    async def _read(self) -> None:
        self._asked += 1
        asked = self._asked
        self._status.set_text(self._reader.say(text("Reading the records …")))
        view = await background.io_bound(read_statistics, self._panel.records, self._choice)
        # Whoever chooses again before the answer is there wants the later one.
        if view is not None and asked == self._asked:
            self._show(view)

    def _show(self, view: StatisticsView) -> None:
        say, statistics = self._reader.say, view.statistics
        self._choice, self._labels = view.choice, view.labels
        self._offer(view)
        words = "" if statistics is None else say(_selected(statistics))
        if statistics is not None and view.choice.batch and broken_off(self._panel.runs / view.choice.batch):
            words += f"\n{say(text('This batch was broken off and not begun again: with its plan and its name it goes on.'))}"
        if statistics is not None and statistics.joined is not None:
            words += f"\n{say(statistics.joined)}"
        self._status.set_text(words)
        self._fault.set_text("" if view.fault is None else say(view.fault))
        # That nobody has measured yet is no fault.
        self._fault.classes(add="mb-wrong") if view.refused else self._fault.classes(remove="mb-wrong")
        self._content.clear()
        if statistics is None:
            return
        with self._content:
            with ui.element("div").classes("grid gap-4 grid-cols-1 lg-grid-cols-2 w-full"):
                with self._card(text("Yield"), "yield"):
                    show_yields(statistics.yields, self._reader)
                each = statistics.parameters.get(view.choice.parameter) if view.fault is None else None
                if each is not None:
                    self._capability(each)
            with self._card(text("Yield by …"), "yield-by"):
                show_grouped_yields(statistics.yields.motors, view.choice.by, self._reader, self._group)
            with self._card(text("Failures"), "failures"):
                show_failures(statistics, self._labels, self._reader, self._panel.records)
            if each is not None:
                self._histogram(each, statistics.selection)
                self._chart(each)
                self._golden(each)

    # what is chosen

    def _offer(self, view: StatisticsView) -> None:
        say, choice = self._reader.say, view.choice
        self._model.set_visibility(len(view.models) > 1)
        batches = {ALL: say(text("All batches")), **{name: name for name in view.batches}}
        parameters = {name: say(self._labels[name]) for name in view.parameters}
        for select, options, value in (
            (self._model, {model: model for model in view.models}, choice.model),
            (self._batch, batches, choice.batch),
            (self._parameter, parameters, choice.parameter),
        ):
            select.set_options(options, value=value if value in options else None)

    def _select(self, label: Text, key: str, **others: str | None) -> ui.select:
        async def chosen(event: events.ValueChangeEventArguments[str | None]) -> None:
            # The page itself sets what was chosen already, and nothing where it has nothing to offer.
            if event.value is not None and event.value != getattr(self._choice, key):
                await self._change(**{key: event.value}, **others)

        select = ui.select({}, label=self._reader.say(label), on_change=chosen)
        return select.props("outlined dense").classes("w-72")

    async def _change(self, **changed: Any) -> None:
        choice = replace(self._choice, **changed)
        if choice == self._choice:
            return
        self._choice = choice
        asked: dict[str, str] = {
            "model": choice.model,
            "parameter": choice.parameter,
            "golden": ",".join(choice.golden),
            "by": "" if choice.by == Choice.by else choice.by,
        }
        asked = {key: value for key, value in asked.items() if value}
        if choice.batch is not None:
            asked["batch"] = choice.batch
        # The address says what is shown: it can be kept, sent, and read in another language.
        ui.navigate.history.replace(f"/statistics?{urlencode(asked)}")
        await self._read()

    async def _group(self, by: str) -> None:
        await self._change(by=by)
        # The choice was built anew with its table; whoever has no mouse goes on where he was.
        with self._content:
            ui.run_javascript(_TO_GROUPING)

    # the parts

    def _capability(self, each: "ParameterStatistics") -> None:
        say, distribution = self._reader.say, each.distribution
        with self._card(text("Capability: {parameter}", parameter=self._labels[distribution.parameter]), "capability"):
            rows = [[name, shown] for name, shown in zip(("Cp", "Cpk", "Pp", "Ppk"), indices(each), strict=True)]
            rows.append([say(text("Outside, %")), share_outside(each, 0.95)])
            self._table([text("Index"), text("Value [95 % interval]")], rows, numeric={1})
            words = text("Cp and Cpk by the spread between neighbours, Pp and Ppk by the spread of all.")
            ui.label(say(words)).classes("text-sm mt-2")
            if (other := distribution_words(each, self._labels[distribution.parameter])) is not None:
                ui.label(say(other)).classes("text-base mt-2")
            if distribution.changed:
                changed = text("The limits have changed; those of the latest motor are shown.")
                ui.label(say(changed)).classes("text-base mt-2")

    def _histogram(self, each: "ParameterStatistics", selection: "Selection") -> None:
        distribution, scale = each.distribution, scale_for(each)
        spread = distribution.standard_deviation / scale.factor
        digits = decimals_for(spread, distribution.mean / scale.factor)
        name = self._labels[distribution.parameter]
        rows = [
            (text("Motors"), str(distribution.count)),
            (text("Limits"), stated_limits(distribution.limits.low, distribution.limits.high, scale, digits)),
            (text("Mean"), figure(distribution.mean / scale.factor, digits)),
            (text("Standard deviation, all"), figure(spread, digits + 1)),
            (text("Standard deviation, neighbours"), figure(each.within.standard_deviation / scale.factor, digits + 1)),
            (text("Least … most"), bounds(distribution.least, distribution.most, scale, digits)),
        ]
        with self._card(text("Distribution: {parameter}", parameter=name), "distribution"), beside():
            with ui.element("div"):
                chart = plot(histogram_plot(each, name, self._reader.translate))
                BarMotors(chart, self._panel.records, selection, histogram_bars(each), self._reader)
            with ui.element("div"):
                head = [name, Text("{unit}", {"unit": scale.unit})]
                self._table(head, [[self._reader.say(words), value] for words, value in rows], numeric={1})

    def _chart(self, each: "ParameterStatistics") -> None:
        say, chart, scale = self._reader.say, each.chart, scale_for(each)
        name = self._labels[each.distribution.parameter]
        title = text(
            "Control chart: {parameter}, latest motors: {count}",
            parameter=name,
            count=len(each.values),
        )
        with self._card(title, "chart"):
            if chart is None:
                ui.label(say(text("A control chart needs two motors at least."))).classes("text-base")
                return
            plot(control_plot(each, name, self._reader.translate), lambda _, serial: _go_to(serial))
            with expansion(say(text("Motors of the chart: figures and runs"))):
                link_row(_links(each.serial_numbers))
            digits = decimals_for(chart.sigma / scale.factor, chart.centre / scale.factor)
            line = text(
                "Centre {centre}, control limits {limits} {unit} ({reach} sigma by the moving range)",
                reach=f"{chart.reach:.3g}" if math.isfinite(chart.reach) else "–",
                centre=figure(chart.centre / scale.factor, digits),
                limits=bounds(chart.low, chart.high, scale, digits),
                unit=scale.unit,
            )
            ui.label(say(line)).classes("text-base my-2")
            ui.label(say(false_alarm_words(chart, len(each.values), named=False))).classes("text-base my-2")
            broken = signals(each)
            if not broken:
                ui.label(say(text("No rule is broken."))).classes("text-base")
                return
            rows: list[list[str | Links]] = [
                [say(rule_words(rule, chart)), str(len(at)), _links(at[-_LINKED:])] for rule, at in broken.items()
            ]
            self._table(
                [text("Broken rule"), text("Points"), text("Serial numbers, the latest last")], rows, numeric={1}
            )

    def _golden(self, each: "ParameterStatistics") -> None:
        say, scale = self._reader.say, scale_for(each)
        missing = [name for name in self._choice.golden if name not in {g.serial_number for g in each.golden}]
        if not each.golden and not missing:
            return
        name = self._labels[each.distribution.parameter]
        with self._card(text("Golden motors: {parameter}", parameter=name), "golden"):
            if each.golden:
                names = golden_names(each)
                drawn = golden_plot(each, name, self._reader.translate)
                plot(drawn, lambda series, _: _go_to(names[series].serial_number))
                rows: list[list[str | Links]] = []
                for golden in names.values():
                    figures = drift_figures(golden, scale)
                    slope = f"{figures['slope']} [{figures['low']}, {figures['high']}]"
                    shown = [figures["mean"], figures["s"], slope, say(drift_words(golden.drift))]
                    where = f"{golden.station} · {golden.socket}"
                    rows.append([_links([golden.serial_number]), where, str(golden.drift.count), *shown])
                head = [text("Motor"), text("Socket"), text("Times"), text("Mean"), Text("s")]
                head += [text("Drift a day [95 % interval]"), text("Finding")]
                self._table(head, rows, numeric={2, 3, 4, 5})
                ui.label(say(text("Figures in {unit}.", unit=scale.unit or "1"))).classes("text-sm mt-2")
            if missing:
                words = text("There are no figures of: {names}", names=", ".join(missing))
                ui.label(say(words)).classes("text-base")

    # what they are made of

    def _card(self, title: Text, part: str) -> ui.element:
        words = self._reader.say(title)
        card = named(ui.element("section").classes("mb-card w-full"), words)
        card.props["data-part"] = part
        with card:
            ui.label(words).classes("text-lg font-semibold mb-2").props("role=heading aria-level=2")
        return card

    def _table(self, head: Sequence[Text], rows: Sequence[Sequence[str | Links]], *, numeric: set[int]) -> None:
        table([self._reader.say(t) for t in head], rows, numeric=frozenset(numeric))


def _links(serial_numbers: Sequence[str]) -> Links:
    return tuple((serial, motor_address(serial)) for serial in serial_numbers)


def _go_to(serial_number: str) -> None:
    ui.navigate.to(motor_address(serial_number))


def _selected(statistics: "LineStatistics") -> Text:
    selection = statistics.selection
    return text(
        "{model}, motors: {count}, batches: {names}",
        model=selection.model,
        count=selection.count,
        names=", ".join(selection.batches[:5]) + (" …" if len(selection.batches) > 5 else ""),
    )
