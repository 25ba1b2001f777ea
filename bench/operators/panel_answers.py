"""The answers allowed for each kind of question, and the form of readings for a page."""

import math
from collections.abc import Sequence
from typing import Any

from bench.journal.stored_result import store_text
from bench.operators.entry import TypedReading, checked_number, within
from drivers.interfaces.text import text
from drivers.manual.prompt import Option

#: Characters of a command.
_LONGEST = 1000


def words(value: object) -> str:
    """Return a command as it was typed. Raises ValueError with a Text for what is none, as all here do."""
    if not isinstance(value, str) or not value.strip() or len(value) > _LONGEST:
        raise ValueError(text("a command is a line of words"))
    return value.strip()


def nothing(value: object) -> None:
    """Take it that something is done."""
    if value is not None:
        raise ValueError(text("this only needs to be confirmed"))


def yes_or_no(value: object) -> bool:
    """Return yes or no."""
    if value is True or value is False:
        return value
    raise ValueError(text("answer yes or no"))


def number(
    value: object,
    unit: str = "°",
    among: tuple[float, float] = (-math.inf, math.inf),
    options: Sequence[Option] = (),
) -> float:
    """Return a number in `unit` within a range, as it was typed or as it is, or the number of one of the `options`."""
    if isinstance(value, str) or options:
        return checked_number(str(value), unit, *among, options)
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError(text("{value} is not a number", value=repr(value)))
    return within(float(value), unit, *among)


def angles(value: object) -> list[float]:
    """Return a list of angles (degrees)."""
    if not isinstance(value, list) or not value:
        raise ValueError(text("angles are a list of numbers, in degrees"))
    return [number(item) for item in value]


def told(reading: TypedReading) -> dict[str, Any]:
    """Return a reading as a page is told of it."""
    told = {name: getattr(reading, name) for name in ("number", "unit", "minimum", "maximum", "value")}
    return {**told, "asked": store_text(reading.name), "options": told_options(reading.options)}


def told_options(options: Sequence[Option]) -> list[dict[str, Any]]:
    """Return fixed answers as a page is told of them."""
    return [{"number": one.number, "name": store_text(one.name), "sign": one.sign} for one in options]
