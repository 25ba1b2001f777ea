"""Settings of procedures that are to be other than usual: chosen from a list, typed as on the command line."""

from collections.abc import Collection, Iterable, Mapping

from nicegui import ui

from bench.panel.offer import Offered
from bench.panel.pages.parts import expansion
from bench.panel.pages.reader import Reader
from drivers.interfaces.text import Text, text


class SettingsPart:
    """The settings that were changed; `before` are those of a run that is to be done as before, as `procedure.name=value`."""

    def __init__(self, reader: Reader, before: Iterable[str] = ()) -> None:
        self._reader = reader
        self._offered: Mapping[str, Offered] = {}
        given = (setting.partition("=") for setting in before)
        self._before = {name: value for name, _, value in given if "." in name}
        self._typed: dict[str, ui.input] = {}
        with expansion(reader.say(text("Settings"))) as self._part:
            self._rows = ui.element("div").classes("w-full")
            self._choice = ui.select({}, label=reader.say(text("Change a setting")), with_input=True)
            self._choice.props("outlined dense").classes("w-full").on_value_change(self._chosen)

    def offer(self, offered: Mapping[str, Offered]) -> None:
        """Offer the settings of these procedures."""
        self._offered = offered
        options = {
            f"{name}.{setting}": self._words(f"{name}.{setting}")
            for name, procedure in offered.items()
            if not procedure.manual
            for setting in procedure.settings
        }
        self._choice.set_options(options)
        for name, value in self._before.items():
            if name in options:
                self._add(name, value)
        if self._typed:
            self._part.open()
        self._before = {}

    def of(self, procedures: Collection[str]) -> list[str]:
        """Return the settings of these procedures that were typed, as the command line takes them."""
        typed = {name: str(field.value or "").strip() for name, field in self._typed.items()}
        return [f"{name}={value}" for name, value in typed.items() if value and name.partition(".")[0] in procedures]

    def _chosen(self) -> None:
        name = self._choice.value
        if name:
            self._choice.set_value(None)
            self._add(str(name), "")

    def _add(self, name: str, value: str) -> None:
        if name not in self._typed:
            with self._rows:
                field = ui.input(self._words(name), value=value).props("outlined stack-label autocomplete=off")
                self._typed[name] = field.classes("w-full mb-2")
        self._typed[name].run_method("focus")

    def _words(self, name: str) -> str:
        procedure, _, setting = name.partition(".")
        offered = self._offered[procedure]
        told = offered.settings[setting]
        usual = told["default"]
        values = {"procedure": Text(offered.title), "what": Text(str(told["description"]))}
        if usual is None or usual == []:
            return self._reader.say(text("{procedure}: {what}", **values))
        return self._reader.say(text("{procedure}: {what} (usually {usual})", **values, usual=_shown(usual)))


def _shown(usual: object) -> str:
    if isinstance(usual, float):
        return f"{usual:g}"
    return ", ".join(map(_shown, usual)) if isinstance(usual, list) else str(usual)
