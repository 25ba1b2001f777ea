"""`motorbench procedures`: what can be measured, and by which steps."""

import sys
from typing import Any

from bench.cli.options import Json, Language
from bench.cli.output import broken_of, print_json, say_broken
from bench.i18n.errors import UsageError, at
from bench.i18n.language import language_of, translator
from bench.plugins.catalogue import OURS
from bench.run.console import console_on
from bench.station.station_file import catalogues_at
from drivers.interfaces.text import Translate, text
from procedures.core.procedure import Procedure
from procedures.core.steps import Step


def procedures(
    *names: str, station: str = "virtual", json: Json = False, markdown: bool = False, language: Language = "auto"
) -> None:
    """List the procedures, all or those named, with their place in the note, instruments, steps and settings.

    Parameters
    ----------
    names
        Names of procedures; the list without a name shows them.
    station
        A station file. Its plug-ins are listed too.
    markdown
        Print the tables of `docs/reference/procedures.md`: step of the document, step of the code.

    """
    translate = translator(language_of(language))
    catalogues = catalogues_at(station)
    found = catalogues.procedures
    listed = {
        name: {
            **describe(found.need(name, lambda why, name=name: UsageError(at(repr(name), why))), translate),  # type: ignore[misc]
            "from": found.origin(name).as_dict(),
        }
        for name in names or found
    }
    if json:
        print_json({"procedures": listed, "broken": [one.as_dict() for one in broken_of(catalogues, found)]})
        return
    if markdown:
        from reports.tables.procedure_table import markdown as tables

        sys.stdout.write(tables({name: found[name] for name in listed}, translate))
        return
    console = console_on(sys.stdout)
    shown = sorted(listed.items(), key=lambda item: tuple(item[1][kind] for kind in reversed(_KINDS)))
    for number, (name, entry) in enumerate(shown):
        for kind, heading in _KINDS.items():
            if entry[kind] and not shown[number - 1][1][kind]:
                console.print(f"[bold underline]{heading.render(translate)}[/bold underline]")
                console.print()
        origin = "" if found.origin(name).name == OURS else f"  [dim]({found.origin(name)})[/dim]"
        console.print(f"[bold]{name}[/bold]  §{entry['section']}  {entry['title']}{origin}")
        if entry["roles"]:
            console.print(f"  [dim]{translate(', ').join(translate(role) for role in entry['roles'])}[/dim]")
        defaults = found[name].settings_type()().model_dump()
        for step in found[name].steps():
            said = _sentence(step, defaults, translate)
            console.print(f"  {step.identifier:<12}{'✋ ' if step.by_hand else '   '}{said}", markup=False)
        for setting, told in entry["settings"].items():
            said = translate(told["description"])
            console.print(f"  --set {setting}={told['default']}  ({said})", markup=False, style="dim")
        console.print()
    say_broken(broken_of(catalogues, found), translate)


def _sentence(step: Step, defaults: dict[str, object], translate: Translate) -> str:
    """Return a step's sentence with the defaults in place, or as written where the procedure has the values when it runs only."""
    try:
        return step.words(defaults).render(translate)
    except (LookupError, ValueError, TypeError, AttributeError):
        return translate(step.template)


#: Procedures that `all` does not include, in the order of the list, with what stands above them.
_KINDS = {
    "at_load": text("At every current, under load (not part of all; run each by its name)"),
    "end_of_line": text("End-of-line checks (not part of all; run each by its name)"),
    "manual": text("By hand (a run of its own)"),
}


def describe(procedure: type[Procedure[Any]], translate: Translate) -> dict[str, Any]:
    """Return a procedure in JSON's types; step sentences keep the names of settings in braces."""
    return {
        "title": translate(procedure.title),
        "section": procedure.section,
        "end_of_line": procedure.end_of_line,
        "at_load": procedure.at_load,
        "manual": procedure.manual,
        "roles": sorted(role.value for role in procedure.roles),
        "gives": list(procedure.parameters),
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
