"""Times and factors with their units, as they are typed."""

import math
import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Annotated, Any

from cyclopts import Parameter, Token

from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

if TYPE_CHECKING:
    from bench.captures import ProbeFactor

#: How an ampere becomes volts: unit as typed, factor to SI, and whether it is volts an ampere.
_PROBES: Mapping[str, tuple[float, bool]] = {
    "a/v": (1.0, False),
    "a/mv": (1e3, False),
    "ma/v": (1e-3, False),
    "ma/mv": (1.0, False),
    "v/a": (1.0, True),
    "mv/a": (1e-3, True),
    "mv/ma": (1.0, True),
    "ohm": (1.0, True),
    "mohm": (1e-3, True),
    "uohm": (1e-6, True),
}


#: As a motor's file allows.
MOST_POLE_PAIRS = 200


def _whole(_: Any, tokens: Sequence[Token]) -> int:
    typed = tokens[0].value
    if not re.fullmatch("0*[0-9]{1,3}", typed, re.ASCII) or not 1 <= int(typed) <= MOST_POLE_PAIRS:
        raise UsageError(
            text(
                "--pole-pairs {typed}: allowed is a whole number from 1 to {most}; more no motor has",
                typed=typed,
                most=MOST_POLE_PAIRS,
            )
        )
    return int(typed)


#: A whole number: half a pole pair is none, and is not rounded to one.
Count = Annotated[int, Parameter(converter=_whole)]


def seconds_of(option: str, word: str | None) -> float:
    """Return a time (s) from a number with its unit: s, ms, us or µs; 0 where none was typed. Raises UsageError."""
    if word is None:
        return 0.0
    for unit, factor in (("ms", 1e-3), ("us", 1e-6), ("\u00b5s", 1e-6), ("\u03bcs", 1e-6), ("s", 1.0)):
        if word.endswith(unit):
            try:
                seconds = float(word.removesuffix(unit)) * factor
            except ValueError:
                break
            if 0.0 <= seconds < math.inf:
                return seconds
            break
    raise UsageError(text("{option} {word}: give a time, as in 20ms or 0.02s", option=option, word=word))


def factors_of(words: Sequence[str]) -> "dict[str, float | ProbeFactor]":
    """Return the factors of channels by name, from words as "CH3=10" or "CH2=100mV/A". Raises UsageError."""
    factors: dict[str, float | ProbeFactor] = {}
    for word in words:
        name, _, factor = word.rpartition("=")
        known = _factor(factor)
        if not name or known is None:
            raise UsageError(
                text(
                    "--scale {word}: give NAME=FACTOR, as in CHAN3=10, or the output of a current probe or shunt "
                    "per ampere, as in CHAN2=10A/V, CHAN2=100mV/A, CHAN2=5mOhm",
                    word=word,
                )
            )
        factors[name] = known
    return factors


def _factor(word: str) -> "float | ProbeFactor | None":
    """Return a factor, with the unit ampere where a probe or a shunt was typed; None for what is neither."""
    from bench.captures import ProbeFactor

    try:
        return float(word)
    except ValueError:
        match = re.fullmatch(r"([-+]?[0-9.]+(?:[eE][-+]?[0-9]+)?)\s*(\S+)", word.strip())
    unit = match[2].lower().replace("ω", "ohm").replace("µ", "u").replace("μ", "u") if match else ""
    if match is None or unit not in _PROBES:
        return None
    factor, volts_an_ampere = _PROBES[unit]
    try:
        size = float(match[1]) * factor
    except ValueError:
        return None
    if size == 0.0:
        return None
    return ProbeFactor(1.0 / size if volts_an_ampere else size, "A")
