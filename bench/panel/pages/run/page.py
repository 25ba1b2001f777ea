"""A run's page: the state of the bench, what to do now, and what was read while it goes on; its results once it has ended."""

from time import monotonic

from nicegui import ui

from bench.panel.bench_state import bench_state
from bench.panel.live.live_run import LiveRun
from bench.panel.pages.ended.page import ended_part
from bench.panel.pages.frame import frame
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.pages.run.action_bar import ActionBar
from bench.panel.pages.run.entry import readings_table
from bench.panel.pages.run.reading import ReadingCard
from bench.panel.pages.run.state_row import StateRow
from bench.panel.pages.run.step_card import StepCard
from bench.panel.pages.run.steps import ProgressCard
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, text

#: How often (s) a page looks whether its run has changed.
_LOOK = 0.02
#: How often (s) the state is looked at where nothing has changed: what is known grows old by itself.
_STATE = 0.25


def run_page(panel: Panel, session: Session, run: LiveRun) -> None:
    """Build the page of one run."""
    with frame(panel, session, text("Run {name}", name=run.name), "/", whole=True) as reader:
        page = _RunPage(panel, session, run, reader)
        page.build()
        ui.timer(_LOOK, page.look)


class _RunPage:
    def __init__(self, panel: Panel, session: Session, run: LiveRun, reader: Reader) -> None:
        self._panel = panel
        self._session = session
        self._run = run
        self._reader = reader
        self._seen = (-1, -1)
        self._looked = 0.0
        self._ended: bool | None = None
        self._tabled: object = ()

    def build(self) -> None:
        say = self._reader.say
        self._emergency = ui.label().classes("mb-emergency").props("role=alert")
        self._emergency.set_visibility(False)
        self._live = ui.element("div").classes("w-full")
        with self._live:
            self._state = StateRow(self._run, self._reader, self._abort)
            with ui.element("div").classes("mb-grid"):
                self._card = StepCard(
                    self._panel,
                    self._run,
                    self._reader,
                    lambda: self._bar.typed(),
                    lambda question, value: self._bar.send(question, value),
                )
                with ui.element("div").classes("mb-side"):
                    self._readings = named(ui.element("section").classes("mb-card"), say(text("Readings")))
                    self._reading = ReadingCard(self._run, self._reader)
                    self._progress = ProgressCard(self._panel, self._run, self._reader)
                    self._sound()
            self._bar = ActionBar(self._panel, self._session, self._run, self._reader, self._card)
        self._end = ui.element("div").classes("mb-page")
        self.look()

    def look(self) -> None:
        """Show what has changed since the last look."""
        seen = (self._run.changes, self._panel.control.changes)
        # A page is kept for a while without its browser.
        self._run.line.watched |= self._end.client.has_socket_connection
        if seen != self._seen:
            self._seen = seen
            self._show_end()
            self._card.show(may_answer=self._bar.may_answer)
            self._table()
            self._reading.show(plotted=self._card.plots)
            self._progress.show()
        elif self._ended:
            return
        elif monotonic() - self._looked < _STATE:
            self._reading.tick()
            return
        else:
            self._card.tick()
        self._looked = monotonic()
        state = bench_state(self._run)
        self._state.show(state)
        self._bar.show(state)
        self._reading.tick()

    def _table(self) -> None:
        """Show the readings that belong to the one that is asked for."""
        question, view = self._run.line.question, self._run.view
        tabled = (question["id"] if question else None, tuple(view.typed.values()), view.repeat)
        if tabled == self._tabled:
            return
        self._tabled = tabled
        self._readings.clear()
        shown = False
        if question is not None and question["kind"] == "number":
            with self._readings:
                shown = readings_table(view, question, self._reader)
        self._readings.set_visibility(shown)

    def _sound(self) -> None:
        mute = ui.element("button").classes("mb-b").props("type=button data-mute aria-pressed=false")
        with mute:
            ui.label(self._reader.say(text("Mute")))

    def _show_end(self) -> None:
        view = self._run.view
        # Before its first event, a run that was just started has not ended.
        ended = not self._run.running and (view.ended or not self._run.line.alive)
        if ended != self._ended:
            self._ended = ended
            self._live.set_visibility(not ended)
            self._end.clear()
            self._end.set_visibility(ended)
            if ended:
                with self._end:
                    ended_part(self._panel, self._session, self._run, self._reader)
        self._show_emergency(ended=ended)

    def _show_emergency(self, *, ended: bool) -> None:
        view, say = self._run.view, self._reader.say
        failed = [f"{event.instrument}: {event.error}" for event in view.made_safe.values() if event.error]
        lines = []
        if ended and view.run.status == "aborted":
            lines.append(say(text("ABORTED: {cause}", cause=view.run.told)))
        elif ended and not view.ended:
            lines.append(say(text("THE RUN'S PROCESS IS GONE. Look at the bench: is everything off?")))
        if failed:
            lines += [say(text("NOT PROVED OFF: {what}", what=what)) for what in failed]
        self._emergency.set_text("\n".join(lines))
        self._emergency.set_visibility(bool(lines))

    async def _abort(self) -> Text | None:
        return await self._run.abort(self._session.person)
