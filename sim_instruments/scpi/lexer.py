"""From the bytes of a program message to its units: header and data elements (IEEE 488.2, chapter 7)."""

import re
from dataclasses import dataclass
from typing import Literal

from sim_instruments.scpi.errors import ScpiError

Kind = Literal["number", "word", "string", "block", "expression"]

_HEADER = re.compile(r"\*[A-Za-z][A-Za-z0-9_]*|:?[A-Za-z][A-Za-z0-9_]*(?::[A-Za-z][A-Za-z0-9_]*)*")
_NUMBER = re.compile(r"([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:\s*[eE]\s*[+-]?\d+)?)\s*([A-Za-z%/][A-Za-z0-9%/.]*)?")
_RADIX = re.compile(r"#([HhQqBb])([0-9A-Fa-f]+)")
_WORD = re.compile(r"[A-Za-z][A-Za-z0-9_]*")
_BASES = {"H": 16, "Q": 8, "B": 2}
# White space of IEEE 488.2 is every control code but the newline, and the blank.
_SPACE = "".join(map(chr, range(33))).replace("\n", "")


@dataclass(frozen=True, slots=True)
class Argument:
    """One data element: its kind, its text without quotes, and for a number its value and suffix."""

    kind: Kind
    text: str
    value: float = 0.0
    suffix: str = ""


@dataclass(frozen=True, slots=True)
class Unit:
    """One program message unit. `rooted` headers begin at the root, `common` ones with an asterisk."""

    header: str
    query: bool
    arguments: tuple[Argument, ...]

    @property
    def common(self) -> bool:
        """True for a common command."""
        return self.header.startswith("*")

    @property
    def rooted(self) -> bool:
        """True if the header starts with a colon."""
        return self.header.startswith(":")

    @property
    def nodes(self) -> tuple[str, ...]:
        """Return the mnemonics in upper case, without colons."""
        return tuple(self.header.upper().lstrip(":").split(":"))


def split_messages(data: bytes) -> list[str]:
    """Split at newlines that stand neither in a string nor in a block; empty messages are left out."""
    text = data.decode("latin-1")
    if text.find("\n", 0, len(text) - 1) < 0:
        text = text[:-1] if text.endswith("\n") else text
        return [text] if text.strip(_SPACE) else []
    return [message for message in _split(text, "\n") if message.strip(_SPACE)]


def split_units(message: str) -> list[str]:
    """Split a message at the semicolons between its units; empty units are left out."""
    units = [message.strip(_SPACE)] if ";" not in message else [unit.strip(_SPACE) for unit in _split(message, ";")]
    return [unit for unit in units if unit]


def parse_unit(text: str) -> Unit:
    """Parse one unit. Raises ScpiError with the standard's number for whatever is wrong with it."""
    match = _HEADER.match(text)
    if match is None:
        raise ScpiError(-101 if not text[:1].isascii() or not text[:1].isprintable() else -102)
    end = match.end()
    query = text[end : end + 1] == "?"
    end += query
    rest = text[end:]
    if rest and rest[0] not in _SPACE:
        raise ScpiError(-103 if rest[0] in ",'\"(#" else -102)
    rest = rest.strip(_SPACE)
    if not rest:
        return Unit(match.group(), query, ())
    return Unit(match.group(), query, tuple(_parse_argument(part.strip(_SPACE)) for part in _split(rest, ",")))


def _split(text: str, separator: str) -> list[str]:
    parts: list[str] = []
    start = position = depth = 0
    length = len(text)
    while position < length:
        character = text[position]
        if character in "\"'":
            # A doubled quote inside a string reads as two strings next to each other, which splits alike.
            closing = text.find(character, position + 1)
            newline = text.find("\n", position + 1)
            if closing < 0 or (separator == "\n" and 0 <= newline < closing):
                closing = newline - 1 if separator == "\n" and newline >= 0 else length - 1
            position = closing
        elif character == "#":
            position += _block_length(text, position)
        elif character == "(":
            depth += 1
        elif character == ")":
            depth = max(0, depth - 1)
        elif character == separator and (depth == 0 or separator != ","):
            parts.append(text[start:position])
            start, depth = position + 1, 0
        position += 1
    parts.append(text[start:])
    return parts


def _block_length(text: str, position: int) -> int:
    """Return how many characters after the '#' belong to an arbitrary block that starts there."""
    digit = text[position + 1 : position + 2]
    if not ("1" <= digit <= "9"):
        return len(text) - position if digit == "0" else 0
    digits = text[position + 2 : position + 2 + int(digit)]
    if len(digits) != int(digit) or not (digits.isascii() and digits.isdigit()):
        return 0
    return 1 + int(digit) + int(digits)


def _parse_argument(text: str) -> Argument:
    if not text:
        raise ScpiError(-109)
    first = text[0]
    if first in "\"'":
        return _parse_string(text)
    if first == "(":
        if not text.endswith(")"):
            raise ScpiError(-171)
        return Argument("expression", text[1:-1])
    if first == "#":
        return _parse_hash(text)
    if match := _NUMBER.fullmatch(text):
        return _number(match.group(1), match.group(2) or "")
    if _WORD.fullmatch(text):
        return Argument("word", text.upper())
    if first in "+-.0123456789":
        raise ScpiError(-121)
    raise ScpiError(-101 if not (first.isascii() and first.isprintable()) else -102)


def _number(digits: str, suffix: str) -> Argument:
    value = float("".join(digits.split()))
    if abs(value) == float("inf"):
        raise ScpiError(-123)
    return Argument("number", digits, value, suffix.upper())


def _parse_string(text: str) -> Argument:
    quote = text[0]
    if len(text) < 2 or text[-1] != quote:
        raise ScpiError(-151)
    inner = text[1:-1]
    if quote in inner.replace(quote * 2, ""):
        raise ScpiError(-151)
    return Argument("string", inner.replace(quote * 2, quote))


def _parse_hash(text: str) -> Argument:
    if match := _RADIX.fullmatch(text):
        try:
            return Argument("number", text, float(int(match.group(2), _BASES[match.group(1).upper()])))
        except ValueError:
            raise ScpiError(-121) from None
        except OverflowError:
            raise ScpiError(-123) from None
    length = _block_length(text, 0)
    if not text.startswith("#0") and (not length or length != len(text) - 1):
        raise ScpiError(-161)
    return Argument("block", text[2:] if text.startswith("#0") else text[2 + int(text[1]) :])
