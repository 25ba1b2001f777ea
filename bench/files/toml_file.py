"""Strict TOML files: whatever is wrong is named with file, key, what was given and what is allowed."""

import codecs
import difflib
import re
import tomllib
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import Any, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, ValidationError
from pydantic.fields import FieldInfo
from pydantic_core import ErrorDetails

from bench.files.toml_slips import slip_in
from bench.files.wanted import choices, unit_of, wanted_by
from bench.i18n.errors import FileError, at
from drivers.interfaces.text import Text, lines, reason_of, text, text_of


class Section(BaseModel):
    """Base of a table in a file: immutable, unknown keys refused, no NaN and no infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


M = TypeVar("M", bound=BaseModel)
#: No file that people write is longer (bytes).
LONGEST = 16 * 1024 * 1024
#: By what pydantic tells a key of a table from its value.
_KEY = "[key]"
#: So many letters show the encoding.
_SHOWN = 4
#: What pydantic says of values, by its own names for what stands in the sentence.
_LIBRARYS = (
    text("String should have at least {min_length} character"),
    text("String should have at least {min_length} characters"),
    text("String should match pattern '{pattern}'"),
    text("{field_type} should have at least {min_length} item after validation, not {actual_length}"),
    text("{field_type} should have at least {min_length} items after validation, not {actual_length}"),
    text("{field_type} should have at most {max_length} items after validation, not {actual_length}"),
)
#: What Python's parser says; what names a key is left as it is.
_FAULTS = {
    str(fault): fault
    for fault in (
        text("Invalid statement"),
        text("Invalid value"),
        text("Invalid date or datetime"),
        text("Invalid initial character for a key part"),
        text("Expected newline or end of document after a statement"),
        text("Expected '=' after a key in a key/value pair"),
        text("Expected ']' at the end of a table declaration"),
        text("Expected ']]' at the end of an array declaration"),
        text("Cannot overwrite a value"),
        text("Unclosed array"),
        text("Unclosed inline table"),
        text("Unterminated string"),
        text("Unescaped '\\\\' in a string"),
    )
}


def read(path: Path, what: Text, remedy: Text | None = None) -> tuple[bytes, dict[str, Any]]:
    """Return a TOML file's bytes, without the byte order mark that some editors put first, and content.

    Raises FileError naming the file (`what` it is), line and cause, and the `remedy` where there is none.
    """
    try:
        with path.open("rb") as file:
            content = file.read(LONGEST + 1)
    except FileNotFoundError:
        missing = text("{path}: there is no such {what}", path=path, what=what)
        raise FileError(lines((missing, remedy), between="; ") if remedy else missing) from None
    except OSError as error:
        message = text("{path}: the {what} cannot be read: {error}", path=path, what=what, error=reason_of(error))
        raise FileError(message) from None
    except ValueError:
        raise FileError(text("{path!r} is not the name of a {what}", path=str(path), what=what)) from None
    if len(content) > LONGEST:
        raise FileError(
            text("{path}: larger than {most} MiB; no {what} is that large", path=path, most=LONGEST // 2**20, what=what)
        )
    content = content.removeprefix(codecs.BOM_UTF8)
    return content, parse(content, str(path))


def parse(content: bytes, name: str) -> dict[str, Any]:
    """Return the content of TOML text. Raises FileError naming the file and the place of the fault."""
    try:
        words = decoded(content, name)
        return tomllib.loads(words)
    except tomllib.TOMLDecodeError as error:
        raise FileError(text("{name}: not valid TOML: {error}", name=name, error=_parsed(error, words))) from None
    except RecursionError:
        raise FileError(text("{name}: lists or tables are nested too deeply", name=name)) from None


def decoded(content: bytes, name: str) -> str:
    """Return the text in a file's bytes. Raises FileError naming the file, the place, and how to save it."""
    try:
        words = content.decode("utf-8")
    except UnicodeDecodeError as error:
        raise not_utf8(name, content[:2], error) from None
    # ASCII in UTF-16 without its mark is UTF-8 too, with a zero byte beside each letter.
    if "\0" in words[:_SHOWN]:
        raise FileError(_utf16(name))
    return words


def not_utf8(name: str, first: bytes, error: UnicodeDecodeError) -> FileError:
    """Return the error of a file whose encoding may be recognised by its `first` bytes."""
    if first in (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE):
        return FileError(_utf16(name))
    return FileError(
        text(
            "{name}: not UTF-8 text (byte {start}); save it as UTF-8, in the editor's Save As",
            name=name,
            start=error.start,
        )
    )


def _utf16(name: str) -> Text:
    return text("{name}: the text is UTF-16 (Notepad's Unicode); save it as UTF-8, in the editor's Save As", name=name)


