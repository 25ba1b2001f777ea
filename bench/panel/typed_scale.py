"""In which unit a number is typed, how it is shown, and whether it is far from its like."""

import re
from collections.abc import Mapping, Sequence
from statistics import median

from bench.operators.typed import narrow, typed_number
from reports.tables.figures import scale_of

#: Units that a typed number may be in, by the one asked for: smallest first, each with its factor.
_UNITS: Mapping[str, Mapping[str, float]] = {
    "Ω": {"mΩ": 1e-3, "Ω": 1.0, "kΩ": 1e3, "MΩ": 1e6},
    "H": {"µH": 1e-6, "mH": 1e-3, "H": 1.0},
    "V": {"mV": 1e-3, "V": 1.0},
    "A": {"mA": 1e-3, "A": 1.0},
    "Hz": {"Hz": 1.0, "kHz": 1e3},
    "s": {"ms": 1e-3, "s": 1.0},
    "N·m": {"mN·m": 1e-3, "N·m": 1.0},
}
_LARGE = ((1e9, "G"), (1e6, "M"), (1e3, "k"))
#: A number that differs from its like by more than this factor is held back.
FAR = 5.0


def units_of(unit: str, minimum: float, maximum: float, like: float | None) -> Sequence[str]:
    """Return the units to choose from, at most two: the one asked for, and the one that the likely number is read in."""
    known = _UNITS.get(unit, {})
    read_in = scale_of(like, unit).unit if like else ""
    if read_in == unit or read_in not in known:
        read_in = next((name for name in known if known[name] < 1.0), "")
    wanted = [
        name for name in known if name in (read_in, unit) and known[name] * 1e3 > minimum and known[name] <= maximum
    ]
    return wanted if len(wanted) > 1 else [unit]


def chosen_unit(units: Sequence[str], unit: str, like: float | None) -> str:
    """Return the unit that is taken for a number without one: that of its like, else the one asked for."""
    read_in = scale_of(like, unit).unit if like else unit
    return read_in if read_in in units else unit


def completed(typed: str, chosen: str, unit: str) -> str:
    """Return what was typed with its unit: the chosen one where none stands there, the one asked for behind a lone prefix."""
    words = narrow(typed).strip()
    if re.fullmatch(r"[-+−\d.,]*\d[.,]?", words) and chosen:
        return f"{words} {chosen}"
    if unit in _UNITS and re.fullmatch(r"[-+−\d.,]*\d[.,]?\s*[pnuµμmkM皮纳微毫千兆]", words):
        return words + unit
    return words


def value_of(typed: str, unit: str) -> float | None:
    """Return the number in the `unit` asked for, None where it is none."""
    try:
        return typed_number(typed, unit)
    except ValueError:
        return None


def shown(value: float, unit: str) -> str:
    """Return a number with the prefix that makes it short."""
    if unit in _UNITS and abs(value) >= 1e3:
        factor, prefix = next(one for one in _LARGE if abs(value) >= one[0])
        return f"{value / factor:.6g} {prefix}{unit}"
    scale = scale_of(value, unit)
    return f"{value / scale.factor:.6g} {scale.unit}".strip()


def factor_of(name: str, unit: str) -> float:
    """Return how much of the unit asked for one of `name` is."""
    return _UNITS.get(unit, {}).get(name, 1.0)


def far_from(value: float, others: Sequence[float], unit: str) -> float | None:
    """Return what a number is far from: the middle of its like, where there are any and it is no temperature or angle."""
    if not others or (unit not in _UNITS and unit not in ("rpm", "rad/s")):
        return None
    like = median(others)
    if like == 0.0 or (value != 0.0 and 1.0 / FAR <= value / like <= FAR):
        return None
    return like
