"""Units as they stand in the headings of tables, and their factor to SI."""

import math
import re

_PREFIX = {"n": 1e-9, "u": 1e-6, "µ": 1e-6, "μ": 1e-6, "m": 1e-3, "k": 1e3}
_PREFIXED = {"s": "s", "sec": "s", "v": "V", "a": "A", "h": "H", "nm": "N·m", "ohm": "Ω", "ohms": "Ω", "ω": "Ω"}
_GRAVITY, _INCH = 9.80665, 0.0254
_WHOLE = {
    "second": ("s", 1.0),
    "seconds": ("s", 1.0),
    "min": ("s", 60.0),
    "volt": ("V", 1.0),
    "volts": ("V", 1.0),
    "ampere": ("A", 1.0),
    "amp": ("A", 1.0),
    "rad/s": ("rad/s", 1.0),
    "rad/sec": ("rad/s", 1.0),
    "rads-1": ("rad/s", 1.0),
    "rads^-1": ("rad/s", 1.0),
    **dict.fromkeys(("rad.s-1", "rad.s^-1"), ("rad/s", 1.0)),
    # What names of variables are spelt like.
    **dict.fromkeys(("rad_s", "rad_per_s", "radps"), ("rad/s", 1.0)),
    "deg/s": ("rad/s", math.pi / 180),
    "°/s": ("rad/s", math.pi / 180),
    **dict.fromkeys(("rps", "rev/s", "r/s", "turn/s", "turns/s"), ("rad/s", 2 * math.pi)),
    "hz": ("Hz", 1.0),
    "khz": ("Hz", 1e3),
    "rpm": ("rad/s", 2 * math.pi / 60),
    "1/min": ("rad/s", 2 * math.pi / 60),
    "u/min": ("rad/s", 2 * math.pi / 60),
    "r/min": ("rad/s", 2 * math.pi / 60),
    "rev/min": ("rad/s", 2 * math.pi / 60),
    "min-1": ("rad/s", 2 * math.pi / 60),
    "min^-1": ("rad/s", 2 * math.pi / 60),
    "ncm": ("N·m", 0.01),
    "cnm": ("N·m", 0.01),
    "nmm": ("N·m", 1e-3),
    # International ounce and pound, standard gravity (ISO 80000-4, NIST SP 811).
    **dict.fromkeys(("ozin", "ozfin", "inoz", "inozf"), ("N·m", 0.028349523125 * _GRAVITY * _INCH)),
    **dict.fromkeys(("lbin", "lbfin", "inlb", "inlbf"), ("N·m", 0.45359237 * _GRAVITY * _INCH)),
    **dict.fromkeys(("lbft", "lbfft", "ftlb", "ftlbf"), ("N·m", 0.45359237 * _GRAVITY * 12 * _INCH)),
    **dict.fromkeys(("gcm", "gfcm"), ("N·m", 1e-5 * _GRAVITY)),
    **dict.fromkeys(("kgcm", "kgfcm"), ("N·m", 1e-2 * _GRAVITY)),
    "krpm": ("rad/s", 1000 * 2 * math.pi / 60),
    "rad": ("rad", 1.0),
    "deg": ("rad", math.pi / 180),
    "°": ("rad", math.pi / 180),
    "degrees": ("rad", math.pi / 180),
    **dict.fromkeys(("rev", "turn", "turns"), ("rad", 2 * math.pi)),
}
#: Signs that one unit is written with or without: dots of products, raised digits, two hyphens.
_SPELT = str.maketrans({"·": "", "⋅": "", "*": "", "¹": "1", "⁻": "-", "−": "-"})


def si(unit: str) -> tuple[str, float] | None:
    """Return SI unit and factor of a unit as written ("ms", "rpm", "mN·m"); None where it is not known."""
    plain = (
        unit.translate(_SPELT).strip().replace(" ", "").replace("N.m", "Nm").replace("N-m", "Nm").replace("N_m", "Nm")
    )
    if plain.lower() in _WHOLE:
        return _WHOLE[plain.lower()]
    # Products of other units than SI's are written with a dot or a hyphen as well: "oz.in", "ft-lb".
    if (product := re.sub(r"[.-]", "", plain.lower())) in _WHOLE and _WHOLE[product][0] == "N·m":
        return _WHOLE[product]
    if plain.lower() in _PREFIXED:
        return _PREFIXED[plain.lower()], 1.0
    if plain[:1] in _PREFIX and plain[1:].lower() in _PREFIXED:
        return _PREFIXED[plain[1:].lower()], _PREFIX[plain[0]]
    return None


#: What stands in brackets and may be a unit that is not known; "(CH1)" and "(10:1)" are none.
_LIKE_A_UNIT = re.compile(r"[^\W\d_]{1,8}(/[^\W\d_]{1,4}|-1|⁻¹|\^-1)?|1/[^\W\d_]{1,4}")


def split_heading(heading: str) -> tuple[str, str]:
    """Return name and unit of a column's heading: "t [ms]", "speed (rpm)", "U/V", "C1 in V", "time_s"; unit may be empty.

    A unit in brackets that is not known is returned as well: whoever needs the column knows that it is none of its own.
    """
    text = heading.strip().strip('"').strip()
    for pattern in (
        r"(.*?)_(rad[/_]s|rad_per_s|m?N_m)",
        r"(.*?)\s*\[([^\]]*)\]",
        r"(.*?)\s*\(([^)]*)\)",
        r"(.*?)\s*\bin\s+(\S+)",
        r"(.*?)\s*/\s*(\S+)",
        r"(.*)_(\w+)",
    ):
        match = re.fullmatch(pattern, text)
        if match and si(match[2]):
            return match[1].strip() or match[2].strip(), match[2].strip()
        if match and pattern.endswith((r"\]", r"\)")) and _LIKE_A_UNIT.fullmatch(match[2].strip()):
            return match[1].strip(), match[2].strip()
    return (text, text) if si(text) and len(text) > 2 else (text, "")
