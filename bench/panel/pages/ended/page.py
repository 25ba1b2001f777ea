"""The result of a run, and the actions that it allows."""

import asyncio
from datetime import UTC, datetime
from urllib.parse import quote, urlencode

from nicegui import ui

from bench.i18n.errors import InputError
from bench.journal.events.run import MotorReference
from bench.journal.journal_file import read_journal
from bench.panel.bench_state import StateKind, state_at_end
from bench.panel.live.live_run import LiveRun
from bench.panel.motor_of import type_values_of
from bench.panel.pages.by_hand import read_part
from bench.panel.pages.ended.attention import AttentionPart
from bench.panel.pages.ended.budgets import budgets_part
from bench.panel.pages.ended.fits import fits_part
from bench.panel.pages.ended.parameter_picture import parameter_picture
from bench.panel.pages.ended.products import ProductsPart
from bench.panel.pages.ended.sign_off import SignOffPart
from bench.panel.pages.ended.waveforms import WaveformsPart
from bench.panel.pages.parts import expansion, named, table, untaken_note
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from bench.plugins.files import catalogues_of_run
from drivers.interfaces.text import Text, text
from procedures.plausibility.type_tolerance import Conformity
from reports.tables.attention import Rank, ranked
from reports.tables.deviation import deviations
from reports.tables.summary import rows

#: The plots come after the page: it is to be read at once.
_LATER = 0.1
#: A shorter time (s) is said in seconds.
_IN_SECONDS = 300.0
_TO_SIGNATURES = "const part = document.getElementById('signatures'); (part.querySelector('input') ?? part).focus()"


def ended_part(panel: Panel, session: Session, run: LiveRun, reader: Reader) -> None:
    """Build the results of a run that has ended."""
    _Ended(panel, session, run, reader).build()


