"""Values of a motor's data sheet as its rows state them, in SI, with what a row says of its convention."""

import math
import re
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

from bench.analysis.sheet_rows import rows_of
from bench.captures.decimal_marks import doubtful_number
from bench.captures.signs import plain_signs, without_blanks
from bench.captures.units import si
from bench.i18n.errors import InputError, at
from drivers.interfaces.text import Text, text

#: What a name is, in the words of data sheets, and the unit (SI) that the quantity has. The first that fits counts.
_NAMES = {
    "speed_constant": (r"speed const|drehzahlkonst|\bk_?[vn]\b|转速常数", "rad/s/V"),
    "torque_constant": (r"torque const|drehmomentkonst|\bk_?[tm]\b|转矩常数|力矩常数|扭矩常数", "N·m/A"),
    "emf_constant": (r"emf|voltage const|generator const|\bk_?e\b|spannungskonst|反电动势", "V/rad/s"),
    "mechanical_time": (r"mech\w* time const|mech\w* zeitkonst|机械时间常数", "s"),
    "resistance": (r"resist|widerstand|电阻", "Ω"),
    "inductance": (r"induct|indukt|电感", "H"),
    "pole_pairs": (r"pole pairs|polpaar|极对数", "1"),
    "poles": (r"\bpoles\b|polzahl|magnetpole|极数", "1"),
    "inertia": (r"inertia|trägheit|惯量", "kg·m²"),
    "stall_torque": (r"stall torque|anhaltemoment|堵转(转矩|扭矩)", "N·m"),
    "stall_current": (r"(stall|starting) current|anlaufstrom|堵转电流", "A"),
    "no_load_speed": (r"no.?load speed|leerlaufdrehzahl|空载转速", "rad/s"),
    "no_load_current": (r"no.?load current|leerlaufstrom|空载电流", "A"),
    "voltage": (r"(nominal|rated|supply) voltage|nennspannung|额定电压", "V"),
}
#: Names with the same words that are other quantities: of heat, of insulation, and a torque that is borne for ever.
_OTHER = re.compile(r"therm|heat|insulat|wärme|isolation|热|绝缘|cont\w*\.? stall", re.IGNORECASE)
_INERTIA = {"kgm2": 1.0, "kgcm2": 1e-4, "kgmm2": 1e-6, "gcm2": 1e-7}
_LINE = re.compile(
    r"(phase|line|terminal)s?[- ]*(to|-)[- ]*(phase|line|terminal)|terminal|\bl-l\b|\bll\b|anschluss|klemme|phase-phase|线间|端",
    re.IGNORECASE,
)
_PHASE = re.compile(r"per phase|to[- ]neutral|to[- ]star|\bl-n\b|strang|每相", re.IGNORECASE)
_RMS, _PEAK = (
    re.compile(r"rms|(?<![a-z])eff", re.IGNORECASE),
    re.compile(r"(?<=[\sav_(])(pk|peak)|amplitude|峰值", re.IGNORECASE),
)
_NUMBER = re.compile(r"([+-]?\d*[.,]?\d+(?:[eE][+-]?\d+)?)\s*(.*)")


class Stated(NamedTuple):
    """A row: value (SI), and whether its name or unit says rms or peak, line or phase; None where it does not."""

    value: float
    rms: bool | None
    line: bool | None


def stated_values(path: Path, content: str) -> tuple[dict[str, Stated], list[Text]]:
    """Return what the rows of a table say by quantity, and why others could not be read.

    Raises InputError for a number that may be thousands or decimals.
    """
    rows, mark = rows_of(plain_signs(content), lambda row: _kind(row) is not None and _number(row) is not None)
    found: dict[str, Stated] = {}
    ambiguous: set[str] = set()
    unread: list[Text] = []
    named = [row for row in rows if _kind(row[:1])]
    doubtful = doubtful_number((cell for row in named for cell in row[1:2]), comma_between=mark == ",")
    if doubtful is not None and len(named) > 1:
        raise InputError(at(str(path), doubtful[1]))
    for cells in rows:
        row = [cell.strip() for cell in cells if cell.strip()]
        kind = _kind(row)
        number = _number(row)
        if kind is None or number is None or not math.isfinite(float(number[1].replace(",", "."))):
            # Without a digit it is the title of a part of the sheet.
            if kind is not None and (len(row) > 1 or re.search(r"\d", row[0])):
                unread.append(text("'{row}': its second cell is no number", row=mark.join(cells)))
            continue
        if kind in found or kind in ambiguous or len(row) > 3 or (number[2] and len(row) > 2):
            why = text(
                "'{row}': more than one value of this quantity; keep the one that is meant", row=mark.join(cells)
            )
            unread.append(why)
            found.pop(kind, None)
            ambiguous.add(kind)
            continue
        value = float(number[1].replace(",", "."))
        if value <= 0.0:
            unread.append(text("'{row}': a value above zero is needed", row=mark.join(cells)))
            continue
        unit = number[2] or (row[2] if len(row) > 2 else "")
        factor = _factor(unit, _NAMES[kind][1])
        if factor is None:
            unread.append(text("'{row}': a unit of {wanted} is needed", row=mark.join(cells), wanted=_NAMES[kind][1]))
            continue
        said = f"{row[0]} {unit}"
        rms = True if _RMS.search(said) else False if _PEAK.search(said) else None
        line = False if _PHASE.search(said) else True if _LINE.search(said) else None
        found[kind] = Stated(value * factor, rms, line)
    return found, unread


def _number(row: Sequence[str]) -> re.Match[str] | None:
    """Return the number in a row's second cell, and what stands behind it; None where there is none."""
    return _NUMBER.fullmatch(without_blanks(row[1])) if len(row) > 1 else None


def _kind(row: Sequence[str]) -> str | None:
    """Return which quantity a row names in its first cell; None for any other."""
    if not row or _OTHER.search(row[0]):
        return None
    return next((k for k, (words, _) in _NAMES.items() if re.search(words, row[0], re.IGNORECASE)), None)


def _factor(unit: str, wanted: str) -> float | None:
    """Return what a value in `unit` is multiplied by to be in `wanted`; None where it is no such unit."""
    plain = re.sub(r"[\s_]*[(]?(rms|eff|pk|peak|dc)[)]?", "", unit, flags=re.IGNORECASE).replace(" ", "")
    if wanted == "1":
        return 1.0
    if wanted == "kg·m²":
        return _INERTIA.get(re.sub(r"[·⋅*.^]", "", plain.lower()).replace("²", "2"))
    if "/" not in wanted or wanted == "rad/s":
        known = si(plain)
        return known[1] if known is not None and known[0] == wanted else None
    plain = re.sub(r"1000(rpm|min-1|min⁻¹|1/min)", "krpm", plain)
    plain = re.sub(r"^(m?)V[·⋅*]?s/rad$", r"\1V/(rad/s)", plain)
    above, _, below = plain.partition("/") if plain.endswith(")") else plain.rpartition("/")
    parts = si(above), si(below.strip("()"))
    units = {"N·m/A": ("N·m", "A"), "rad/s/V": ("rad/s", "V"), "V/rad/s": ("V", "rad/s")}[wanted]
    if parts[0] is None or parts[1] is None or (parts[0][0], parts[1][0]) != units:
        return None
    return parts[0][1] / parts[1][1]
