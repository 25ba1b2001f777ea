"""The procedures as tables: step of the document, what happens, step of the code."""

from collections.abc import Mapping
from typing import Any

from drivers.interfaces.text import Translate, english
from procedures.core.procedure import Procedure
from procedures.core.steps import methods_of


def markdown(procedures: Mapping[str, type[Procedure[Any]]], translate: Translate = english) -> str:
    """Return one Markdown section a procedure: its table of steps, and its settings with defaults."""
    return "\n".join(_section(name, procedure, translate) for name, procedure in procedures.items())


def _section(name: str, procedure: type[Procedure[Any]], translate: Translate) -> str:
    methods = methods_of(procedure)
    module = procedure.__module__.replace(".", "/") + ".py"
    lines = [
        f"## {translate(procedure.title)}: `{name}`",
        "",
        f"{_instruments(procedure)}{_given(procedure)}",
        "",
        f"| document | what happens | by hand | method in `{module}` |",
        "| --- | --- | --- | --- |",
    ]
    lines += [
        f"| {step.identifier} | {translate(step.template)} | {'yes' if step.by_hand else ''} | `{methods[step.identifier]}` |"
        for step in procedure.steps()
    ]
    model = procedure.settings_type()
    if model.model_fields:
        defaults = model().model_dump(mode="json")
        lines += ["", "| setting | default | meaning |", "| --- | --- | --- |"]
        lines += [
            f"| `{key}` | {_shown(defaults[key])} | {field.description} |" for key, field in model.model_fields.items()
        ]
    return "\n".join(lines) + "\n"


def _given(procedure: type[Procedure[Any]]) -> str:
    names = ", ".join(f"`{parameter}`" for parameter in procedure.parameters)
    return f" Gives {names}." if names else ""


def _instruments(procedure: type[Procedure[Any]]) -> str:
    roles = sorted(role.value for role in procedure.roles)
    return (
        f"§{procedure.section}. Needs {', '.join(f'`{role}`' for role in roles)}."
        if roles
        else f"§{procedure.section}."
    )


def _shown(default: object) -> str:
    return "" if default is None else f"`{default}`"
