"""Channels of telemetry in text and in the binary format of mjlib, with its schema.

Sources: mjlib `telemetry/README.md`, `telemetry/binary_write_archive.h` and `micro/telemetry_manager.cc`.
"""

import struct
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Literal

from sim_instruments.instruments.mjbots.multiplex import varuint

#: A field's type: whole numbers by sign and bits, `f32`, `bool`, `enum` (a number that a schema may name), `array` of bytes.
Kind = Literal["f32", "u8", "u16", "u32", "u64", "i8", "i16", "i32", "i64", "bool", "enum"]
_BOOLEAN, _SIGNED, _UNSIGNED, _VARUINT, _FLOAT32, _OBJECT, _ENUM, _FIXED_ARRAY = 2, 3, 4, 6, 7, 16, 17, 19
_FORMATS = {
    "f32": "<f", "u8": "<B", "u16": "<H", "u32": "<I", "u64": "<Q", "i8": "<b", "i16": "<h", "i32": "<i", "i64": "<q", "bool": "<?",
}  # fmt: skip
_FINAL = bytes(5)


@dataclass(frozen=True)
class TelemetryField:
    """One field: its type, its value or, where it is an array of that type, its values, and the names of an enumeration's numbers."""

    kind: Kind
    value: float | tuple[float, ...]
    names: Mapping[int, str] | None = None


#: A channel's content: fields, and structures of them, by name.
Structure = Mapping[str, "TelemetryField | Structure"]


def lines(name: str, structure: Structure) -> Iterator[str]:
    """Give a structure's fields as text, `channel.field value`."""
    for key, part in structure.items():
        if not isinstance(part, TelemetryField):
            yield from lines(f"{name}.{key}", part)
        elif isinstance(part.value, tuple):
            yield from (f"{name}.{key}.{number} {_text(part.kind, one)}" for number, one in enumerate(part.value))
        else:
            yield f"{name}.{key} {_text(part.kind, part.value)}"


def data(structure: Structure) -> bytes:
    """Return a structure's values in binary."""
    return b"".join(_packed(part) if isinstance(part, TelemetryField) else data(part) for part in structure.values())


def schema(structure: Structure) -> bytes:
    """Return what a structure's binary values are made of."""
    made = bytearray([_OBJECT, 0])
    for name, part in structure.items():
        encoded = name.encode()
        made += b"\0" + varuint(len(encoded)) + encoded + b"\0"
        made += _type(part) if isinstance(part, TelemetryField) else schema(part)
        # The default, which is what there is now.
        made += b"\1" + (_packed(part) if isinstance(part, TelemetryField) else data(part))
    return bytes(made) + _FINAL


def _text(kind: Kind, value: float) -> str:
    return f"{value:f}" if kind == "f32" else f"{int(value)}"


def _packed(field: TelemetryField) -> bytes:
    values = field.value if isinstance(field.value, tuple) else (field.value,)
    if field.kind == "enum":
        return b"".join(varuint(int(value)) for value in values)
    if field.kind == "f32":
        return b"".join(struct.pack("<f", value) for value in values)
    return b"".join(struct.pack(_FORMATS[field.kind], int(value)) for value in values)


def _type(field: TelemetryField) -> bytes:
    if isinstance(field.value, tuple):
        return bytes([_FIXED_ARRAY]) + varuint(len(field.value)) + _scalar(field)
    return _scalar(field)


def _scalar(field: TelemetryField) -> bytes:
    kind = field.kind
    if kind == "enum":
        names = field.names or {}
        result = bytes([_ENUM, _VARUINT]) + varuint(len(names))
        return result + b"".join(varuint(key) + varuint(len(name)) + name.encode() for key, name in names.items())
    if kind == "bool":
        return bytes([_BOOLEAN])
    if kind == "f32":
        return bytes([_FLOAT32])
    return bytes([_SIGNED if kind.startswith("i") else _UNSIGNED, int(kind[1:]) // 8])
