"""The commands' help in the reader's language; its keys are the pieces of the English one, as docstrings have them."""

from typing import TYPE_CHECKING, Any

from bench.cli.line_breaks import Broken
from drivers.interfaces.text import Text, Translate, text

if TYPE_CHECKING:
    from cyclopts import App
    from cyclopts.help import HelpEntry, HelpPanel
    from rich.console import Console, ConsoleOptions

#: What stands for a value that is to be typed.
_PLACES = {
    str(place): place
    for place in (
        text("COMMAND"),
        text("[OPTIONS]"),
        text("[ARGS]"),
        text("[ARGS...]"),
        text("STR"),
        text("STR..."),
        text("PATH"),
        text("PATH..."),
        text("INT"),
        text("INT..."),
        text("FLOAT"),
        text("FLOAT..."),
        text("CHOICE"),
        text("CHOICE..."),
    )
}
_TITLES = {"Commands": text("Commands"), "Arguments": text("Arguments"), "Parameters": text("Options")}
#: Defaults that say nothing: not given, given never, not asked for.
_SILENT = ("", '""', "()", "False", "None")


def in_language(app: "App", translate: Translate) -> "App":
    """Return the application with its help in a language: the formatter is called with what the English help would hold."""
    app.help_formatter = _Help(translate)
    app.help_epilogue = translate(str(app.help_epilogue or ""))
    return app


class _Help:
    """Translates pages, and has them drawn as they are in English."""

    def __init__(self, translate: Translate) -> None:
        from cyclopts.help import DefaultFormatter

        self._translate = translate
        self._drawn = DefaultFormatter()

    def render_usage(self, console: "Console", options: "ConsoleOptions", usage: Any) -> None:
        words = " ".join(self._place(place) for place in str(usage).split())
        console.print(self._say(text("Usage: {usage}", usage=words)), markup=False, highlight=False, style="bold")
        console.print()

    def render_description(self, console: "Console", options: "ConsoleOptions", description: Any) -> None:
        if words := self._words(description):
            console.print(Broken(words), markup=False, highlight=False)
            console.print()

    def __call__(self, console: "Console", options: "ConsoleOptions", panel: "HelpPanel") -> None:
        title = str(panel.title)
        entries = [self._entry(entry) for entry in panel.entries]
        said = self._say(_TITLES[title]) if title in _TITLES else title
        self._drawn(console, options, panel.copy(title=said, entries=entries))

    def _entry(self, entry: "HelpEntry") -> "HelpEntry":
        said = [self._words(entry.description)]
        if entry.choices:
            said.append(self._say(text("[choices: {choices}]", choices=", ".join(entry.choices))))
        if (entry.default or "") not in _SILENT:
            said.append(self._say(text("[default: {default}]", default=_typed(str(entry.default)))))
        if entry.required:
            said.append(self._say(text("[required]")))
        place = self._place(entry.metavar) if entry.metavar else entry.metavar
        words = " ".join(filter(None, said))
        return entry.copy(description=Broken(words), metavar=place, choices=None, default=None, required=False)

    def _words(self, described: Any) -> str:
        """Return a description in the language; in a docstring it may stand on several lines."""
        plain = getattr(getattr(described, "primary_renderable", described), "plain", described)
        return "\n".join(self._translate(" ".join(part.split())) for part in str(plain or "").split("\n\n") if part)

    def _place(self, place: str) -> str:
        return self._say(_PLACES[place]) if place in _PLACES else place

    def _say(self, said: Text) -> str:
        return said.render(self._translate)


def _typed(default: str) -> str:
    """Return a default as one types it: several values of an option stand one after the other."""
    several = default[1:-1] if default[:1] == "(" else ""
    return " ".join(each.strip(" '\"") for each in several.split(",") if each.strip()) or default
