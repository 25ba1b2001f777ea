"""A motor's nameplate as a form, made from the same model as the file: units, ranges, what is needed."""

from collections.abc import Mapping
from pathlib import Path
from typing import Any
from urllib.parse import urlencode

from annotated_types import Ge, Gt, Le, Lt
from nicegui import ui
from pydantic.fields import FieldInfo

from bench.i18n.errors import InputError
from bench.motor.motor_sections import NameplateSection
from bench.panel.motor_store import save_motor
from bench.panel.pages.frame import frame
from bench.panel.pages.parts import kept
from bench.panel.pages.reader import Reader
from bench.panel.panel import Panel
from bench.panel.server.sessions import Session
from drivers.interfaces.text import Text, text, word
from procedures.core.nameplate import WindingConnection

LABELS: Mapping[str, Text] = {
    "name": text("Motor's name"),
    "connection": text("Connection of the windings"),
    "rated_current": text("Rated current (phase, peak)"),
    "maximum_current": text("Maximum current (phase, peak)"),
    "rated_speed_rpm": text("Rated speed"),
    "rated_voltage": text("Rated voltage"),
    "maximum_voltage": text("Maximum voltage"),
    "pole_pairs": text("Pole pairs (data sheet)"),
    "maximum_speed_rpm": text("Maximum speed"),
    "maximum_winding_temperature": text("Maximum winding temperature"),
    "serial_number": text("Serial number"),
    "insulation_test_voltage": text("Insulation test voltage (DC)"),
    "hall_sensors": text("Hall sensors"),
}
#: Wires have fields of their own; a photo is put beside the file by who has the file.
WITHOUT_A_FIELD = ("wire_colours", "photo")
_TEXTS = ("name", "serial_number")


def motor_page(panel: Panel, session: Session) -> None:
    """Build the form for a new motor."""
    with frame(panel, session, text("New motor"), "/") as reader:
        if not session.may_change:
            ui.label(reader.say(text("Only an engineer may enter motors."))).classes("text-xl")
            return
        _MotorForm(panel, reader).build()


class _MotorForm:
    def __init__(self, panel: Panel, reader: Reader) -> None:
        self._panel = panel
        self._reader = reader
        self._fields: dict[str, Any] = {}
        self._colours: dict[str, ui.input] = {}

    def build(self) -> None:
        say = self._reader.say
        ui.label(say(text("New motor"))).classes("text-2xl font-bold mb-2")
        with ui.element("section").classes("mb-card grid gap-3 grid-cols-1 md-grid-cols-2 max-w-4xl"):
            for name, field in NameplateSection.model_fields.items():
                if name in WITHOUT_A_FIELD:
                    continue
                self._fields[name] = self._field(name, field)
            for terminal in ("A", "B", "C"):
                asked = text("Colour of wire {terminal}", terminal=terminal)
                self._colours[terminal] = kept(ui.input(say(asked)).props("outlined dense"), asked)
        self._fault = ui.label().props("role=alert").classes("text-lg mt-3 whitespace-pre-line").style("color:#7a130d")
        ui.button(say(text("Save")), on_click=self._save, color=None).classes("mb-go text-xl px-8 mt-2")

    def _field(self, name: str, field: FieldInfo) -> Any:
        say = self._reader.say
        unit = _unit(field)
        label = say(text("{quantity}, {unit}", quantity=LABELS[name], unit=unit) if unit else LABELS[name])
        label += " *" if field.is_required() else ""
        if name == "connection":
            options = {
                WindingConnection.WYE.value: say(text("star (wye)")),
                WindingConnection.DELTA.value: say(text("delta")),
            }
            return ui.select(options, label=label).props("outlined dense")
        if name == "hall_sensors":
            return ui.select({True: say(text("yes")), False: say(text("no"))}, label=label, clearable=True).props(
                "outlined dense"
            )
        field_input = kept(ui.input(label).props("outlined dense"), word(name))
        if name not in _TEXTS:
            field_input.props("inputmode=decimal").props["hint"] = _range(field)
        return field_input

    def _save(self) -> None:
        try:
            path = save_motor(self._panel.motors, self._values())
        except InputError as error:
            self._fault.set_text(self._reader.fault(error))
            return
        ui.navigate.to(f"/?{urlencode({'motor': path.stem})}")

    def _values(self) -> dict[str, Any]:
        values: dict[str, Any] = {}
        for name, field in self._fields.items():
            if isinstance(field.value, bool):
                values[name] = field.value
                continue
            typed = str(field.value or "").strip()
            if typed:
                values[name] = typed if name in (*_TEXTS, "connection") else _number(typed)
        colours = {terminal: str(field.value).strip() for terminal, field in self._colours.items() if field.value}
        return values | ({"wire_colours": colours} if colours else {})


def _unit(field: FieldInfo) -> str:
    extra = field.json_schema_extra
    return str(extra.get("unit", "")) if isinstance(extra, dict) else ""


def _range(field: FieldInfo) -> str:
    """Return the bounds as a reader expects them: `> 0 … 10000`."""
    low, high = "", ""
    for bound in field.metadata:
        match bound:
            case Gt():
                low = f"> {bound.gt:.10g}"
            case Ge():
                low = f"{bound.ge:.10g}"
            case Lt():
                high = f"< {bound.lt:.10g}"
            case Le():
                high = f"{bound.le:.10g}"
    return f"{low} … {high}".replace("-", "−") if low or high else ""


def _number(typed: str) -> object:
    word = typed.replace(",", ".")
    try:
        return int(word) if word.lstrip("+-").isdigit() else float(word)
    except ValueError:
        return typed


def motor_files(folder: Path) -> dict[str, str]:
    """Return the motors of a folder by path, with the name that is shown."""
    return {str(path): path.stem for path in sorted(folder.glob("*.toml"))} if folder.is_dir() else {}
