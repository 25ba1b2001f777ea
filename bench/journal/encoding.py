"""Converts any value from a procedure or an instrument to JSON without failing."""

import json
import math
from collections.abc import Callable, Iterable, Mapping
from dataclasses import fields, is_dataclass
from enum import Enum
from json.encoder import encode_basestring
from operator import attrgetter
from typing import Any

from bench.journal.stored_result import Sentence, store, store_notice, store_sentence
from drivers.interfaces.text import Text
from procedures.core.events import UnknownAction
from procedures.core.result import Notice, ProcedureResult

#: What a journal holds in a form that it can be restored from.
_STORED: Mapping[type, Callable[[Any], Any]] = {
    ProcedureResult: store,
    Notice: store_notice,
    Sentence: store_sentence,
    UnknownAction: attrgetter("details"),
}
#: Depth beyond which a value is told instead of taken apart (a structure that contains itself). A sentence within a sentence takes three.
_DEPTH = 18
_WORDS: Mapping[bool | None, str] = {None: "null", True: "true", False: "false"}


def dumps(value: Mapping[str, Any]) -> str:
    """Return one line of JSON; numbers that JSON has no form for stand as the texts "NaN", "Infinity", "-Infinity"."""
    try:
        return json.dumps(value, ensure_ascii=False, allow_nan=False, separators=(",", ":"), default=_known)
    except (TypeError, ValueError, RecursionError):
        return json.dumps(plain(value), ensure_ascii=False, allow_nan=False, separators=(",", ":"))


def _known(value: object) -> Any:
    """Return a value that JSON has no form for in forms that it may have; what it has one for is written as it is."""
    stored = _STORED.get(type(value))
    return plain(value) if stored is None else stored(value)


def plain(value: object, depth: int = 0) -> Any:
    """Return the value in JSON's own types; dataclasses become objects, sentences their English words."""
    if value is None or isinstance(value, bool | str):
        return str(value) if isinstance(value, Enum) else value
    if isinstance(value, Enum):
        return plain(value.value, depth + 1)
    if isinstance(value, int):
        return int(value)
    if isinstance(value, float):
        return _number(float(value))
    if isinstance(value, complex):
        return {"real": _number(value.real), "imag": _number(value.imag)}
    if isinstance(value, Text):
        return _told(value)
    stored = _STORED.get(type(value))
    if stored is not None:
        return plain(stored(value), depth)
    if depth >= _DEPTH:
        return _told(value)
    if isinstance(value, Mapping):
        return {_key(key): plain(item, depth + 1) for key, item in value.items()}
    if is_dataclass(value) and not isinstance(value, type):
        told = {each: getattr(value, each.name) for each in fields(value)}
        return {
            each.name: plain(given, depth + 1)
            for each, given in told.items()
            if not (each.metadata.get("optional") and given == each.default)
        }
    if isinstance(value, bytes | bytearray):
        return value.hex(" ")
    if hasattr(value, "tolist"):
        return plain(value.tolist(), depth + 1)
    if isinstance(value, Iterable):
        return [plain(item, depth + 1) for item in value]
    return _told(value)


def indented(value: object, depth: int = 0) -> str:
    """Return the value in JSON's own types over several lines, two spaces a level.

    The text is that of `json.dumps(plain(value), ensure_ascii=False, indent=2)`, which builds the plain value first, and with an
    indent has no encoder in C.
    """
    if type(value) is str:
        return encode_basestring(value)
    if type(value) is float:
        told = _number(value)
        return f'"{told}"' if isinstance(told, str) else repr(told)
    if type(value) is int:
        return repr(value)
    if value is None or type(value) is bool:
        return _WORDS[value]
    begin, end = "\n" + "  " * (depth + 1), "\n" + "  " * depth
    if type(value) is list and value and depth < _DEPTH:
        items = [indented(item, depth + 1) for item in value]
        return f"[{begin}{f',{begin}'.join(items)}{end}]"
    if type(value) is dict and value and depth < _DEPTH and all(type(key) is str for key in value):
        items = [f"{encode_basestring(key)}: {indented(item, depth + 1)}" for key, item in value.items()]
        return f"{{{begin}{f',{begin}'.join(items)}{end}}}"
    made = plain(value, depth)
    if isinstance(made, str):
        return encode_basestring(made)
    return indented(made, depth) if made not in ({}, []) else repr(made)


def to_bytes(line: str) -> bytes:
    """Return a line of JSON as UTF-8; halves of surrogate pairs stand as JSON's own escapes."""
    return line.encode("utf-8", "backslashreplace")


def _number(value: float) -> float | str:
    if math.isfinite(value):
        return value
    return "NaN" if math.isnan(value) else ("Infinity" if value > 0 else "-Infinity")


def _key(key: object) -> str:
    return key if isinstance(key, str) else str(key.value if isinstance(key, Enum) else key)


def _told(value: object) -> str:
    try:
        return str(value)
    except Exception as error:  # noqa: BLE001  a value that cannot be told must not cost the journal's line
        return f"<{type(value).__name__}: {type(error).__name__}>"
