"""Describes the values allowed for a key of a file: kind, bounds, unit, description."""

from collections.abc import Sequence
from typing import Annotated, get_args, get_origin

from annotated_types import Ge, Gt, Le, Lt
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from drivers.interfaces.text import Text, text


def unit_of(field: FieldInfo | None) -> str | None:
    """Return the unit of a field's number: empty for one without, None for a field that is not known to have one."""
    extra = field.json_schema_extra if field else None
    unit = extra.get("unit") if isinstance(extra, dict) else None
    return unit if isinstance(unit, str) else None


def wanted_by(field: FieldInfo | None) -> Text | str:
    """Say what a field takes: its description, its bounds and its unit."""
    if field is None:
        return text("another kind of value")
    bounds = _bounds(field)
    unit = unit_of(field)
    # A brace in a description stands for itself.
    described = Text((field.description or "").replace("{", "{{").replace("}", "}}"))
    if bounds is None:
        if field.description:
            return described
        return text("a finite number in {unit}", unit=unit) if unit else choices(field.annotation)
    if unit:
        bounds = Text("{bounds} {unit}", {"bounds": bounds, "unit": unit})
    whole = int in (field.annotation, *get_args(field.annotation))
    number = text("a whole number {bounds}", bounds=bounds) if whole else text("a number {bounds}", bounds=bounds)
    return text("{number} ({note})", number=number, note=described) if field.description else number


def choices(annotation: object) -> Text | str:
    """Say what values of a type there are, or what its table holds."""
    from enum import Enum

    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return _either([repr(member.value) for member in annotation])
    if annotation is str:
        return text("text in quotes")
    if annotation is bool:
        return text("true or false")
    if annotation in (int, float):
        return text("a finite number")
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return text("a table with {keys}", keys=list(annotation.model_fields))
    if get_origin(annotation) is Annotated:
        return choices(get_args(annotation)[0])
    inner = [argument for argument in get_args(annotation) if argument is not type(None)]
    if inner and all(isinstance(choice, str) for choice in inner):
        return _either([repr(choice) for choice in inner])
    return choices(inner[0]) if len(inner) == 1 else text("a list or table as the documentation describes")


def _either(choices: Sequence[str]) -> Text | str:
    result: Text | str = choices[0]
    for choice in choices[1:]:
        result = text("{this} or {that}", this=result, that=choice)
    return result


def _bounds(field: FieldInfo) -> Text | None:
    low = high = None
    for rule in field.metadata:
        if isinstance(rule, Gt):
            low = text("above {bound:g}", bound=rule.gt)
        elif isinstance(rule, Ge):
            low = text("of at least {bound:g}", bound=rule.ge)
        elif isinstance(rule, Lt):
            high = text("below {bound:g}", bound=rule.lt)
        elif isinstance(rule, Le):
            high = text("up to {bound:g}", bound=rule.le)
    return text("{low} and {high}", low=low, high=high) if low and high else low or high
