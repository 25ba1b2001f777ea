"""Frames of a moteus as its reference has them: registers, the diagnostic stream, and schemas of its telemetry."""

import struct
from collections.abc import Sequence

#: Modes and codes: regulating currents, and nothing that limits it.
CURRENT = 9


def small(register: int, value: int) -> bytes:
    """Return a register as a number of one byte."""
    return bytes((0x21, register)) + struct.pack("<b", value)


def floats(register: int, *values: float) -> bytes:
    """Return consecutive registers as floating-point numbers, at most three."""
    return bytes((0x2C | len(values), register)) + struct.pack(f"<{len(values)}f", *values)


def state(mode: int, code: int = 0) -> bytes:
    """Return mode and fault code."""
    return small(0x00, mode) + small(0x0F, code)


def registers(
    mode: int = CURRENT,
    code: int = 0,
    *,
    speed: float = 0.0,
    q: float = 0.0,
    d: float = 0.0,
    bus: float = 24.0,
    board: float = 30.0,
) -> bytes:
    """Return the answer to the question for everything that is measured: speed in turns/s, currents in A, voltage in V, °C."""
    return b"".join(
        (
            small(0x00, mode),
            floats(0x02, speed),
            floats(0x04, q, d),
            floats(0x0A, float("nan")),
            floats(0x0D, bus, board),
            small(0x0F, code),
        )
    )


def stream(data: bytes) -> bytes:
    """Return bytes of the diagnostic stream."""
    return bytes((0x41, 0x01)) + _varuint(len(data)) + data


def blob(announced: str, data: bytes) -> bytes:
    """Return what the stream announces, with its length before it."""
    return stream(announced.encode() + b"\r\n" + len(data).to_bytes(4, "little") + data)


def schema(*fields: tuple[str, bytes], default: Sequence[bytes] = ()) -> bytes:
    """Return the schema of an object with these fields, of a type each; the first of them with a `default`, and a name that it had."""
    said = bytearray((16, 0))
    for number, (name, kind) in enumerate(fields):
        value = default[number] if number < len(default) else b""
        others = _text("old") if value else b""
        said += b"\0" + _text(name) + bytes((1 if others else 0,)) + others + kind + (b"\1" + value if value else b"\0")
    return bytes(said + b"\0\0\0\0\0")


def whole(size: int, *, signed: bool = True) -> bytes:
    """Return the type of a whole number of so many bytes."""
    return bytes((3 if signed else 4, size))


def enumeration(*names: str) -> bytes:
    """Return the type of an enumeration by a byte."""
    values = b"".join(bytes((number,)) + _text(name) for number, name in enumerate(names))
    return b"\x11" + whole(1, signed=False) + bytes((len(names),)) + values


def array(count: int, kind: bytes) -> bytes:
    """Return the type of so many of one."""
    return b"\x13" + bytes((count,)) + kind


def union(*kinds: bytes) -> bytes:
    """Return the type of one of several."""
    return b"\x15" + b"".join(kinds) + b"\0"


NULL, BOOLEAN, VARUINT, FLOAT, DOUBLE = b"\1", b"\2", b"\6", b"\7", b"\x08"


def _text(value: str) -> bytes:
    return bytes((len(value),)) + value.encode()


def _varuint(value: int) -> bytes:
    return bytes((value,)) if value < 0x80 else bytes((value & 0x7F | 0x80, value >> 7))
