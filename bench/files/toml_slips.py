"""Slips in numbers that TOML has no word for: a decimal comma, a unit, signs of another keyboard."""

import re

from drivers.interfaces.text import Text, text

#: Text in quotes, and a comment behind it.
_QUOTED = re.compile(r"\"[^\"]*\"|'[^']*'")
_DECIMAL_COMMA = re.compile(r"=\s*([+-]?\d+),(\d+)\s*$")
_WITH_UNIT = re.compile(r"=\s*([+-]?\d+(?:\.\d+)?)\s*([^\W\d_][^\s,\]}]*)\s*$")


def slip_in(line: str) -> Text | None:
    """Return what is to be typed instead in a line that is not valid TOML; None where it is no such slip."""
    bare = _QUOTED.sub('""', line).partition("#")[0]
    foreign = next((sign for sign in bare if not sign.isascii()), "")
    if foreign:
        return text(
            "the sign '{sign}' (U+{code}) cannot stand outside quotes; type numbers with the digits 0 to 9, a point and a plain minus",
            sign=foreign,
            code=f"{ord(foreign):04X}",
        )
    comma = _DECIMAL_COMMA.search(bare)
    if comma:
        return text("decimals are written with a point, as {meant}", meant=f"{comma[1]}.{comma[2]}")
    unit = _WITH_UNIT.search(bare)
    if unit:
        return text(
            "a number has no unit behind it: write {meant}, in the unit that the key is in",
            meant=unit[1],
        )
    return None
