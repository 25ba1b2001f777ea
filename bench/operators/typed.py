"""Numbers as people type them: with a decimal comma, with the unit of what is asked for and its prefixes, in English or Chinese."""

import math
import re
import unicodedata
from collections.abc import Mapping
from decimal import Decimal

from drivers.interfaces.text import Text, text

#: What a person types who wants to correct an earlier reading.
BACK = "<"

_NUMBER = re.compile(r"[-+−]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][-+−]?\d+)?")
#: A whole number in front of a comma and three digits: a thousand and more to some, one and a little to others.
_AMBIGUOUS = re.compile(r"[-+−]?[1-9]\d{0,2},\d{3}")
#: Powers of ten.
_PREFIXES: Mapping[str, int] = {
    "": 0,
    "p": -12,
    "n": -9,
    "u": -6,
    "µ": -6,
    "μ": -6,
    "m": -3,
    "c": -2,
    "k": 3,
    "K": 3,
    "M": 6,
    "G": 9,
    "皮": -12,
    "纳": -9,
    "微": -6,
    "毫": -3,
    "厘": -2,
    "千": 3,
    "兆": 6,
    "吉": 9,
}
#: Units by their own sign: how people write them, without a prefix; those of `_PREFIXED` may have one.
_SPELLINGS: Mapping[str, tuple[str, ...]] = {
    # The Greek letter and the ohm sign, which editors make one.
    "Ω": ("\u03a9", "\u2126", "ohm", "Ohm", "OHM", "ohms", "Ohms", "欧", "欧姆"),
    "H": ("H", "henry", "Henry", "亨", "亨利"),
    "V": ("V", "v", "volt", "Volt", "伏", "伏特"),
    "A": ("A", "amp", "ampere", "Ampere", "安", "安培"),
    "Hz": ("Hz", "hz", "HZ", "赫", "赫兹"),
    "N·m": ("N·m", "Nm", "N*m", "N.m", "N m", "N⋅m", "牛·米", "牛米", "牛⋅米", "牛顿·米", "牛顿米"),
    "N·m/A": ("N·m/A", "Nm/A", "N*m/A", "N m/A", "牛·米/安", "牛米/安"),
    "N·m·s/rad": ("N·m·s/rad", "Nms/rad", "N·m·s", "Nms", "N*m*s/rad", "N m s/rad"),
    "V·s/rad": ("V·s/rad", "Vs/rad", "V*s/rad", "V s/rad", "V·s", "Vs", "Wb", "韦", "韦伯"),
    "V/krpm": ("V/krpm",),
    "V/rpm": ("V/rpm",),
    "Ω·s/rad": ("Ω·s/rad", "Ωs/rad", "ohm·s/rad"),
    "kg·m²": ("kg·m²", "kgm²", "kg·m^2", "kg*m^2", "kg m^2", "kg m²", "千克·平方米", "千克平方米"),
    "s": ("s", "sec", "秒"),
    "rpm": (
        "rpm",
        "RPM",
        "1/min",
        "min-1",
        "min^-1",
        "min⁻¹",
        "r/min",
        "U/min",
        "转/分",
        "转/分钟",
        "转每分",
        "转每分钟",
    ),
    "rad/s": ("rad/s", "1/s", "弧度/秒", "弧度每秒"),
    "°C": ("°C", "℃", "C", "degC", "deg C", "° C", "摄氏度"),
    "°": ("°", "deg", "度"),
    "%": ("%",),
}
_PREFIXED = (
    *("Ω", "H", "V", "A", "Hz", "N·m", "s"),
    *("N·m/A", "N·m·s/rad", "V·s/rad", "V/krpm", "V/rpm", "Ω·s/rad"),
)
#: Powers of ten to kg·m² of what data sheets tell inertias in.
_INERTIAS: Mapping[str, int] = {"kg·cm²": -4, "kg·mm²": -6, "g·m²": -3, "g·cm²": -7, "g·mm²": -9}
#: Every way of writing a unit, with its own sign and the power of ten to it.
_KNOWN: Mapping[str, tuple[str, int]] = {
    prefix + word: (unit, power)
    for unit, words in _SPELLINGS.items()
    for word in words
    for prefix, power in (_PREFIXES.items() if unit in _PREFIXED else (("", 0),))
    # What is a unit by itself is no prefix before another.
    if not prefix or not any(prefix + word in others for others in _SPELLINGS.values())
} | {
    written: ("kg·m²", power)
    for word, power in _INERTIAS.items()
    for written in (word, word.replace("·", ""), word.replace("·", "*").replace("²", "^2"), word.replace("·", " "))
}
#: Where a temperature is asked for, no angle can be meant.
_DEGREES = {"°C": "度"}


