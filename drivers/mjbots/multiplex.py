"""The multiplex protocol: registers read and written, and a stream of text, as subframes of one frame of CAN FD.

A frame's identifier is prefix, source and destination; the source's high bit asks for a reply, which goes to the source.
"""

import math
import struct
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from drivers.interfaces.text import text

#: Subframes: a write, a read, and the reply to it, each with the type in bits 2 and 3 and a count of 1 … 3 in bits 0 and 1.
_WRITE, _READ, _REPLY = 0x00, 0x10, 0x20
_WRITE_ERROR, _READ_ERROR = 0x30, 0x31
_TO_SERVER, _TO_CLIENT, _POLL = 0x40, 0x41, 0x42
NOP = 0x50
#: Asks every node at once.
BROADCAST = 0x7F
_REPLY_WANTED = 0x80
_FORMATS = ("<b", "<h", "<i", "<f")
INT8, INT32, FLOAT = 0, 2, 3
#: The channel of the diagnostic stream, and how many of its bytes a frame takes.
CHANNEL = 1
LONGEST = 48


def request_identifier(prefix: int, source: int, node: int) -> int:
    """Return the identifier of a frame that a node is to answer."""
    return prefix << 16 | (source | _REPLY_WANTED) << 8 | node


def reply_identifier(prefix: int, source: int, node: int) -> int:
    """Return the identifier of a node's answer."""
    return prefix << 16 | node << 8 | source


def write(register: int, values: Sequence[float], kind: int) -> bytes:
    """Return a subframe that writes values to consecutive registers, of a type of number (INT8, INT32, FLOAT)."""
    return _head(_WRITE, kind, register, len(values)) + b"".join(struct.pack(_FORMATS[kind], value) for value in values)


def read(register: int, count: int, kind: int) -> bytes:
    """Return a subframe that reads consecutive registers as a type of number (INT8, INT32, FLOAT)."""
    return _head(_READ, kind, register, count)


def stream_write(data: bytes) -> bytes:
    """Return a frame that sends bytes, at most LONGEST, on the diagnostic stream."""
    return bytes((_TO_SERVER, CHANNEL, len(data))) + data


def stream_poll() -> bytes:
    """Return a frame that asks for what is on the diagnostic stream."""
    return bytes((_POLL, CHANNEL, LONGEST))


def _head(base: int, kind: int, register: int, count: int) -> bytes:
    short = count if 1 <= count <= 3 else 0
    return bytes((base | kind << 2 | short,)) + (b"" if short else _varuint(count)) + _varuint(register)


def _varuint(value: int) -> bytes:
    found = bytearray()
    while value > 0x7F:
        found.append(value & 0x7F | 0x80)
        value >>= 7
    return bytes((*found, value))


@dataclass
class MultiplexReply:
    """Content of a frame: numbers by register, what was refused, and bytes of the diagnostic stream.

    A whole number that stands for "not a number", the most negative one, is NaN.
    """

    values: dict[int, float] = field(default_factory=dict)
    refused: list[str] = field(default_factory=list)
    stream: bytes | None = None


def parse(data: bytes) -> MultiplexReply:
    """Return what a node's frame says. Raises ValueError for one that is none of its."""
    result = MultiplexReply()
    rest = UnreadBytes(data)
    while not rest.at_end:
        kind = rest.varuint()
        if kind == NOP:
            continue
        if _REPLY <= kind < _REPLY + 0x10:
            result.values |= _numbers(rest, kind)
        elif kind in (_WRITE_ERROR, _READ_ERROR):
            register, error = rest.varuint(), rest.varuint()
            result.refused.append(f"0x{register:03X} ({error})")
        elif kind == _TO_CLIENT:
            channel, count = rest.varuint(), rest.varuint()
            content = rest.take(count)
            if channel == CHANNEL:
                result.stream = (result.stream or b"") + content
        else:
            raise ValueError(text("subframe 0x{kind:02X} is none of a reply", kind=kind))
    return result


def _numbers(rest: "UnreadBytes", kind: int) -> Mapping[int, float]:
    form = _FORMATS[kind >> 2 & 3]
    count = kind & 3 or rest.varuint()
    register = rest.varuint()
    size = struct.calcsize(form)
    return {register + place: _number(form, rest.take(size)) for place in range(count)}


def _number(form: str, raw: bytes) -> float:
    value: float = struct.unpack(form, raw)[0]
    return math.nan if form != "<f" and value == -(1 << 8 * len(raw) - 1) else value


class UnreadBytes:
    """Bytes that are taken one part after the other."""

    def __init__(self, data: bytes) -> None:
        self._data = data
        self._place = 0

    @property
    def at_end(self) -> bool:
        """Return whether all are taken."""
        return self._place >= len(self._data)

    def take(self, count: int) -> bytes:
        """Return the next bytes. Raises ValueError where there are not as many."""
        result = self._data[self._place : self._place + count]
        if len(result) != count:
            raise ValueError(text("{count} bytes where {wanted} were announced", count=len(result), wanted=count))
        self._place += count
        return result

    def varuint(self) -> int:
        """Return a number in groups of seven bits, the least first. Raises ValueError where it does not end."""
        value = 0
        for place in range(0, 35, 7):
            (byte,) = self.take(1)
            value |= (byte & 0x7F) << place
            if byte < 0x80:
                return value
        raise ValueError(text("a number of more than five bytes"))

    def text(self) -> str:
        """Return a text with its length before it."""
        return self.take(self.varuint()).decode("utf-8", "replace")

    def number(self, form: str) -> float:
        """Return a number of a format of `struct`."""
        result: float = struct.unpack(form, self.take(struct.calcsize(form)))[0]
        return result


def parts(data: bytes) -> Iterator[bytes]:
    """Yield bytes in portions that a frame of the diagnostic stream takes."""
    yield from (data[place : place + LONGEST] for place in range(0, len(data), LONGEST))