class _Ended:
    def __init__(self, panel: Panel, session: Session, run: LiveRun, reader: Reader) -> None:
        self._panel = panel
        self._session = session
        self._run = run
        self._reader = reader
        view = run.view.run
        # Nobody takes up commands where they ended.
        self._manual = any(panel.offer.is_manual(name) for name in view.planned)
        # A batch's motor is measured again at its line.
        self._may_lead = session.may_lead and not panel.of_batch(run)
        self._exports = catalogues_of_run(view.start.software if view.start is not None else {}).exports
        self._parameters = view.parameters()
        self._rows = deviations(self._parameters, *type_values_of(view.start))
        self._found = ranked(self._parameters, view.warnings(), view.results)

    def build(self) -> None:
        untouched = ui.element("div").classes("w-full")
        ui.timer(_LATER, lambda: self._say_if_changed(untouched), once=True)
        self._outcome()
        with named(ui.element("section").classes("mb-card mb-4"), self._reader.say(text("Result"))):
            headline = ui.label(self._reader.say(self._headline())).classes("text-3xl font-bold")
            headline.props("role=heading aria-level=1 tabindex=-1 data-result")
            self._actions(headline)
            untaken_note(self._reader)
            self._fault = ui.label().props("role=alert").classes("mb-refused whitespace-pre-line")
        self._products = ProductsPart(self._run, self._reader)
        self._picture()
        AttentionPart(
            self._reader, self._panel.offer.title, self._resume if self._may_lead and not self._manual else None
        ).build(self._found, self._run.view.run.planned)
        later = ui.element("div").classes("w-full")
        read_part(self._run.view.run.results, self._reader)
        budgets_part(self._panel, self._run, self._reader)
        WaveformsPart(self._panel, self._run, self._reader).build()
        SignOffPart(self._run, self._session, self._reader, self._panel.access).build()

        def draw() -> None:
            with later:
                fits_part(self._panel, self._run, self._reader)

        ui.timer(_LATER, draw, once=True)

    def _outcome(self) -> None:
        """Say how the run ended, what was made safe, and whose run it was."""
        say, view = self._reader.say, self._run.view
        kind, left = state_at_end(view)
        if view.run.status == "failed":
            # Green says only what is safe: the reason stands by itself, as an abort's does above.
            with ui.element("section").classes("mb-unfinished mb-4").props("role=alert"):
                ui.label(f"✗ {say(text('Run failed.'))}").classes("text-xl font-bold")
                ui.label(say(view.run.told)).classes("text-base whitespace-pre-line")
        if view.run.status == "completed":
            left = text("Run completed. {left}", left=left)
        motor = view.run.start.motor if view.run.start is not None else MotorReference("?")
        parts = [motor.name, motor.serial_number]
        if view.run.start is not None:
            parts.append(_date(self._run.name))
            whole, hands = _duration(view.run.bench_time), _duration(view.run.hand_time)
            parts.append(say(text("{whole}, of these {hands} by hand", whole=whole, hands=hands)))
            parts.append(view.run.start.person)
        state = ui.element("section").classes("rounded-lg px-4 py-3 mb-4").props("role=status")
        state.props["data-left"] = kind.value
        off, unread = kind is StateKind.OFF, kind is StateKind.UNREAD
        with state.classes("mb-state-off" if off else "mb-state-unread" if unread else "mb-state-live"):
            ui.label(say(left)).classes("text-xl font-bold")
            ui.label(" · ".join(part for part in parts if part)).classes("text-base")

    async def _say_if_changed(self, place: ui.element) -> None:
        """Say where the journal is not the one that the run wrote: all else here was read from it."""
        try:
            # The longest journals take seconds, and other pages are to be heard meanwhile.
            await asyncio.to_thread(read_journal, self._run.folder.journal)
        except InputError as error:
            if place.is_deleted:
                return
            with place, ui.element("section").classes("mb-refused mb-4").props("role=alert"):
                changed = text("This record was changed after it was written: do not use what this page shows.")
                ui.label(self._reader.say(changed)).classes("text-xl font-bold")
                ui.label(self._reader.fault(error)).classes("text-base whitespace-pre-line")

    def _headline(self) -> Text:
        count = len(self._rows)
        look = [row.label for row in self._rows if row.verdict not in (None, Conformity.WITHIN)]
        look += [reasons[0].label for reasons in self._parameters.withheld.values()]
        if not count and not look:
            return text("No parameter was measured.")
        measured = text("1 parameter measured") if count == 1 else text("{count} parameters measured", count=count)
        if look:
            return text("{measured}. Needs attention: {names}.", measured=measured, names=look)
        open_points = sum(each.rank is not Rank.KNOWN for each in self._found)
        if open_points:
            return text("{measured}. Warnings to check: {count}.", measured=measured, count=open_points)
        return text("{measured}. Nothing needs attention.", measured=measured)

    def _actions(self, headline: ui.element) -> None:
        say, view = self._reader.say, self._run.view.run
        with ui.row().classes("gap-3 mt-3 items-center"):
            if self._may_lead and view.status != "completed" and not self._manual:
                go_on = ui.button(say(text("Continue where it ended")), on_click=lambda: self._resume(), color=None)
                go_on.classes("mb-go").props("no-caps")
            if self._may_lead:
                following = f"/?{urlencode({'as_before': self._run.name})}"
                onward = ui.button(say(text("Measure the next motor")), on_click=lambda: ui.navigate.to(following))
                onward.props("no-caps data-next")
            # After a run that is complete Enter goes on; after any other nothing happens by itself.
            (onward if self._may_lead and view.status == "completed" else headline).props("data-focus")
            ui.button(say(text("Report")), on_click=lambda: self._products.report()).props("outline no-caps")
            with self._menu(text("Export")):
                for name, target in self._exports.items():
                    ui.item(target.title, on_click=lambda name=name: self._export(name))
            if self._may_lead and not self._manual:
                with self._menu(text("Repeat")):
                    for name in view.planned:
                        title = say(self._panel.offer.title(name))
                        ui.item(title, on_click=lambda name=name: self._resume(name))
            if not self._panel.of_batch(self._run):
                against = f"/compare/{quote(self._run.name, safe='')}/type"
                compared = ui.button(say(text("Compare with the type")), on_click=lambda: ui.navigate.to(against))
                compared.props("outline no-caps")
            if self._session.may_change:
                ui.button(say(text("Sign …")), on_click=lambda: ui.run_javascript(_TO_SIGNATURES)).props(
                    "outline no-caps"
                )

    def _menu(self, words: Text) -> ui.dropdown_button:
        message = self._reader.say(words)
        # Its icon's name would be read aloud with the words.
        return named(ui.dropdown_button(message, auto_close=True).props("outline no-caps"), message)

    def _picture(self) -> None:
        say, view = self._reader.say, self._run.view.run
        if not self._rows and not self._parameters.withheld:
            return
        with named(ui.element("section").classes("mb-card mb-4"), say(text("Parameters"))):
            lacking = [reasons[0] for reasons in self._parameters.withheld.values()]
            parameter_picture(self._rows, lacking, self._reader)
            with expansion(say(text("All figures as a table"))):
                self._table(with_truth=bool(view.truth))

    def _table(self, *, with_truth: bool) -> None:
        say, view = self._reader.say, self._run.view.run
        head = [text("Parameter"), text("Value"), text("Unit"), text("u"), text("u, %"), text("Note's formula")]
        head += [text("Truth")] if with_truth else []
        lines = []
        for row in rows(self._parameters, view.truth, self._reader.translate):
            line = [row.name, row.value, row.unit, row.uncertainty, row.relative, row.note]
            lines.append([*line, *([row.truth] if with_truth else []), row.section])
        numeric = frozenset({1, 3, 4, 5, 6} if with_truth else {1, 3, 4, 5})
        table([*map(say, head), "§"], lines, numeric=numeric)
        legend = text("u: standard uncertainty. Note's formula: its result on the same readings.")
        ui.label(say(legend)).classes("text-sm mt-2")

    async def _resume(self, repeat: str | None = None) -> None:
        chosen = [repeat] if repeat is not None else []
        try:
            again = await self._panel.resume(self._run.name, self._session.person, chosen, self._session.language)
        except (InputError, TimeoutError) as error:
            self._fault.set_text(self._reader.fault(error))
            return
        self._panel.control.take(self._session.token, self._session.person)
        ui.navigate.to(f"/runs/{quote(again.name, safe='')}")

    async def _export(self, target: str) -> None:
        await self._products.export(target, self._exports[target].suffix)


def _duration(seconds: float) -> Text:
    """Return a time as a person says it: in minutes where it has some."""
    if seconds < _IN_SECONDS:
        return text("{seconds:.0f} s", seconds=seconds)
    return text("{minutes:.0f} min", minutes=seconds / 60.0)


def _date(run: str) -> str:
    """Return when a run's folder says that it began; empty for one of another name."""
    try:
        return datetime.strptime(run[:16], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC).strftime("%Y-%m-%d %H:%M UTC")
    except ValueError:
        return ""
