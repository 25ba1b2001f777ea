"""The step: one heading that says what to do now, its work in numbered lines, the drawing."""

import re
from collections.abc import Awaitable, Callable, Mapping, Sequence
from functools import partial
from time import monotonic
from typing import Any

from nicegui import ui

from bench.journal.stored_result import restore_text
from bench.panel.bench_state import KNOWN
from bench.panel.gauge import gauge_of
from bench.panel.live.live_run import LiveRun
from bench.panel.motor_of import nameplate_of
from bench.panel.pages.by_hand import ByHandForm, said_lines
from bench.panel.pages.choice import ChoiceEntry
from bench.panel.pages.parts import kept, named, untaken_note
from bench.panel.pages.reader import Reader
from bench.panel.pages.run.correction import Correction
from bench.panel.pages.run.entry import NumberEntry
from bench.panel.pages.run.gauge_view import GaugeView
from bench.panel.pages.run.plot_area import PlotArea
from bench.panel.pages.run.step_drawing import StepDrawing
from bench.panel.panel import Panel
from bench.panel.typed_scale import value_of
from drivers.interfaces.text import Text, text
from reports.labels import role_name


class StepCard:
    """The card that a person works by; everyone sees it.

    `changed` is called when something is typed into it, `send` gives a question's answer to the run.
    """

    def __init__(
        self,
        panel: Panel,
        run: LiveRun,
        reader: Reader,
        changed: Callable[[], None],
        send: Callable[[Mapping[str, Any], object], Awaitable[None]],
    ) -> None:
        self._panel = panel
        self._run = run
        self._reader = reader
        self._changed = changed
        self._send = send
        self._worded: object = ()
        self._offered: object = ()
        self._by_hand = ByHandForm(reader)
        #: The field of the present question, where a number is asked for.
        self.entry: NumberEntry | ChoiceEntry | None = None
        #: The field of the present question, where angles are asked for, and what was wrong with them.
        self.angles: ui.input | None = None
        self.fault: ui.label | None = None
        #: The correction of an earlier reading.
        self.correction = Correction(run.view, reader, self._again)
        self._may_answer = False
        say = reader.say
        with named(ui.element("section").classes("mb-card mb-step"), say(text("The present step"))):
            with ui.element("div").classes("mb-words"):
                self._place = ui.label().classes("mb-crumb")
                untaken_note(reader)
                self._task = ui.element("div")
                self._commands = ui.element("div")
                self._gauge = GaugeView(reader)
            self._drawing = StepDrawing(run, reader)
            with self._drawing.stage, ui.element("div").classes("mb-plot"):
                self._plot = PlotArea(reader)

    def show(self, *, may_answer: bool) -> None:
        """Show the present step and question; who may answer gets the field for it."""
        view = self._run.view
        self._place.set_text(self._reader.say(self._crumb()))
        question, self._may_answer = self._run.line.question, may_answer
        worded = (
            self.correction.state,
            question["id"] if question else None,
            self._run.running,
            may_answer,
            view.layout.shaft_turned,
            view.action,
            view.step if question is None else "",
        )
        if worded != self._worded:
            self._worded = worded
            self.entry = self.angles = self.fault = None
            self._task.clear()
            with self._task:
                self._ask(question, may_answer=may_answer)
        self._offer_commands(question if may_answer and self._run.running else None)
        self._drawing.show()
        self.tick()

    @property
    def plots(self) -> bool:
        """True if the run's plot takes the drawing's place: as long as no manual work is requested since it came."""
        return self._run.line.plot_is_newest

    def tick(self) -> None:
        """Show what comes by itself: the plot's points, what a source reads back."""
        plot, line = self._run.line.plot, self._run.line
        if plot is not None and self.plots:
            self._drawing.stage.classes(add="mb-plotting")
            self._plot.show(plot, self._run.view.readings)
        else:
            self._drawing.stage.classes(remove="mb-plotting")
        question, typed = line.question, None
        if self.entry is not None and question is not None and question["kind"] == "number":
            typed = value_of(self.entry.words, question["unit"])
        if question is not None and self.correction.is_open(question):
            # What is typed then belongs to an earlier question.
            question = None
        old = monotonic() - line.sources_at > KNOWN
        self._gauge.show(gauge_of(self._run.view, question, line.sources, old=old, typed=typed))

    def _again(self) -> None:
        """Show it with the correction as it is now."""
        self.show(may_answer=self._may_answer)
        self._changed()

    def _crumb(self) -> Text:
        view = self._run.view
        here = view.run.procedures.get(view.procedure)
        if here is None:
            return text("The run begins …")
        steps = list(here.sentences)
        place: dict[str, object] = {"procedure": self._panel.offer.title(view.procedure), "step": view.step or "–"}
        sentence = self._sentence()
        if view.step in steps:
            place |= {"number": steps.index(view.step) + 1, "all": len(steps), "sentence": sentence}
            return text("{procedure} · step {number} of {all} · document §{step}: {sentence}", **place)
        return text("{procedure} · document §{step}", **place)

    def _sentence(self) -> Text | str:
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

    def _ask(self, question: Mapping[str, Any] | None, *, may_answer: bool) -> None:
        say = self._reader.say
        if question is not None and may_answer and self.correction.is_open(question):
            self.entry = self.correction.build(question, self._changed)
            return
        if self.correction.done is not None:
            ui.label(say(self.correction.done)).classes("mb-said").props("role=status")
        heading, *work = self._lines(question)
        # A pair of terminals is one word, as is a number with its unit, and stays on one line.
        heading = re.sub(r"(?<=\d) (?=\S)", "\u00a0", heading.rstrip(":：.。").replace("–", "–\u2060"))
        ui.label(heading).classes("mb-h1").props("role=heading aria-level=1 aria-live=polite")
        if question is not None and question["kind"] == "doubt":
            # The finding is no list of things to do.
            ui.label("\n".join(work)).classes("mb-note whitespace-pre-line")
        elif work:
            with ui.element("ol").classes("mb-work"):
                for number, words in enumerate(work, 1):
                    with ui.element("li"):
                        ui.label(str(number)).classes("mb-number-of").props("aria-hidden=true")
                        ui.label(words)
        if question is None or not may_answer:
            return
        if question["kind"] == "number" and question["options"]:
            self.entry = ChoiceEntry(question, self._reader, self._typed)
        elif question["kind"] == "number":
            with ui.element("div").classes("mb-entry"):
                self.entry = NumberEntry(self._run.view, question, self._reader, self._typed)
        elif question["kind"] == "angles":
            asked = text("angles in degrees, separated by spaces")
            label = say(asked)
            ui.label(label).classes("mb-label").props("aria-hidden=true")
            with ui.element("div").classes("mb-field mb-entry"):
                self.angles = kept(named(ui.input().props("borderless data-focus autocomplete=off"), label), asked)
            self.fault = ui.label().classes("mb-note").props("role=alert")

    def _typed(self) -> None:
        self._changed()
        self.tick()

    def _offer_commands(self, question: Mapping[str, Any] | None) -> None:
        # Apart from the words: a field made anew forgets what was typed.
        asked = question if question is not None and question["kind"] == "command" else None
        offered = asked["id"] if asked else None
        if offered == self._offered:
            return
        self._offered = offered
        self._commands.clear()
        if asked:
            with self._commands:
                self._by_hand.offer(asked, partial(self._send, asked), self._run.view.layout.terminals)

    def _lines(self, question: Mapping[str, Any] | None) -> Sequence[str]:
        say, view = self._reader.say, self._run.view
        if question is None:
            turned = view.layout.shaft_turned
            going_on = text("Go on turning the shaft evenly until told to stop")
            return [say(going_on if turned else text("Measuring: keep your hands off the motor"))]
        if question["kind"] == "number" and question["options"]:
            return [say(text("See and choose: {quantity}", quantity=restore_text(question["quantity"])))]
        if question["kind"] == "number":
            return [say(text("Read and enter: {quantity}", quantity=restore_text(question["quantity"])))]
        if question["kind"] == "confirm":
            task = restore_text(question["task"])
            return [say(text("{instrument}: {what}", instrument=role_name(question["instrument"]), what=task))]
        if question["kind"] == "command":
            return said_lines(question, self._reader)
        if question["kind"] == "doubt":
            # The journal has its words in English only.
            finding = [say(restore_text(line)) for line in question["lines"]]
            return [say(text("Is this reading right? Look again")), *finding]
        action = view.action
        if action is not None and type(action).__name__ == question["action"]:
            return [say(line) for line in action.lines(nameplate_of(view.run.start).wire_colours)]
        return [say(restore_text(line)) for line in question["lines"]]
