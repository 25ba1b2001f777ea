"""Telemetry of a moteus as it is sent in binary, decoded by the schema that the drive itself gives."""

from collections.abc import Callable, Mapping
from typing import Any

from drivers.interfaces.text import text
from drivers.mjbots.multiplex import UnreadBytes

#: Numbers of types in a schema.
_FINAL, _NULL, _BOOLEAN, _FIXED_INT, _FIXED_UINT, _VARUINT = 0, 1, 2, 3, 4, 6
_FLOAT32, _FLOAT64, _OBJECT, _ENUM, _FIXED_ARRAY, _UNION = 7, 8, 16, 17, 19, 21
_SIGNED = {1: "<b", 2: "<h", 4: "<i", 8: "<q"}
_UNSIGNED = {1: "<B", 2: "<H", 4: "<I", 8: "<Q"}

#: Takes a value from bytes.
Decoder = Callable[[UnreadBytes], Any]


def decoder_of(schema: bytes) -> Callable[[bytes], Mapping[str, Any]]:
    """Return what decodes a channel's data to values by field, objects within it being mappings too.

    Raises ValueError for a schema with a type that moteus firmware does not use, or that is no object's; what decodes raises it for
    data that do not fit.
    """
    unread = UnreadBytes(schema)
    if unread.varuint() != _OBJECT:
        raise ValueError(text("a schema that is no object's"))
    decode = _object(unread)
    return lambda data: decode(UnreadBytes(data))


def _type(schema: UnreadBytes) -> Decoder | None:
    """Return the decoder of the next type of a schema, None for what ends a list of types."""
    kind = schema.varuint()
    if kind == _FINAL:
        return None
    if kind in (_FIXED_INT, _FIXED_UINT):
        size = schema.take(1)[0]
        forms = _SIGNED if kind == _FIXED_INT else _UNSIGNED
        if size not in forms:
            raise ValueError(text("a whole number of {size} bytes in a schema", size=size))
        return lambda data: data.number(forms[size])
    if kind == _OBJECT:
        return _object(schema)
    if kind == _ENUM:
        return _enum(schema)
    if kind == _FIXED_ARRAY:
        count, of = schema.varuint(), _needed(schema)
        return lambda data: [of(data) for _ in range(count)]
    if kind == _UNION:
        return _union(schema)
    plain: dict[int, Decoder] = {
        _NULL: lambda _: None,
        _BOOLEAN: lambda data: data.take(1) != b"\0",
        _VARUINT: lambda data: data.varuint(),
        _FLOAT32: lambda data: data.number("<f"),
        _FLOAT64: lambda data: data.number("<d"),
    }
    if kind not in plain:
        raise ValueError(text("type {kind} in a schema", kind=kind))
    return plain[kind]


def _needed(schema: UnreadBytes) -> Decoder:
    result = _type(schema)
    if result is None:
        raise ValueError(text("a schema that ends too early"))
    return result


def _object(schema: UnreadBytes) -> Decoder:
    schema.varuint()
    fields: list[tuple[str, Decoder]] = []
    while True:
        schema.varuint()
        name = schema.text()
        for _ in range(schema.varuint()):
            schema.text()
        decode = _type(schema)
        has_default = schema.take(1) != b"\0"
        if has_default and decode is not None:
            decode(schema)
        if decode is None:
            return lambda data: {name: one(data) for name, one in fields}
        fields.append((name, decode))


def _enum(schema: UnreadBytes) -> Decoder:
    decode = _needed(schema)
    for _ in range(schema.varuint()):
        decode(schema)
        schema.text()
    return decode


def _union(schema: UnreadBytes) -> Decoder:
    kinds: list[Decoder] = []
    while (kind := _type(schema)) is not None:
        kinds.append(kind)

    def chosen(data: UnreadBytes) -> Any:
        number = data.varuint()
        if number >= len(kinds):
            raise ValueError(text("kind {number} of {count}", number=number, count=len(kinds)))
        return kinds[number](data)

    return chosen
