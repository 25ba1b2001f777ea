"""A number that a person reads and types: its field, its unit, what is accepted, what its like were."""

from collections.abc import Callable, Mapping
from typing import Any

from nicegui import ui

from bench.journal.stored_result import restore_text
from bench.panel.live.live_view import LiveView
from bench.panel.pages.parts import kept, named
from bench.panel.pages.reader import Reader
from bench.panel.typed_scale import chosen_unit, completed, factor_of, far_from, shown, units_of, value_of
from drivers.interfaces.text import Text, text


def place_of(question: Mapping[str, Any]) -> tuple[Text, Mapping[str, object]]:
    """Return the quantity of a question without its place, and the place: terminals, number and count, as far as there are any."""
    asked = restore_text(question["quantity"])
    inner = asked.values.get("quantity")
    if isinstance(inner, Text) and "terminals" in asked.values:
        return inner, asked.values
    return asked, {}


class NumberEntry:
    """The field of one question; `changed` is called when what stands in it says something else."""

    def __init__(
        self, view: LiveView, question: Mapping[str, Any], reader: Reader, changed: Callable[[], None]
    ) -> None:
        self._reader = reader
        self._changed = changed
        self._unit: str = question["unit"]
        self._quantity, self._place = place_of(question)
        english = str(self._quantity)
        self._like = [
            value for place, value in view.typed.items() if place.quantity == english and place.unit == self._unit
        ]
        proposed = question.get("proposed")
        like = self._like[-1] if self._like else proposed
        self._units = units_of(self._unit, question["minimum"], question["maximum"], like)
        self._chosen = chosen_unit(self._units, self._unit, like)
        self._buttons: dict[str, ui.element] = {}
        #: Why what stands there was not taken.
        self.held: Text | None = None
        self._build(question, "" if proposed is None else f"{proposed / factor_of(self._chosen, self._unit):.4g}")

    @property
    def words(self) -> str:
        """The field's text, with its unit."""
        return completed(str(self._field.value or ""), self._chosen, self._unit)

    @property
    def shown(self) -> str:
        """The same, for a person."""
        return self.words

    def doubt(self) -> Text | None:
        """Return why what stands in the field is doubted, None where it is not."""
        value = value_of(self.words, self._unit)
        like = None if value is None else far_from(value, self._like, self._unit)
        if value is None or like is None:
            return None
        return text(
            "{value} is more than five times off the readings before ({like}). A digit or the unit may be wrong. "
            "Type it again, or keep it: then it is used, and the record says so.",
            value=shown(value, self._unit),
            like=shown(like, self._unit),
        )

    def hold(self, why: Text | None) -> None:
        """Say at the field why what stands there is not taken; None where it is."""
        self.held = why
        self._note.set_text(self._reader.say(why) if why else "")
        self._box.classes(add="mb-bad") if why else self._box.classes(remove="mb-bad")
        self._field.props["aria-invalid"] = "true" if why else "false"
        self._field.update()

    def _build(self, question: Mapping[str, Any], proposed: str) -> None:
        say = self._reader.say
        label = say(self._label())
        ui.label(label).classes("mb-label").props("aria-hidden=true")
        with ui.element("div").classes("mb-field") as self._box:
            self._field = ui.input(value=proposed, on_change=self._typed).props(
                "borderless data-focus inputmode=decimal autocomplete=off"
            )
            kept(named(self._field, label), self._label())
            if len(self._units) > 1:
                with named(ui.element("div").classes("mb-units").props("role=radiogroup"), say(text("unit"))):
                    for name in self._units:
                        self._unit_button(name)
        self._note = ui.label().classes("mb-note").props("role=alert")
        hints = text("Accepted {minimum} … {maximum}.", **self._range(question))
        if self._units != [""]:
            example = f"31.8\u00a0{self._chosen}, 31,8\u00a0{self._chosen}"
            hints = text(
                "Comma or point. A unit may be typed too: {example}. {accepted}", example=example, accepted=hints
            )
        ui.label(say(hints)).classes("mb-hint")

    def _range(self, question: Mapping[str, Any]) -> dict[str, object]:
        bounds = {name: shown(question[name], self._unit) for name in ("minimum", "maximum")}
        return {name: bound.replace("-", "−").replace(" ", "\u00a0") for name, bound in bounds.items()}

    def _label(self) -> Text:
        if not self._place:
            return self._quantity
        if "count" not in self._place:
            return text("{quantity}, {terminals}", quantity=self._quantity, terminals=self._place["terminals"])
        return text(
            "{quantity}, {terminals}, reading {number} of {count}", **{**self._place, "quantity": self._quantity}
        )

    def _unit_button(self, name: str) -> None:
        button = ui.element("button").props("type=button role=radio").on("click", lambda: self._choose(name))
        self._buttons[name] = button
        button.props["aria-checked"] = "true" if name == self._chosen else "false"
        with button:
            ui.label(name)

    def _choose(self, name: str) -> None:
        self._chosen = name
        for one, button in self._buttons.items():
            button.props["aria-checked"] = "true" if one == name else "false"
            button.update()
        self._typed()

    def _typed(self) -> None:
        if self.held:
            self.hold(None)
        self._changed()


def readings_table(view: LiveView, question: Mapping[str, Any], reader: Reader) -> bool:
    """Build the table of the readings that belong together; tell whether there are any places to show."""
    quantity, place = place_of(question)
    if "count" not in place:
        return False
    say, unit = reader.say, question["unit"]
    here, count = str(place["terminals"]), int(str(place["count"]))
    known = {(one.terminals, one.number): value for one, value in view.typed.items() if one.quantity == str(quantity)}
    rows = list(dict.fromkeys([*(terminals for terminals, _ in known), here]))
    ui.label(say(text("Readings"))).classes("mb-h2").props("role=heading aria-level=2")
    with ui.element("table").classes("mb-cells"):
        with ui.element("tr"):
            ui.element("td").style("border: 0")
            for number in range(1, count + 1):
                with ui.element("th").props("scope=col"):
                    ui.label(str(number))
        for terminals in rows:
            with ui.element("tr"):
                with ui.element("th").props("scope=row"):
                    ui.label(terminals)
                for number in range(1, count + 1):
                    now = terminals == here and number == place.get("number")
                    value = known.get((terminals, number))
                    with ui.element("td").classes(
                        "mb-cell-now" if now else "" if value is not None else "mb-cell-todo"
                    ):
                        ui.label(say(text("now")) if now else shown(value, unit) if value is not None else "·")
    ui.label(say(text("What was typed first stays in the journal."))).classes("mb-hint")
    return True
