"""Strict TOML files: whatever is wrong is named with file, key, what was given and what is allowed."""

import difflib
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

from annotated_types import Ge, Gt, Le, Lt, MaxLen, MinLen
from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from bench.errors import InputError


class Section(BaseModel):
    """Base of a table in a file: immutable, unknown keys refused, no NaN and no infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


M = TypeVar("M", bound=BaseModel)
#: No file that people write is longer (bytes).
LONGEST = 16 * 1024 * 1024
_FINITE = "a finite number"


def read(path: Path, what: str) -> tuple[bytes, dict[str, Any]]:
    """Return a TOML file's bytes and content. Raises InputError naming the file (`what` it is), line and cause."""
    try:
        with path.open("rb") as file:
            content = file.read(LONGEST + 1)
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such {what}") from None
    except OSError as error:
        raise InputError(f"{path}: the {what} cannot be read: {error.strerror}") from None
    except ValueError:
        raise InputError(f"{str(path)!r} is no name of a {what}") from None
    if len(content) > LONGEST:
        raise InputError(f"{path}: more than {LONGEST // 2**20} MiB are no {what}")
    return content, parse(content, str(path))


def parse(content: bytes, name: str) -> dict[str, Any]:
    """Return the content of TOML text. Raises InputError naming the file and the place of the fault."""
    try:
        return tomllib.loads(content.decode("utf-8"))
    except UnicodeDecodeError as error:
        raise InputError(f"{name}: not UTF-8 text (byte {error.start})") from None
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"{name}: not valid TOML: {error}") from None
    except RecursionError:
        raise InputError(f"{name}: lists or tables stand too deep in one another") from None


def validate(model: type[M], data: Mapping[str, Any], name: str, prefix: str = "") -> M:
    """Return the validated model. Raises InputError with a line for every fault; `prefix` is the table the data stand in."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise InputError("\n".join(explain(error, model, data, name, prefix))) from None


def explain(
    error: ValidationError, model: type[BaseModel], data: Mapping[str, Any], name: str, prefix: str = ""
) -> list[str]:
    """Return one plain line for every fault of a validation, each once."""
    lines = [f"{name}: {_explain(fault, model, data, prefix)}" for fault in error.errors(include_url=False)]
    return list(dict.fromkeys(lines))


def nearest(word: str, known: Sequence[str]) -> str:
    """Return a hint at the known words: the nearest one, or all of them where none is near."""
    near = difflib.get_close_matches(word, known, n=1, cutoff=0.6)
    return f"did you mean {near[0]}?" if near else f"known are: {', '.join(sorted(known))}"


def _explain(fault: ErrorDetails, model: type[BaseModel], data: Mapping[str, Any], prefix: str) -> str:
    location = _real_location(fault["loc"], data)
    key = _dotted(prefix, location)
    field = _field(model, location)
    kind = fault["type"]
    if kind == "extra_forbidden":
        owner = _model_at(model, location[:-1])
        known = [f.alias or n for n, f in owner.model_fields.items()] if owner else []
        return f"unknown key {key}; {nearest(str(location[-1]), known)}"
    if kind == "missing":
        return f"{key} is missing; give {_wanted(field)}"
    if kind == "value_error":
        message = fault["msg"].removeprefix("Value error, ")
        return f"{key}: {message}" if key else message
    given = fault["input"]
    if isinstance(given, str) and _unit(field) is not None:
        unit = _unit(field)
        number = f"give a number in {unit}" if unit else "give a number without a unit"
        return f"{key} = {given!r} is text, not a number; {number}, allowed is {_wanted(field)}"
    return f"{key} = {_shown(given)}; allowed is {_wanted(field)}{_also(fault)}"


def _also(fault: ErrorDetails) -> str:
    known = (
        "greater",
        "less",
        "float",
        "int",
        "finite",
        "string_type",
        "literal",
        "enum",
        "list",
        "tuple",
        "dict",
        "bool",
        "date_type",
    )
    return "" if fault["type"].startswith(known) else f" ({fault['msg']})"


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"{text[:57]}..."


def _dotted(prefix: str, location: Sequence[str | int]) -> str:
    words = prefix
    for part in location:
        if isinstance(part, int):
            words += f"[{part}]"
        else:
            words += f".{part}" if words else part
    return words


def _real_location(location: tuple[int | str, ...], data: object) -> tuple[int | str, ...]:
    """Drop what is in pydantic's location but not in the file: union tags, items of a number that stands for a list."""
    kept: list[int | str] = []
    here: object = data
    for position, part in enumerate(location):
        last = position == len(location) - 1
        if isinstance(part, int):
            if not isinstance(here, list):
                continue
            here = here[part] if part < len(here) else None
        elif isinstance(here, Mapping):
            if part not in here and not last:
                continue
            here = here.get(part)
        else:
            continue
        kept.append(part)
    return tuple(kept)


