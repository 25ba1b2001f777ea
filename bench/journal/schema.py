"""The JSON schema of a journal's lines."""

from collections.abc import Mapping
from typing import Any

from pydantic import TypeAdapter
from pydantic.json_schema import GenerateJsonSchema, JsonSchemaValue
from pydantic_core import core_schema

from bench.journal.codec import KINDS
from bench.journal.events.run import SCHEMA
from bench.journal.stored_result import Sentence
from drivers.interfaces.text import Text
from procedures.core.events import UnknownAction
from procedures.core.parameter_definition import ParameterDefinition
from procedures.core.result import Notice, Parameter, Withheld

DIALECT = "https://json-schema.org/draft/2020-12/schema"
#: JSON has no form for these; they stand as texts.
_NUMBER: JsonSchemaValue = {"anyOf": [{"type": "number"}, {"enum": ["NaN", "Infinity", "-Infinity"]}]}
_SENTENCE: JsonSchemaValue = {
    "type": "object",
    "properties": {"template": {"type": "string"}, "values": {"type": "object"}},
    "required": ["template", "values"],
}
#: What stands in another form in the journal than in the program.
_STORED: Mapping[type, JsonSchemaValue] = {
    Text: {"type": "string"},
    ParameterDefinition: {
        "type": "object",
        "description": "What readers need of a parameter that is not in the table.",
        "properties": {key: {"type": "string"} for key in ("symbol", "label", "reader_unit")},
        "required": ["symbol", "label", "reader_unit"],
    },
    UnknownAction: {"type": "object"},
    Withheld: {
        "type": "object",
        "description": "A parameter that is not given: which, by which procedure, the likely cause, and why as a template with values.",
        "properties": {
            **{key: {"type": "string"} for key in ("name", "procedure", "section", "cause", "unit")},
            "message": _SENTENCE,
            "definition": {"type": "object"},
        },
        "required": ["name", "procedure", "section", "cause", "message"],
    },
    Sentence: _SENTENCE,
    Notice: {
        "type": "object",
        "description": "A warning: its id, and its sentence as a template with values.",
        "properties": {"id": {"type": "string"}, "text": _SENTENCE},
        "required": ["id", "text"],
    },
}


class _JournalSchema(GenerateJsonSchema):
    def float_schema(self, schema: core_schema.FloatSchema) -> JsonSchemaValue:
        return dict(_NUMBER)

    def dataclass_schema(self, schema: core_schema.DataclassSchema) -> JsonSchemaValue:
        stored = _STORED.get(schema["cls"])
        if stored is not None:
            return dict(stored)
        result = super().dataclass_schema(schema)
        if schema["cls"] is Parameter:
            # Without end, they are null.
            result["properties"]["degrees_of_freedom"]["anyOf"] = [*_NUMBER["anyOf"], {"type": "null"}]
        return result


def journal_schema() -> dict[str, Any]:
    """Return the schema (draft 2020-12) of one line of `journal.jsonl` or `guardian.jsonl`, as this version writes them."""
    made, definitions = TypeAdapter.json_schemas(
        [(kind, "validation", TypeAdapter(each)) for kind, each in KINDS.items()], schema_generator=_JournalSchema
    )
    return {
        "$schema": DIALECT,
        "$id": f"urn:motorbench:journal:{SCHEMA}",
        "title": "A line of a motorbench journal",
        "version": SCHEMA,
        "type": "object",
        "properties": {
            "n": {"type": "integer", "minimum": 1, "description": "The line's number."},
            "wall": {"type": "string", "format": "date-time", "description": "Wall time, UTC."},
            "time": {**_NUMBER, "description": "Bench time of the session (s)."},
            "kind": {"type": "string", "description": "What happened."},
            "data": {"type": "object"},
            "previous": {"type": "string", "description": "SHA-256 of the line before; empty in the first."},
        },
        "required": ["n", "wall", "time", "kind", "data", "previous"],
        "additionalProperties": False,
        "oneOf": [
            {
                "properties": {"kind": {"const": kind}, "data": data},
                "x-durable": KINDS[kind].durable,
                "x-closing": KINDS[kind].closing,
            }
            for (kind, _), data in made.items()
        ],
        **definitions,
    }
