"""Parsers of what SCPI instruments answer. They raise ValueError with the finding; the session adds the rest."""

import math
from dataclasses import dataclass

from drivers.interfaces.text import text

#: SCPI 1999, 7.2.1.4: what stands for infinity; "not a number" (7.2.1.5) is larger still.
SCPI_INFINITY = 9.9e37


@dataclass(frozen=True)
class QueueEntry:
    """One entry of the error queue: its number (0 for none) and text."""

    number: int
    text: str


def parse_number(reply: str) -> float:
    """Return the number a reply consists of.

    Raises ValueError where it is none, or one that SCPI does not know ("nan", "inf").
    """
    value = float(reply)
    # Python takes 1_5 and digits of other scripts, too.
    if not math.isfinite(value) or "_" in reply or not reply.isascii():
        raise ValueError(text("'{reply}' is not a number", reply=reply))
    return value


def parse_numbers(reply: str, least: int, most: int | None = None) -> list[float]:
    """Return the numbers of a comma-separated reply.

    Raises ValueError where there are fewer than `least` or more than `most` (`least` when not given).
    """
    fields = reply.split(",")
    highest = least if most is None else most
    if not least <= len(fields) <= highest:
        wanted = str(least) if highest == least else f"{least} … {highest}"
        raise ValueError(
            text("{count} fields instead of {wanted}: '{reply}'", count=len(fields), wanted=wanted, reply=reply)
        )
    return [parse_number(field) for field in fields]


def parse_error(reply: str) -> QueueEntry:
    """Return the entry in a reply of SYST:ERR?, `<number>,"<text>"`; raises ValueError on another form."""
    number, _, rest = reply.partition(",")
    return QueueEntry(int(number), rest.strip().strip('"'))


def is_overrange(value: float) -> bool:
    """Say whether a number stands for "no value" (9.9E37 and beyond)."""
    return abs(value) >= SCPI_INFINITY
