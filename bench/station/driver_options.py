"""A driver's options from a station file: checked as strictly as the rest of the file, bounds and units aside."""

import types
from collections.abc import Mapping
from dataclasses import MISSING, Field, fields, is_dataclass
from functools import cache
from typing import Annotated, Any, TypeVar, Union, cast, get_args, get_origin, get_type_hints

from pydantic import Field as ModelField
from pydantic import Strict, create_model

from bench.files.toml_file import Section, validate
from bench.i18n.errors import FileError, at
from drivers.catalogue import RATING_UNITS
from drivers.interfaces import Accuracy
from drivers.interfaces.text import text

T = TypeVar("T")
#: No instrument is that inaccurate; per cent were meant.
_GAIN = 0.2
_SHARE = text("a share: 0.005 is 0.5 %")
_OTHER_UNITS = {"maximum_resistance": "Ω", "maximum_inductance": "H", "rated_torque": "N·m"}


def read_options(options: type[T], data: Mapping[str, Any], name: str, prefix: str) -> T:
    """Return the options dataclass made of a table. Raises InputError with file, key and what is allowed."""
    section = validate(_model(cast("Any", options)), data, name, prefix)
    try:
        return cast("T", _make(options, section))
    except ValueError as error:
        # What concerns several values at once is the options' own to judge; the message begins with the key.
        raise FileError(at(name, f"{prefix}.{error}")) from None


def unit_of_option(name: str) -> str | None:
    """Return the unit of a number among the options, None where its name says none."""
    return {**RATING_UNITS, **_OTHER_UNITS}.get(name)


@cache
def _model(options: type[Any]) -> type[Section]:
    hints = get_type_hints(options)
    members: dict[str, Any] = {
        field.name: (_annotation(hints[field.name]), _field(field, hints[field.name], options))
        for field in fields(options)
        if field.init
    }
    return create_model(options.__name__, __base__=Section, **members)


def _field(field: "Field[Any]", hint: Any, options: type[Any]) -> Any:
    """Return a field with its default, of a largest value that it is above zero, of a limit of error that it is not below, and its unit."""
    number = float in (hint, *get_args(hint))
    unit = unit_of_option(field.name) if number else None
    about: dict[str, Any] = {"json_schema_extra": {"unit": unit}} if unit else {}
    if number and field.name.startswith("maximum_"):
        about["gt"] = 0.0
    if number and options is Accuracy:
        about["ge"] = 0.0
    if number and field.name == "gain":
        about |= {"lt": _GAIN, "description": _SHARE.template}
    # Defaults are checked by nobody: the dataclass fills them in itself.
    required = field.default is MISSING and field.default_factory is MISSING
    return ModelField(..., **about) if required else ModelField(None, validate_default=False, **about)


def _annotation(hint: Any) -> Any:
    if hint in (float, int, bool):
        return Annotated[hint, Strict()]
    if isinstance(hint, type) and is_dataclass(hint):
        return _model(hint)
    origin, arguments = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return Union[tuple(_annotation(argument) for argument in arguments)]  # noqa: UP007  the members are not known here
    if origin is Annotated:
        return hint
    if isinstance(origin, type) and issubclass(origin, Mapping):
        # TOML's keys are texts, so a key alone may be read as a number.
        table: Any = dict
        return table[arguments[0], _annotation(arguments[1])]
    if origin is not None and arguments:
        return origin[tuple(_annotation(a) if a is not Ellipsis else a for a in arguments)]
    return hint


def _make(options: Any, section: Section) -> Any:
    hints = get_type_hints(options)
    return options(**{name: _value(hints[name], getattr(section, name)) for name in section.model_fields_set})


def _value(hint: Any, value: Any) -> Any:
    if isinstance(value, Section):
        return _make(_dataclass_in(hint), value)
    if isinstance(value, dict):
        return {key: _value(hint, item) for key, item in value.items()}
    if isinstance(value, tuple | list):
        return type(value)(_value(hint, item) for item in value)
    return value


def _dataclass_in(hint: Any) -> Any:
    if isinstance(hint, type) and is_dataclass(hint):
        return hint
    for argument in get_args(hint):
        result = _dataclass_in(argument)
        if result is not None:
            return result
    return None
