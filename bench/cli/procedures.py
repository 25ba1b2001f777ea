"""`motorbench procedures`: what can be measured, and by which steps."""

import sys
from typing import Any

from bench.cli.output import print_json
from bench.i18n.language import language_of, translator
from bench.run.console import console_on
from drivers.interfaces.text import Translate, text
from procedures.catalogue import catalogue
from procedures.core.procedure import Procedure


def procedures(*, json: bool = False, markdown: bool = False, language: str = "auto") -> None:
    """List the procedures with their place in the note, instruments, steps and settings.

    Parameters
    ----------
    json
        Print one JSON object and nothing else.
    markdown
        Print the tables of `docs/procedures.md`: step of the document, step of the code.
    language
        en, zh, or auto by the locale.

    """
    translate = translator(language_of(language))
    listed = {name: describe(procedure, translate) for name, procedure in catalogue().items()}
    if json:
        print_json({"procedures": listed})
        return
    if markdown:
        from reports.tables.procedure_table import markdown as tables

        sys.stdout.write(tables(catalogue(), translate))
        return
    console = console_on(sys.stdout)
    shown = sorted(listed.items(), key=lambda item: item[1]["end_of_line"])
    for number, (name, entry) in enumerate(shown):
        if entry["end_of_line"] and not shown[number - 1][1]["end_of_line"]:
            heading = text("End-of-line checks (each is run where it is named; all does not include them)").render(
                translate
            )
            console.print(f"[bold underline]{heading}[/bold underline]")
            console.print()
        console.print(f"[bold]{name}[/bold]  §{entry['section']}  {entry['title']}")
        if entry["roles"]:
            console.print(f"  [dim]{', '.join(entry['roles'])}[/dim]")
        for step in entry["steps"]:
            console.print(f"  {step['id']:<12}{'✋ ' if step['by_hand'] else '   '}{step['text']}", markup=False)
        for setting, told in entry["settings"].items():
            said = translate(told["description"])
            console.print(f"  --set {setting}={told['default']}  ({said})", markup=False, style="dim")
        console.print()


def describe(procedure: type[Procedure[Any]], translate: Translate) -> dict[str, Any]:
    """Return a procedure in JSON's types; step sentences keep the names of settings in braces."""
    return {
        "title": translate(procedure.title),
        "section": procedure.section,
        "end_of_line": procedure.end_of_line,
        "roles": sorted(role.value for role in procedure.roles),
        "gives": list(procedure.gives),
        "steps": [
            {"id": step.identifier, "text": translate(step.template), "by_hand": step.by_hand}
            for step in procedure.steps()
        ],
        "settings": _settings(procedure),
    }


def _settings(procedure: type[Procedure[Any]]) -> dict[str, Any]:
    model = procedure.settings_type()
    defaults = model().model_dump(mode="json")
    return {
        name: {"default": defaults[name], "unit": _unit(field.description), "description": field.description or ""}
        for name, field in model.model_fields.items()
    }


def _unit(description: str | None) -> str | None:
    """Return the unit at the end of a description, as in `record's length, s`."""
    last = (description or "").split(";")[0].rpartition(", ")[2].strip()
    return last if last in _UNITS else None


_UNITS = frozenset(
    {"s", "Hz", "V", "A", "Ω", "H", "rpm", "rad/s", "°C", "K", "1/K", "N·m", "kg·m²", "N·m·s/rad", "V rms", "m"}
)
