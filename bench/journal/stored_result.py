"""A procedure's result as it stands in the journal, and back."""

import math
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from string import Formatter
from typing import Any

from drivers.interfaces.text import Text, word
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.result import Contribution, Notice, Parameter, ProcedureResult, Withheld
from procedures.known_parameters import definition_of

#: How a value may be formatted: with a short width, so that no file can ask for a line of any length.
_FORM = re.compile(r"[<>^]?[-+ ]?0?\d{0,2}(\.\d{1,2})?[a-zA-Z%]?")


@dataclass(frozen=True)
class Sentence:
    """Stores sentences with their values in the journal, so that they can be shown in any language."""

    text: Text


def store(result: ProcedureResult) -> dict[str, Any]:
    """Return the whole result in JSON's types; `withheld` is there where something is, as older versions had it never."""
    withheld = [_store_withheld(reason) for reason in result.withheld]
    return {
        "procedure": result.procedure,
        "section": result.section,
        "parameters": [_store_parameter(parameter) for parameter in result.parameters],
        "warnings": [store_notice(notice) for notice in result.warnings],
        "findings": dict(result.findings),
        **({"withheld": withheld} if withheld else {}),
    }


def restore(data: Mapping[str, Any]) -> ProcedureResult:
    """Return the result that `store` took apart; one of a version that withheld nothing says nothing of it."""
    return ProcedureResult(
        procedure=data["procedure"],
        section=data["section"],
        parameters=tuple(restore_parameter(entry) for entry in data["parameters"]),
        warnings=tuple(restore_notice(entry) for entry in data["warnings"]),
        findings=data["findings"],
        withheld=tuple(restore_withheld(entry) for entry in data.get("withheld", ())),
    )


def _store_parameter(parameter: Parameter) -> dict[str, Any]:
    budget = [_store_row(row) for row in parameter.budget]
    return {"name": parameter.name, **parameter.as_dict(budget)}


def _store_row(row: Contribution) -> dict[str, Any]:
    """Return a row of a budget; most of a journal is these, so that words stand by themselves and no identity twice."""
    stored: dict[str, Any] = {**vars(row), "source": _store_source(row.source)}
    if row.source.values and row.identity == str(row.source):
        del stored["identity"]
    return stored


def _restore_row(data: Mapping[str, Any]) -> Contribution:
    source = _restore_source(data["source"])
    own = str(source) if isinstance(data["source"], dict) else ""
    return Contribution(**{"identity": own, **data, "source": source})


def _store_source(source: object) -> Any:
    if not isinstance(source, Text):
        return _store_value(source)
    if not source.values:
        return source.template
    return {"template": source.template, "values": {name: _store_source(v) for name, v in source.values.items()}}


def _restore_source(stored: Any) -> Text:
    """Return an input's name; older journals have it as a finished English string."""
    if isinstance(stored, str):
        return word(stored)
    values = {
        name: _restore_source(value) if isinstance(value, str | dict) else value
        for name, value in stored["values"].items()
    }
    return _sayable(Text(stored["template"], values))


def _store_withheld(reason: Withheld) -> dict[str, Any]:
    return {"name": reason.name, **reason.as_dict(), "message": store_text(reason.message)}


def restore_withheld(data: Mapping[str, Any]) -> Withheld:
    """Return why a parameter is withheld, as a stored result or (in words only) `--json` has it."""
    message = data["message"]
    return Withheld(
        name=data["name"],
        procedure=data["procedure"],
        section=data["section"],
        cause=data["cause"],
        message=Text("{said}", {"said": message}) if isinstance(message, str) else restore_text(message),
        definition=stored_definition(data, data["name"]),
    )


def store_notice(notice: Notice) -> dict[str, Any]:
    """Return a warning in JSON's types."""
    return {"id": notice.identifier, "text": store_text(notice.message)}


def restore_notice(data: Mapping[str, Any]) -> Notice:
    """Return the warning that `store_notice` took apart."""
    return Notice(data["id"], restore_text(data["text"]))


def store_text(message: Text) -> dict[str, Any]:
    """Return a sentence with its values, so that it can be said in another language later."""
    return {"template": message.template, "values": {name: _store_value(v) for name, v in message.values.items()}}


def restore_text(data: Mapping[str, Any]) -> Text:
    """Return the sentence that `store_text` took apart. Raises ValueError, KeyError or TypeError for one that cannot be said."""
    return _sayable(Text(data["template"], {name: _restore_value(value) for name, value in data["values"].items()}))


def store_sentence(sentence: Sentence) -> dict[str, Any]:
    """Return it in JSON's types."""
    return store_text(sentence.text)


def restore_sentence(data: Mapping[str, Any]) -> Sentence:
    """Return the sentence that `store_sentence` took apart."""
    return Sentence(restore_text(data))


def _sayable(sentence: Text) -> Text:
    for _, name, form, _ in Formatter().parse(sentence.template):
        if name is not None and not (name.isidentifier() and _FORM.fullmatch(form or "")):
            raise ValueError(f"{{{name}:{form}}} is no place for a value")
    sentence.render()
    return sentence


def _store_value(value: object) -> Any:
    if isinstance(value, Text):
        return {"text": store_text(value)}
    if isinstance(value, bool | str) or value is None:
        return value
    if isinstance(value, int | float):
        # A number keeps its kind: a template may format it.
        number = value if isinstance(value, int) and type(value) is int else float(value)
        return number if math.isfinite(number) else {"number": str(number)}
    if isinstance(value, Sequence):
        return [_store_value(item) for item in value]
    return str(value)


def _restore_value(value: Any) -> object:
    if isinstance(value, dict):
        return float(value["number"]) if "number" in value else restore_text(value["text"])
    if isinstance(value, list):
        return [_restore_value(item) for item in value]
    return value


def stored_definition(data: Mapping[str, Any], name: str) -> ParameterDefinition | None:
    """Return what defines a stored parameter: its record, or where it says nothing (of an older run) what is known here."""
    told = data.get("definition")
    if told is None:
        return definition_of(name)
    return ParameterDefinition(
        name,
        str(told["symbol"]),
        data["unit"],
        word(str(told["label"])),
        str(data.get("convention", "")),
        reader_unit=str(told["reader_unit"]),
    )


def restore_parameter(data: Mapping[str, Any]) -> Parameter:
    """Return a parameter of a stored result."""
    low, high = data["coverage_interval"]
    freedom = data["degrees_of_freedom"]
    return Parameter(
        name=data["name"],
        value=_float(data["value"]),
        unit=data["unit"],
        standard_uncertainty=_float(data["standard_uncertainty"]),
        degrees_of_freedom=math.inf if freedom is None else _float(freedom),
        coverage_interval=(_float(low), _float(high)),
        procedure=data["procedure"],
        section=data["section"],
        estimator=data["estimator"],
        note_value=None if data["note_value"] is None else _float(data["note_value"]),
        convention=data["convention"],
        winding=None if data["winding"] is None else _float(data["winding"]),
        source=data["source"],
        budget=tuple(_restore_row(row) for row in data["budget"]),
        definition=stored_definition(data, data["name"]),
    )


def _float(value: float | str) -> float:
    return float(value)
