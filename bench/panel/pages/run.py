"""One run: the present step in large type while it goes on, its results once it has ended."""

from typing import Any

from nicegui import events, ui

from bench.panel.live_run import LiveRun
from bench.panel.pages.ended import ended_part
from bench.panel.pages.ended_session import offer_abort
from bench.panel.pages.frame import Reader, frame
from bench.panel.pages.parts import named
from bench.panel.pages.question import QuestionCard
from bench.panel.pages.reading import ReadingCard
from bench.panel.pages.steps import ProgressCard
from bench.panel.panel import Panel
from bench.panel.sessions import Session
from drivers.interfaces.text import Text, text
from reports.labels import role_name

#: How often (s) a page looks whether its run has changed.
_LOOK = 0.05


def run_page(panel: Panel, session: Session, run: LiveRun) -> None:
    """Build the page of one run."""
    with frame(panel, session, text("Run {name}", name=run.name)) as reader:
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
        self._ended: bool | None = None

    def build(self) -> None:
        say = self._reader.say
        self._emergency = ui.label().classes("mb-emergency w-full mb-4").props("role=alert")
        self._emergency.set_visibility(False)
        with ui.element("div").classes("w-full") as self._live:
            # Beneath the page's head, however far a small screen is scrolled: ABORT is always in reach.
            bar = ui.row().classes("w-full items-stretch gap-4 pb-2 mb-2 no-wrap sticky top-bar z-10")
            with bar.style("background: var(--paper)"):
                self._state = ui.label().classes("grow text-xl rounded-lg px-4 py-3").props("role=status")
                abort = ui.button(say(text("ABORT")), on_click=self._abort, color=None).classes("mb-abort text-xl px-8")
                named(abort, say(text("Abort the run: everything off"))).props("accesskey=x")
                ui.tooltip(say(text("Everything off, in the station's order. Key: Ctrl+Esc")))
            with ui.element("div").classes("grid gap-4 grid-cols-1 lg-grid-cols-3"):
                with ui.element("div").classes("lg-col-span-2 flex flex-col flex-nowrap gap-4 min-w-0"):
                    self._question = QuestionCard(self._panel, self._session, self._run, self._reader)
                with ui.element("div").classes("flex flex-col flex-nowrap gap-4 min-w-0"):
                    self._reading = ReadingCard(self._run, self._reader)
                    self._progress = ProgressCard(self._panel, self._run, self._reader)
        self._end = ui.element("div").classes("w-full")
        offer_abort(self._aborted, abort, ui.keyboard(on_key=self._key, repeating=False, ignore=[]))
        self.look()

    def look(self) -> None:
        """Show what has changed since the last look."""
        seen = (self._run.changes, self._panel.control.changes)
        self._run.line.watched = True
        if seen == self._seen:
            self._reading.tick()
            return
        self._seen = seen
        self._show_state()
        self._question.show()
        self._reading.show()
        self._progress.show()

    def _show_state(self) -> None:
        say, view = self._reader.say, self._run.view
        on = sorted(view.energised)
        # Before its first event, a run that was just started has not ended.
        ended = not self._run.running and (view.ended or not self._run.line.alive)
        if on and not ended:
            words = say(text("⚡ ENERGISED: {instruments}", instruments=[role_name(role) for role in on]))
        elif ended:
            words = say(text("Ended"))
        else:
            words = say(text("Outputs off"))
        self._state.set_text(words)
        self._state.classes(add="mb-state-live" if on and not ended else "mb-state-off")
        self._state.classes(remove="mb-state-off" if on and not ended else "mb-state-live")
        if ended != self._ended:
            self._ended = ended
            self._live.set_visibility(not ended)
            self._end.clear()
            if ended:
                with self._end:
                    ended_part(self._panel, self._session, self._run, self._reader)
        self._show_emergency(ended=ended)

    def _show_emergency(self, *, ended: bool) -> None:
        view, say = self._run.view, self._reader.say
        failed = [f"{event.instrument}: {event.error}" for event in view.made_safe if event.error]
        lines = []
        if ended and view.run.status == "aborted":
            lines.append(say(text("ABORTED: {cause}", cause=view.run.cause)))
        elif ended and not view.ended:
            lines.append(say(text("THE RUN'S PROCESS IS GONE. Look at the bench: is everything off?")))
        if failed:
            lines += [say(text("NOT PROVED OFF: {what}", what=what)) for what in failed]
        self._emergency.set_text("\n".join(lines))
        self._emergency.set_visibility(bool(lines))

    async def _aborted(self) -> Text | None:
        return await self._run.line.abort(self._session.person or self._reader.say(text("this browser")))

    async def _abort(self) -> None:
        fault = await self._aborted()
        if fault:
            ui.notify(self._reader.say(fault), type="negative")

    async def _key(self, event: events.KeyEventArguments) -> None:
        if not event.action.keydown:
            return
        key: Any = event.key
        if key.escape and event.modifiers.ctrl:
            await self._abort()
