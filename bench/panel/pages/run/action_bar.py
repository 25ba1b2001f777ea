"""The buttons of a run: always at the same place, the same size, whatever the step."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from nicegui import ui

from bench.operators.typed import parted
from bench.panel.bench_state import ShownState, StateKind
from bench.panel.live.live_run import LiveRun
from bench.panel.pages.icons import icon
from bench.panel.pages.reader import Reader
from bench.panel.pages.run.step_card import StepCard
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, text
from procedures.core.actions import FINISH


class ActionBar:
    """The bar at the foot of a run's page; it answers the question that it was built for, and no later one."""

    def __init__(self, panel: Panel, session: Session, run: LiveRun, reader: Reader, card: StepCard) -> None:
        self._panel = panel
        self._session = session
        self._run = run
        self._reader = reader
        self._card = card
        self._shown: object = ()
        self._state: ShownState | None = None
        self._doubted = False
        say = reader.say
        self._bar = ui.element("div").classes("mb-act").props("data-step=''")
        with self._bar:
            self._parts = ui.element("div").style("display: contents")
            with ui.element("div").classes("mb-act-lost"):
                ui.label(say(text("Trying again … Nothing that you press here takes effect."))).classes("mb-act-note")
                self._waiting(text("Done: waits for the connection"))

    @property
    def may_answer(self) -> bool:
        """True if the reader of this page may answer now."""
        leader = self._panel.control.leader
        return self._session.may_lead and (leader is None or self._panel.control.holds(self._session.token))

    def show(self, state: ShownState) -> None:
        """Show what may be pressed now; what has not changed stays the same button."""
        question = self._run.line.question
        self._state = state
        entry = self._card.entry
        shown = (
            question["id"] if question else None,
            entry,
            self.may_answer,
            state.waits,
            state.kind is StateKind.UNKNOWN,
            self._doubted and entry is not None and entry.held is not None,
            self._card.correction.state,
        )
        if shown == self._shown:
            return
        correction = self._card.correction
        corrected = (correction.chosen or {}).get("number", "") if correction.is_open(question) else None
        step = (f"{question['id'] if question else 0}/{corrected}", state.waits is None)
        self._shown = shown
        self._parts.clear()
        with self._parts:
            self._build(question, state)
        self._bar.props["data-step"] = f"{step[0]} {int(step[1])}"
        self._bar.update()

    def typed(self) -> None:
        """Take it that something else stands in the field now."""
        self._doubted = False
        if self._state is not None:
            self.show(self._state)
        entry = self._card.entry
        if entry is not None and hasattr(self, "_done_words"):
            self._done_words.set_text(self._reader.say(self._entering()))

    def _build(self, question: Mapping[str, Any] | None, state: ShownState) -> None:
        # What is switched off by hand is switched off by nobody else: that is asked on the way down too.
        if question is None or (state.kind is StateKind.ABORTING and state.waits is not None):
            self._waiting(state.waits or text("Measuring …"))
            return
        if not self.may_answer:
            watching = text("You are watching: take the control to answer.")
            self._note(watching if self._session.may_lead else text("You are watching."))
            self._waiting(text("Somebody else answers"))
            return
        if question["kind"] == "command":
            if state.kind is StateKind.UNKNOWN:
                self._button(text("Ask again"), self._run.line.ask_again, "again").classes("mb-primary")
            self._button(text("Finish: everything off"), partial(self.send, question, FINISH))
            return
        if state.waits is not None:
            if state.kind is StateKind.UNKNOWN:
                self._button(text("Ask again"), self._run.line.ask_again, "again").classes("mb-primary")
            self._waiting(state.waits)
            return
        entry = self._card.entry
        correction = self._card.correction
        if correction.is_open(question):
            self._button(text("Leave it as it is"), partial(correction.leave, question), "back")
            if correction.refused(question) is not None:
                self._done(text("Repeat the procedure"), partial(self._repeat, question))
                return
            if entry is None:
                self._waiting(text("Choose a reading"))
                return
        elif question.get("readings"):
            self._button(text("Correct a reading"), partial(correction.open, question), "back")
        if entry is None and question["kind"] == "doubt":
            self._button(text("It is right: keep it"), partial(self._answer, question, value=False)).classes("mb-keep")
            self._done(text("Enter it again"), partial(self._answer, question, value=True))
        elif entry is not None and self._doubted and entry.held is not None:
            kept = self._button(text("Keep {value}", value=entry.words), partial(self.send, question, entry.words))
            kept.classes("mb-keep")
            self._done(text("Type it again"), self._again).props("data-again")
        elif entry is not None:
            self._done(self._entering(), partial(self._enter, question))
        else:
            done = self._done(text("Done"), partial(self._answer, question))
            if question["kind"] != "angles":
                done.props("data-focus")

    def _note(self, words: Text) -> None:
        ui.label(self._reader.say(words)).classes("mb-act-note")

    def _waiting(self, words: Text) -> None:
        with ui.element("button").classes("mb-b mb-done").props("type=button disabled"):
            ui.label(self._reader.say(words))

    def _button(self, words: Text, call: Callable[[], Any], picture: str = "") -> ui.element:
        button = ui.element("button").classes("mb-b").props("type=button").on("click", call)
        with button:
            if picture:
                icon(picture)
            ui.label(self._reader.say(words)).classes("mb-b-words")
        return button

    def _done(self, words: Text, call: Callable[[], Any]) -> ui.element:
        button = ui.element("button").classes("mb-b mb-done").props("type=button data-done").on("click", call)
        with button:
            self._done_words = ui.label(self._reader.say(words))
            ui.label("Enter").classes("mb-key").props("aria-hidden=true")
        return button

    def _entering(self) -> Text:
        """Return what the button says that takes what stands in the field."""
        words = self._card.entry.shown if self._card.entry else ""
        if self._card.correction.chosen is not None:
            return text("Correct to {value}", value=words) if words else text("Correct")
        return text("Enter {value}", value=words) if words else text("Enter")

    async def _repeat(self, question: Mapping[str, Any]) -> None:
        if self._panel.control.take_if_free(self._session.token, self._session.person):
            await self._run.line.say({"id": question["id"], "repeat": True, "by": self._session.person})

    def _again(self) -> None:
        """Leave it to the browser: the field has the focus again, and what stands there is typed over."""

    async def _enter(self, question: Mapping[str, Any]) -> None:
        entry = self._card.entry
        if entry is None:
            return
        doubt = entry.doubt()
        if doubt is None:
            await self.send(question, entry.words)
            return
        entry.hold(doubt)
        self._doubted = True
        if self._state is not None:
            self.show(self._state)

    async def _answer(self, question: Mapping[str, Any], value: object = None) -> None:
        if question["kind"] == "angles" and value is None and self._card.angles is not None:
            value = parted(str(self._card.angles.value or ""))
        await self.send(question, value)

    async def send(self, question: Mapping[str, Any], value: object) -> None:
        """Give the run an answer to its question; what it says against it is shown."""
        if not self._panel.control.take_if_free(self._session.token, self._session.person):
            return
        self._doubted = False
        correction, line = self._card.correction, self._run.line
        if (chosen := correction.chosen) is not None:
            wanted = {"number": chosen["number"], "typed": value}
            fault = await line.say({"id": question["id"], "correct": wanted, "by": self._session.person})
            if fault is None:
                correction.given(self._card.entry.shown if self._card.entry else str(value))
        else:
            correction.done = None
            fault = await line.answer(question["id"], value)
        now = self._run.line.question
        # A second click, or another browser's, comes too late and does no harm.
        if not fault or now is None or now["id"] != question["id"]:
            return
        if self._card.entry is not None:
            self._card.entry.hold(fault)
        elif self._card.fault is not None:
            self._card.fault.set_text(self._reader.say(fault))
        else:
            self._note(fault)