def _parsed(error: tomllib.TOMLDecodeError, words: str) -> Text:
    """Return what the parser says of the words, its place apart: it has no other way to tell."""
    what, _, place = str(error).rpartition(" (at ")
    said = _FAULTS.get(what, Text("{what}", {"what": what or str(error)}))
    match = re.fullmatch(r"line (\d+), column (\d+)\)", place)
    if match:
        # Lines of TOML end with a line feed only.
        slip = slip_in(words.split("\n")[int(match[1]) - 1])
        return text("line {line}, column {column}: {said}", line=match[1], column=match[2], said=slip or said)
    return text("at its end: {said}", said=said)


def validate(model: type[M], data: Mapping[str, Any], name: str, prefix: str = "") -> M:
    """Return the validated model. Raises InputError with a line for every fault; `prefix` is the table the data stand in."""
    try:
        return model.model_validate(data)
    except ValidationError as error:
        raise FileError(lines(explain(error, model, data, name, prefix))) from None


def explain(
    error: ValidationError, model: type[BaseModel], data: Mapping[str, Any], name: str, prefix: str = ""
) -> list[Text]:
    """Return one plain line for every fault of a validation, each once."""
    faults = error.errors(include_url=False)
    # Of a key that is none its value is not judged.
    keyed = {fault["loc"][:-1] for fault in faults if fault["loc"][-1:] == (_KEY,)}
    judged = [fault for fault in faults if fault["loc"][-1:] == (_KEY,) or not _within(fault["loc"], keyed)]
    messages = [at(name, _explain(fault, model, data, prefix)) for fault in judged]
    return list({str(line): line for line in messages}.values())


def _within(location: tuple[int | str, ...], places: Collection[tuple[int | str, ...]]) -> bool:
    return any(location[: len(place)] == place for place in places)


def near(word: str, known: Sequence[str]) -> list[str]:
    """Return the known word that is most similar to a word and may be meant; empty if none is."""
    return difflib.get_close_matches(word, known, n=1, cutoff=0.6)


def nearest(word: str, known: Sequence[str], far: Text | None = None) -> Text:
    """Return a hint at the known words: the nearest one; where none is near what is given for it, or all of them."""
    if meant := near(word, known):
        return text("did you mean {name}?", name=meant[0])
    return far or text("known are: {names}", names=sorted(known) or text("none"))


def _explain(fault: ErrorDetails, model: type[BaseModel], data: Mapping[str, Any], prefix: str) -> Text | str:
    if fault["loc"][-1:] == (_KEY,):
        table = _dotted(prefix, _real_location(fault["loc"][:-2], data))
        return text("{table} is given for each channel by its number: write {table}.1 = …, {table}.2 = …", table=table)
    location = _real_location(fault["loc"], data)
    key = _dotted(prefix, location)
    field = _field(model, location)
    kind = fault["type"]
    if kind == "extra_forbidden":
        owner = _model_at(model, location[:-1])
        known = [f.alias or n for n, f in owner.model_fields.items()] if owner else []
        return text("unknown key {key}; {hint}", key=key, hint=nearest(str(location[-1]), known))
    if kind == "missing":
        return text("{key} is missing; give {wanted}", key=key, wanted=wanted_by(field))
    if kind == "value_error":
        message = text_of(fault["ctx"]["error"])
        return at(key, message) if key else message
    given = fault["input"]
    unit = unit_of(field)
    if isinstance(given, str) and unit is not None:
        return text(
            "{key} = {given} is text, not a number; {number}, allowed is {wanted}",
            key=key,
            given=repr(given),
            number=_number_in(unit, given),
            wanted=wanted_by(field),
        )
    return text(
        "{key} = {given}; allowed is {wanted}{also}",
        key=key,
        given=_shown(given),
        wanted=wanted_by(field) if field else _wanted_in_table(model, location),
        also=_also(fault),
    )


def _wanted_in_table(model: type[BaseModel], location: Sequence[str | int]) -> Text | str:
    """Say what the values of a table with free keys are, of which one stands at a place."""
    table = _field(model, location[:-1])
    arguments = get_args(table.annotation) if table else ()
    return choices(arguments[1]) if len(arguments) == 2 else wanted_by(None)


def _number_in(unit: str, given: str) -> Text:
    """Ask for a number in a unit; where the text was one in that unit, show it."""
    if not unit:
        return text("give a number without a unit")
    bare = given.strip().removesuffix(unit).strip()
    return (
        text("give a number in {unit}, such as {example}", unit=unit, example=bare)
        if re.fullmatch(r"\d+(\.\d+)?", bare)
        else text("give a number in {unit}", unit=unit)
    )


def _also(fault: ErrorDetails) -> Text | str:
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
        "model_type",
    )
    return "" if fault["type"].startswith(known) else text(" ({said})", said=_said(fault))


def _said(fault: ErrorDetails) -> Text | str:
    """Return the library's own words, as a Text where they are among those known."""
    values = fault.get("ctx", {})
    for words in _LIBRARYS:
        message = Text(words.template, values)
        try:
            if message.render() == fault["msg"]:
                return message
        except KeyError:
            continue
    return fault["msg"]


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