def narrow(typed: str) -> str:
    """Return what was typed with the usual digits, letters and signs in place of full-width ones and of units in one sign (`㏀`)."""
    # Normalising all would make 102 of 10².
    return "".join(
        unicodedata.normalize("NFKC", sign)
        if unicodedata.decomposition(sign).startswith(("<wide>", "<square>"))
        else sign
        for sign in typed
    )


def parted(typed: str) -> list[str]:
    """Return the numbers of a list as they were typed, parted by spaces, semicolons or `、`."""
    return [word for word in re.split(r"[\s;、]+", narrow(typed)) if word]


def typed_number(typed: str, unit: str) -> float:
    """Return what was typed in the `unit` asked for, empty for a plain number; without a unit it is taken to be in that one.

    Raises ValueError with a Text for what is no number, for a unit of something else, and for one that is not known.
    """
    words = narrow(typed).strip()
    match = _NUMBER.match(words)
    if match is None:
        raise ValueError(_no_number(typed, unit))
    rest = words[match.end() :].strip()
    asked = _KNOWN.get(unit)
    given = asked if rest and rest == _DEGREES.get(unit) else _KNOWN.get(rest)
    if given is None and (rest[:1].isdigit() or rest[:1] in (".", ",")):
        raise ValueError(
            text("'{typed}' has more than one decimal sign or a gap; type it like 1234.5 or 1234,5", typed=typed)
        )
    if _AMBIGUOUS.fullmatch(match.group()):
        whole, _, part = match.group().partition(",")
        raise ValueError(
            text(
                "'{typed}' could mean {one} or {other}; type one of these",
                typed=typed,
                one=whole + part,
                other=f"{whole}.{part}",
            )
        )
    number = Decimal(match.group().replace(",", ".").replace("−", "-"))
    if rest and not unit:
        raise ValueError(_no_number(typed, unit))
    if rest and (asked is None or given is None):
        raise ValueError(
            text(
                "'{typed}': the unit {given} is not known here; type it like {example}",
                typed=typed,
                given=rest,
                example=_example(unit),
            )
        )
    if asked is not None and given is not None:
        if given[0] != asked[0]:
            raise ValueError(
                text(
                    "'{typed}' is in {given}, and {unit} is asked for; type it like {example}",
                    typed=typed,
                    given=rest,
                    unit=unit,
                    example=_example(unit),
                )
            )
        # 5.2 mΩ is 5.2e-3, to the last digit.
        number = number.scaleb(given[1] - asked[1])
    value = float(number)
    if not math.isfinite(value):
        raise ValueError(_no_number(typed, unit))
    return value


def is_unit(word: str) -> bool:
    """Tell whether a word is a way of writing a unit."""
    return narrow(word) in _KNOWN


def unit_of(typed: str) -> str:
    """Return the unit that stands behind a number as it was typed, by its own sign; empty where none does that is known."""
    words = narrow(typed).strip()
    match = _NUMBER.match(words)
    return _KNOWN.get(words[match.end() :].strip(), ("", 0))[0] if match else ""


def _no_number(typed: str, unit: str) -> Text:
    return text("'{typed}' is not a number; type it like {example}", typed=typed, example=_example(unit))


def _example(unit: str) -> str:
    base = _KNOWN.get(unit, ("", 0))[0]
    if base in _PREFIXED and base != "s":
        return f"12.3 / 12,3 {unit} / 12.3 m{base}"
    return f"12.3 / 12,3 {unit}".strip()
