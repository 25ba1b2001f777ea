"""The spellings of a serial number: an accent of its own or not, full-width or not, the motor is the same."""

import re
from unicodedata import normalize

from bench.files.full_width import PLAIN

_FULL_WIDTH = {plain: wide for wide, plain in PLAIN.items()}
#: What an expression escapes, or a full-width character of it.
_ESCAPED_OR_FULL_WIDTH = re.compile(r"(\\[^\uff01-\uff5e])|\\?([\uff01-\uff5e])", re.DOTALL)
#: No serial number has more characters.
_LONGEST = 64


def is_written(serial_number: str) -> bool:
    """Return whether it can be a serial number of any plan: short, and every character of it can be seen."""
    return serial_number.isprintable() and len(serial_number) <= _LONGEST


def spelled(serial_number: str) -> str:
    """Return the spelling in which a serial number is kept: Unicode's form NFC, and no full-width letters, digits or signs."""
    return normalize("NFC", serial_number.translate(PLAIN))


def spelled_pattern(pattern: str) -> str:
    """Return the regular expression that matches, in the spelling that is kept, what `pattern` matches in others."""
    return normalize(
        "NFC", _ESCAPED_OR_FULL_WIDTH.sub(lambda found: found[1] or re.escape(found[2].translate(PLAIN)), pattern)
    )


def in_other_capitals(serial_number: str) -> tuple[str, ...]:
    """Return what a scanner or a keyboard with Caps Lock on sends in its place: other serial numbers, as they are kept."""
    kept = spelled(serial_number)
    others = (kept.upper(), kept.lower(), kept.swapcase())
    return tuple(other for other in dict.fromkeys(others) if other != kept)


def spellings(serial_number: str) -> tuple[str, ...]:
    """Return the spellings in which records may have a serial number: those of earlier versions have it as it was sent."""
    kept = spelled(serial_number)
    return tuple(dict.fromkeys((kept, normalize("NFD", kept), kept.translate(_FULL_WIDTH), serial_number)))
