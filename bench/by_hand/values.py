"""The values of a command's arguments as people type them, in SI units."""

import math
import re
from typing import Any

from bench.by_hand.commands import ArgumentKind, CommandArgument
from bench.operators.typed import narrow, typed_number, unit_of
from drivers.interfaces.text import Text, text

#: The unit in which people say what instruments take in another, and what one of it is.
_SPOKEN = {"rad/s": ("rpm", math.pi / 30.0), "rad": ("°", math.pi / 180.0)}
_NONE = ("none", "-", "无")


def value_of(argument: CommandArgument, typed: str) -> Any:
    """Return what was typed for an argument. Raises ValueError with a Text for what it does not take."""
    typed = narrow(typed)
    if argument.may_be_none and typed.lower() in _NONE:
        return None
    try:
        match argument.kind:
            case ArgumentKind.NUMBER:
                return number_in(argument.unit, typed)
            case ArgumentKind.WHOLE:
                return _whole(typed)
            case ArgumentKind.WHOLES:
                return [_whole(part) for part in re.split(r"[,，;+]", typed)]
            case ArgumentKind.CHOICE:
                return _choice(argument, typed)
    except ValueError as fault:
        raise ValueError(text("{argument}: {fault}", argument=argument.name, fault=fault)) from None


def number_in(unit: str, typed: str) -> float:
    """Return a number typed with a unit, in `unit`; `V|A` takes either. A speed is not taken without its unit."""
    spoken = _SPOKEN.get(unit)
    written = unit_of(typed)
    if spoken is not None:
        word, factor = spoken
        if written == word or (not written and not typed.strip().endswith(unit)):
            if not written:
                typed_number(typed, "")
                raise ValueError(
                    text(
                        "'{typed}' could be in {spoken} or in {unit}; type it with its unit, like {typed} {spoken}",
                        typed=typed,
                        spoken=word,
                        unit=unit,
                    )
                )
            return factor * typed_number(typed, word)
        return typed_number(typed, unit) if written == unit else typed_number(typed.strip().removesuffix(unit), "")
    # `V rms` is typed in volts.
    offered = [one.split()[0] for one in unit.split("|")] if unit else [""]
    return typed_number(typed, written if written in offered else offered[0])


def spoken(value: float, unit: str) -> tuple[float, str]:
    """Return a value in the unit in which people say it."""
    word, factor = _SPOKEN.get(unit, (unit, 1.0))
    return value / factor, word


def _whole(typed: str) -> int:
    number = typed_number(typed, "")
    if not number.is_integer():
        raise ValueError(text("'{typed}' is no whole number", typed=typed))
    return int(number)


def _choice(argument: CommandArgument, typed: str) -> Any:
    wanted = typed.lower().replace("-", "_")
    for one in argument.choices:
        if wanted in (one.name.lower(), str(one.value).lower().replace(" ", "_")):
            return one
    raise ValueError(
        text(
            "'{typed}' is not known; allowed are {choices}",
            typed=typed,
            choices=[one.name.lower() for one in argument.choices],
        )
    )


def words_of(argument: CommandArgument, ranges: dict[str, float], key: str) -> Text:
    """Return an argument as help shows it: its name, its unit or choices, its range where it is known."""
    if argument.kind is ArgumentKind.CHOICE:
        shown = Text(
            "{name}={choices}", {"name": argument.name, "choices": "|".join(c.name.lower() for c in argument.choices)}
        )
    elif f"{key}.{argument.name}" in ranges and argument.amount is not None:
        shown = text("{name} ({range})", name=argument.name, range=range_of(argument, ranges[f"{key}.{argument.name}"]))
    else:
        unit = spoken(0.0, argument.unit)[1].replace("|", " / ")
        shown = Text("{name} ({unit})" if unit else "{name}", {"name": argument.name, "unit": unit})
    return shown if argument.needed else Text("[{argument}]", {"argument": shown})


def range_of(argument: CommandArgument, largest: float) -> Text:
    """Return from where to where an argument may be set, in the unit in which people say it."""
    high, unit = spoken(largest, argument.unit)
    signed = argument.amount is not None and argument.amount.signed
    low = -high if signed else 0.0
    return Text("{low:.4g} … {high:.4g} {unit}", {"low": low, "high": high, "unit": unit})
