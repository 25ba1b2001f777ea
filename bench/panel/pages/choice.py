"""A question with fixed answers: each is a button, a digit, and a code that a scanner may type."""

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from bench.journal.stored_result import restore_text
from bench.panel.pages.parts import named
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text


def option_name(option: Mapping[str, Any]) -> Text:
    """Return what an option, as the run tells it, is called."""
    name = restore_text(option["name"])
    return text("{name} ({sign})", name=name, sign=option["sign"]) if option["sign"] else name


class ChoiceEntry:
    """The answers of one question to choose from; `changed` is called when another one is chosen."""

    def __init__(self, question: Mapping[str, Any], reader: Reader, changed: Callable[[], None]) -> None:
        self._reader = reader
        self._changed = changed
        self._chosen: Mapping[str, Any] | None = None
        #: Why what was entered was not taken.
        self.held: Text | None = None
        label = reader.say(restore_text(question["quantity"]))
        with named(ui.element("div").classes("mb-options mb-entry").props("role=radiogroup"), label) as self._box:
            for place, option in enumerate(question["options"]):
                self._option(option, first=place == 0)
        self._note = ui.label().classes("mb-note").props("role=alert")
        hint = text("Touch the answer, or type its number; Enter enters it.")
        ui.label(reader.say(hint)).classes("mb-hint")

    @property
    def words(self) -> str:
        """The answer to the run: the number of the chosen option, empty if none is chosen."""
        return "" if self._chosen is None else str(self._chosen["number"])

    @property
    def shown(self) -> str:
        """The chosen option, in the reader's words."""
        return "" if self._chosen is None else self._reader.say(option_name(self._chosen))

    def doubt(self) -> Text | None:
        """Return None: one of the answers is as likely as another."""
        return None

    def hold(self, why: Text | None) -> None:
        """Say why nothing was entered; None where it was."""
        self.held = why
        self._note.set_text(self._reader.say(why) if why else "")
        self._box.classes(add="mb-bad") if why else self._box.classes(remove="mb-bad")

    def _option(self, option: Mapping[str, Any], *, first: bool) -> None:
        name = restore_text(option["name"])
        # What is its own name is not written twice.
        key = "" if str(name).isdecimal() else str(option["number"])
        codes = " ".join(filter(None, (key or str(name), option["sign"])))
        with ui.element("label").classes("mb-option"):
            radio = ui.element("input").props("type=radio name=answer").on("change", lambda: self._choose(option))
            radio.props["data-codes"] = codes
            if first:
                radio.props("data-focus")
            if key:
                ui.label(key).classes("mb-number-of").props("aria-hidden=true")
            ui.label(self._reader.say(option_name(option)))

    def _choose(self, option: Mapping[str, Any]) -> None:
        self._chosen = option
        if self.held:
            self.hold(None)
        self._changed()
