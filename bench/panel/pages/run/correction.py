"""An earlier typed reading, corrected: which one, and what it should have been."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any

from nicegui import ui

from bench.journal.stored_result import restore_text
from bench.panel.live.live_view import LiveView
from bench.panel.pages.choice import ChoiceEntry, option_name
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from bench.panel.pages.run.entry import NumberEntry
from bench.panel.typed_scale import shown
from drivers.interfaces.text import Text, text, word


class Correction:
    """The correction of an earlier reading in the place of a question; `changed` is called when its look changes."""

    def __init__(self, view: LiveView, reader: Reader, changed: Callable[[], None]) -> None:
        self._view = view
        self._reader = reader
        self._changed = changed
        self._question: int | None = None
        #: The reading that was chosen, as the run tells it.
        self.chosen: Mapping[str, Any] | None = None
        #: What was corrected last, in words, until something else is done.
        self.done: Text | None = None

    @property
    def state(self) -> object:
        """The state that determines its look; another one requires it to be built anew."""
        return self._question, self.chosen["number"] if self.chosen else None, self.done

    def is_open(self, question: Mapping[str, Any] | None) -> bool:
        """Tell whether a reading is being corrected while this is asked."""
        return question is not None and (self._question == question["id"] or self.refused(question) is not None)

    def refused(self, question: Mapping[str, Any]) -> Text | None:
        """Return why the last correction was not possible, as long as no decision about it has been made."""
        told = question.get("uncorrected")
        return restore_text(told["why"]) if told and self._question != -question["id"] else None

    def open(self, question: Mapping[str, Any]) -> None:
        """Ask for the choice of a reading; if there is only one, choose it."""
        readings: Sequence[Mapping[str, Any]] = question["readings"]
        self._question, self.chosen, self.done = question["id"], readings[0] if len(readings) == 1 else None, None
        self._changed()

    def leave(self, question: Mapping[str, Any]) -> None:
        """Leave all readings as they are."""
        self._question, self.chosen = -question["id"], None
        self._changed()

    def given(self, words: str) -> None:
        """Take it that the run has got the correction."""
        if self.chosen is not None:
            asked = restore_text(self.chosen["asked"])
            self.done = text("Corrected: {reading} is {value} now", reading=asked, value=words)
        self._question = self.chosen = None

    def build(self, question: Mapping[str, Any], typed: Callable[[], None]) -> NumberEntry | ChoiceEntry | None:
        """Build the list, or the field of the reading chosen; `typed` is called when something is typed into it."""
        say, why = self._reader.say, self.refused(question)
        heading = text("Which reading is to be corrected?")
        if why is not None:
            heading = text("The reading stays as it is")
        elif self.chosen is not None:
            heading = text("Type the right value: {reading}", reading=restore_text(self.chosen["asked"]))
        ui.label(say(heading)).classes("mb-h1").props("role=heading aria-level=1 aria-live=polite")
        if why is not None:
            ui.label(say(why)).classes("mb-note").props("role=alert")
            other = text("Repeat the procedure to use another value: everything is switched off, and it begins anew.")
            ui.label(say(other)).classes("mb-hint")
            return None
        if self.chosen is None:
            self._list(question["readings"])
            return None
        before = text("It was typed as {value}.", value=_value(self.chosen))
        ui.label(say(before)).classes("mb-hint")
        question = {**self.chosen, "quantity": self.chosen["asked"]}
        if self.chosen["options"]:
            return ChoiceEntry(question, self._reader, typed)
        with ui.element("div").classes("mb-entry"):
            return NumberEntry(self._view, question, self._reader, typed)

    def _list(self, readings: Sequence[Mapping[str, Any]]) -> None:
        say = self._reader.say
        with named(ui.element("ul").classes("mb-typed"), say(text("Readings, the newest first"))):
            for reading in reversed(readings):
                with (
                    ui.element("li"),
                    ui.element("button")
                    .classes("mb-b")
                    .props("type=button")
                    .on("click", partial(self._choose, reading)),
                ):
                    ui.label(say(restore_text(reading["asked"])))
                    ui.label(say(_value(reading))).classes("mb-number")
        ui.label(say(text("Readings that an instrument takes by itself are not corrected by hand."))).classes("mb-hint")

    def _choose(self, reading: Mapping[str, Any]) -> None:
        self.chosen = reading
        self._changed()


def _value(reading: Mapping[str, Any]) -> Text:
    """Return the value that a reading has, or the answer that was chosen, in words."""
    chosen = (option_name(one) for one in reading["options"] if one["number"] == reading["value"])
    return next(chosen, word(shown(reading["value"], reading["unit"])))
