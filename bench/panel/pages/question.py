"""What is to be done now: the step in the document's words, the drawing, and one big button."""

from functools import partial
from typing import Any

from nicegui import ui

from bench.drawings.connections import draw_connections
from bench.journal.stored_result import restore_text
from bench.operators.typed import BACK
from bench.panel.live_run import LiveRun
from bench.panel.motor_of import nameplate_of
from bench.panel.pages.by_hand import ByHandForm, said_lines
from bench.panel.pages.frame import Reader
from bench.panel.pages.parts import drawing, named
from bench.panel.panel import Panel
from bench.panel.sessions import Session
from drivers.interfaces.text import Text, text
from procedures.core.actions import (
    Connect,
    ConnectProbes,
    ConnectVoltmeter,
    ConnectVoltmeterToSupply,
    DisconnectVoltmeter,
    ShortMeterLeads,
)
from reports.labels import role_name

_DRAWN = (Connect, ConnectProbes, ConnectVoltmeter, ConnectVoltmeterToSupply, DisconnectVoltmeter, ShortMeterLeads)


class QuestionCard:
    """The card that a person works by; everyone sees it, who leads may answer."""

    def __init__(self, panel: Panel, session: Session, run: LiveRun, reader: Reader) -> None:
        self._panel = panel
        self._session = session
        self._run = run
        self._reader = reader
        self._worded: object = ()
        self._answerable: object = ()
        self._drawn = ""
        self._input: ui.input | None = None
        self._by_hand = ByHandForm(reader)
        say = reader.say
        with named(ui.element("section").classes("mb-card shrink-0 overflow-hidden"), say(text("The present step"))):
            self._place = ui.label().classes("text-base").style("color:#44505c")
            self._step = ui.label().classes("text-2xl font-semibold leading-snug mb-3")
            self._task = ui.element("div").classes("w-full").props("aria-live=polite")
            self._answers = ui.element("div").classes("w-full")
            self._picture = ui.element("div").classes("w-full max-w-3xl mt-3")

    def show(self) -> None:
        """Show the present step and question."""
        view, say = self._run.view, self._reader.say
        here = view.run.procedures.get(view.procedure)
        number = list(view.run.procedures).index(view.procedure) + 1 if here else 0
        place = text(
            "{procedure} ({number} of {all}) · document §{step}",
            procedure=self._panel.offer.title(view.procedure),
            number=number,
            all=len(view.run.planned),
            step=view.step or "–",
        )
        self._place.set_text(say(place) if here else say(text("The run begins …")))
        self._step.set_text(self._sentence())
        question = self._run.line.question
        open_for = (question["id"] if question else None, self._run.running)
        # The journal may come after the question: then its words are shown as soon as they are there.
        worded = (*open_for, view.layout.shaft_turned, view.action)
        if worded != self._worded:
            self._worded = worded
            self._task.clear()
            with self._task:
                self._ask(question)
        # Apart from the words: a button made anew under the finger takes no click, a field made anew forgets what was typed.
        answerable = (*open_for, self._panel.control.holds(self._session.token))
        if answerable != self._answerable:
            self._answerable = answerable
            self._answers.clear()
            if question:
                with self._answers:
                    self._offer(question)
        self._draw()

    def _sentence(self) -> str:
        """Return the step's words in the reader's language; the journal has them in the run's."""
        view = self._run.view
        known = self._panel.offer.step(view.procedure, view.step)
        if known is None:
            return view.step_text
        try:
            return self._reader.say(Text(known.template, view.step_values))
        except (KeyError, ValueError, IndexError):
            # Another version's step, whose sentence names other settings.
            return view.step_text

    def _draw(self) -> None:
        view = self._run.view
        drawn = ""
        if view.layout.terminals is not None or isinstance(view.action, _DRAWN):
            drawn = draw_connections(view.layout, nameplate_of(view.run.start), self._reader.translate)
        if drawn != self._drawn:
            self._drawn = drawn
            self._picture.clear()
            if drawn:
                with self._picture:
                    drawing(drawn)

    def _ask(self, question: Any) -> None:
        say = self._reader.say
        if question is None:
            with ui.row().classes("items-center gap-3 text-xl"):
                ui.spinner(size="2rem").props("aria-hidden=true")
                turned = self._run.view.layout.shaft_turned
                going_on = text("Measuring; go on turning the shaft evenly until told to stop.")
                ui.label(say(going_on if turned else text("Measuring; keep your hands off the motor.")))
            return
        for number, words in enumerate(self._lines(question)):
            ui.label(words).classes("text-2xl font-bold" if number == 0 else "text-xl pl-4")

    def _offer(self, question: Any) -> None:
        """Put up what answers the question: a field, buttons, or why this page has none."""
        say = self._reader.say
        if not self._panel.control.holds(self._session.token) and self._panel.control.leader is not None:
            ui.label(say(text("You are watching: take the control to answer."))).classes("text-lg mt-2")
            return
        if not self._session.may_lead:
            ui.label(say(text("You are watching."))).classes("text-lg mt-2")
            return
        if question["kind"] == "command":
            self._by_hand.offer(question, partial(self._answer, question))
            return
        with ui.row().classes("items-end gap-4 mt-3"):
            if question["kind"] in ("number", "angles"):
                self._input = self._number(question)
            if question["kind"] == "doubt":
                for offered, again in ((text("Enter it again"), True), (text("It is right: keep it"), False)):
                    choice = ui.button(say(offered), on_click=partial(self._answer, question, again), color=None)
                    choice.classes("mb-go text-2xl px-10 py-4" if again else "text-xl px-8 py-4")
                return
            if question.get("correctable"):
                back = text("Correct the entry before")
                ui.button(say(back), on_click=partial(self._answer, question, BACK)).props("outline")
            done = ui.button(say(text("Done")), on_click=lambda: self._answer(question), color=None)
            done.classes("mb-go text-2xl px-10 py-4").props(
                "autofocus" if question["kind"] in ("action", "confirm") else ""
            )

    def _number(self, question: Any) -> ui.input:
        say = self._reader.say
        if question["kind"] == "angles":
            label = say(text("angles in degrees, separated by spaces"))
        else:
            label = f"{question['unit']}  ({question['minimum']:g} … {question['maximum']:g})"
        field = ui.input(label=label).props("outlined autofocus inputmode=decimal").classes("text-2xl w-72")
        if question.get("proposed") is not None:
            field.set_value(f"{question['proposed']:.4g}")
        field.on("keydown.enter", lambda: self._answer(question))
        return field

    def _lines(self, question: Any) -> list[str]:
        say = self._reader.say
        if question["kind"] == "command":
            return said_lines(question, self._reader)
        if question["kind"] == "number":
            return [say(text("Read and enter: {quantity}", quantity=restore_text(question["quantity"])))]
        if question["kind"] == "confirm":
            return [f"{say(role_name(question['instrument']))}: {say(restore_text(question['task']))}"]
        if question["kind"] == "doubt":
            # The journal has its words in English only.
            return [say(restore_text(line)) for line in question["lines"]]
        action = self._run.view.action
        if action is not None and type(action).__name__ == question["action"]:
            return [say(line) for line in action.lines(nameplate_of(self._run.view.run.start).wire_colours)]
        return [say(restore_text(line)) for line in question["lines"]]

    async def _answer(self, question: Any, value: object = None) -> None:
        if not self._panel.control.take_if_free(self._session.token, self._session.person):
            return
        if value is None and question["kind"] in ("number", "angles") and self._input is not None:
            typed = str(self._input.value or "")
            # The run itself takes decimal commas and units apart, and keeps what was typed.
            value = typed.replace(";", " ").split() if question["kind"] == "angles" else typed
        fault = await self._run.line.answer(question["id"], value)
        open_now = self._run.line.question
        # A second click, or another browser's, comes too late and does no harm.
        if fault and open_now is not None and open_now["id"] == question["id"]:
            ui.notify(self._reader.say(fault), type="negative", position="top", timeout=8000)