def _models(annotation: object) -> list[type[BaseModel]]:
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return [annotation]
    return [model for argument in get_args(annotation) for model in _models(argument)]


def _find(model: type[BaseModel], key: str) -> FieldInfo | None:
    for name, field in model.model_fields.items():
        if key in (name, field.alias):
            return field
    return None


def _model_at(model: type[BaseModel], location: Sequence[str | int]) -> type[BaseModel] | None:
    here: type[BaseModel] | None = model
    for part in location:
        if isinstance(part, int):
            continue
        field = _find(here, part) if here else None
        inner = _models(field.annotation) if field else []
        if not inner and field is not None and here is not None:
            return None
        # A table whose keys are free (roles, terminals) keeps the model of its values.
        here = inner[0] if inner else here
    return here


def _field(model: type[BaseModel], location: Sequence[str | int]) -> FieldInfo | None:
    words = [part for part in location if isinstance(part, str)]
    if not words:
        return None
    owner = _model_at(model, words[:-1])
    return _find(owner, words[-1]) if owner else None


def _unit(field: FieldInfo | None) -> str | None:
    extra = field.json_schema_extra if field else None
    unit = extra.get("unit") if isinstance(extra, dict) else None
    return unit if isinstance(unit, str) else None


def _wanted(field: FieldInfo | None) -> str:
    """Say what a field takes: its description, its bounds and its unit."""
    if field is None:
        return "another kind of value"
    low, high = _bounds(field)
    unit = _unit(field)
    suffix = f" {unit}" if unit else ""
    if not (low or high):
        return field.description or (f"{_FINITE} in {unit}" if unit else _choices(field.annotation))
    number = "a whole number" if int in (field.annotation, *get_args(field.annotation)) else "a number"
    note = f" ({field.description})" if field.description else ""
    return f"{number} {' and '.join(part for part in (low, high) if part)}{suffix}{note}"


def _choices(annotation: object) -> str:
    from enum import Enum

    if isinstance(annotation, type) and issubclass(annotation, Enum):
        return " or ".join(repr(member.value) for member in annotation)
    if annotation is str:
        return "text in quotes"
    if annotation is bool:
        return "true or false"
    if annotation in (int, float):
        return _FINITE
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        return f"a table with {', '.join(annotation.model_fields)}"
    inner = [argument for argument in get_args(annotation) if argument is not type(None)]
    if inner and all(isinstance(choice, str) for choice in inner):
        return " or ".join(repr(choice) for choice in inner)
    return _choices(inner[0]) if len(inner) == 1 else "a list or table as the documentation describes"


def _bounds(field: FieldInfo) -> tuple[str, str]:
    low = high = ""
    for rule in field.metadata:
        if isinstance(rule, Gt):
            low = f"above {rule.gt:g}"
        elif isinstance(rule, Ge):
            low = f"of at least {rule.ge:g}"
        elif isinstance(rule, Lt):
            high = f"below {rule.lt:g}"
        elif isinstance(rule, Le):
            high = f"up to {rule.le:g}"
        elif isinstance(rule, MinLen | MaxLen):
            continue
    return low, high
