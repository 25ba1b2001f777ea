"""A motor's data sheet typed as a table of name, value and unit: its figures by each convention that it leaves open; do they agree?"""

import math
import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from bench.analysis.published import PublishedFigure
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
_ROOT3, _ROOT2 = math.sqrt(3.0), math.sqrt(2.0)
#: Data sheets have three digits and tolerances: figures that agree within this share are one.
_NEAR = 0.03


class _Reading(NamedTuple):
    """A convention: its words, and flux linkage (V·s) times pole pairs over the constant (SI)."""

    words: Text
    factor: float
    rms: bool | None
    line: bool | None


_OF_CURRENT = (
    _Reading(text("per ampere, peak, of a sine current"), 1 / 1.5, False, None),
    _Reading(text("per ampere, rms, of a sine current"), 1 / (1.5 * _ROOT2), True, None),
    _Reading(text("per ampere between two terminals, by the peak of their EMF"), 1 / _ROOT3, None, True),
    _Reading(
        text("per ampere between two terminals, by the mean of their EMF over a state of 60°"),
        math.pi / (3 * _ROOT3),
        None,
        True,
    ),
)
_OF_VOLTAGE = (
    _Reading(text("peak between two lines"), 1 / _ROOT3, False, True),
    _Reading(text("rms between two lines"), _ROOT2 / _ROOT3, True, True),
    _Reading(text("mean between two lines over a state of 60°"), math.pi / (3 * _ROOT3), None, True),
    _Reading(text("peak of a phase"), 1.0, False, False),
    _Reading(text("rms of a phase"), _ROOT2, True, False),
)


class _Stated(NamedTuple):
    """A row: value (SI), and whether its name or unit says rms or peak, line or phase; None where it does not."""

    value: float
    rms: bool | None
    line: bool | None


@dataclass
class DataSheet:
    """Figures with their readings, `checks` of the sheet against itself, `unread` rows with the reason."""

    figures: list[PublishedFigure] = field(default_factory=list)
    checks: list[Text] = field(default_factory=list)
    unread: list[Text] = field(default_factory=list)


def read_data_sheet(path: Path, content: str) -> DataSheet | None:
    """Return what a table of names, values and units says; None where it is not one: no two rows are known quantities.

    Raises InputError for a number that may be thousands or decimals.
    """
    if content.lstrip()[:1] in ("{", "<"):
        return None
    stated, sheet = _stated(path, content)
    if len(stated) < 2:
        return None
    sheet.figures = list(_figures(stated, sheet))
    sheet.checks = list(_checks(stated))
    if not sheet.figures and not sheet.checks and not sheet.unread:
        sheet.unread.append(
            text(
                "these rows alone give no figure: add resistance, inductance, torque or speed constant, inertia, or pole pairs"
            )
        )
    return sheet


def _stated(path: Path, content: str) -> tuple[dict[str, _Stated], DataSheet]:
    rows, mark = rows_of(plain_signs(content), lambda row: _kind(row) is not None and _number(row) is not None)
    found: dict[str, _Stated] = {}
    ambiguous: set[str] = set()
    sheet = DataSheet()
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
                sheet.unread.append(text("'{row}': its second cell is no number", row=mark.join(cells)))
            continue
        if kind in found or kind in ambiguous or len(row) > 3 or (number[2] and len(row) > 2):
            why = text(
                "'{row}': more than one value of this quantity; keep the one that is meant", row=mark.join(cells)
            )
            sheet.unread.append(why)
            found.pop(kind, None)
            ambiguous.add(kind)
            continue
        value = float(number[1].replace(",", "."))
        if value <= 0.0:
            sheet.unread.append(text("'{row}': a value above zero is needed", row=mark.join(cells)))
            continue
        unit = number[2] or (row[2] if len(row) > 2 else "")
        factor = _factor(unit, _NAMES[kind][1])
        if factor is None:
            sheet.unread.append(
                text("'{row}': a unit of {wanted} is needed", row=mark.join(cells), wanted=_NAMES[kind][1])
            )
            continue
        said = f"{row[0]} {unit}"
        rms = True if _RMS.search(said) else False if _PEAK.search(said) else None
        line = False if _PHASE.search(said) else True if _LINE.search(said) else None
        found[kind] = _Stated(value * factor, rms, line)
    return found, sheet


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


def _pairs(stated: dict[str, _Stated]) -> float | None:
    if "pole_pairs" in stated:
        return stated["pole_pairs"].value
    return stated["poles"].value / 2.0 if "poles" in stated else None


def _volts(stated: dict[str, _Stated]) -> _Stated | None:
    """Return the EMF constant (V·s/rad), its own or that of the speed constant."""
    if "emf_constant" in stated:
        return stated["emf_constant"]
    each = stated.get("speed_constant")
    return each._replace(value=1.0 / each.value) if each is not None and each.value else None


def _figures(stated: dict[str, _Stated], sheet: DataSheet) -> Iterator[PublishedFigure]:
    pairs = _pairs(stated)
    if pairs is not None:
        yield PublishedFigure("pole_pairs", pairs)
    if "inertia" in stated:
        yield PublishedFigure("inertia", stated["inertia"].value)
    for name, parameter in (("resistance", "stator_resistance"), ("inductance", "inductance")):
        if (each := stated.get(name)) is None:
            continue
        if each.line is not False:
            yield PublishedFigure(parameter, 0.5 * each.value, reading=text("half of the value between two lines"))
        if not each.line:
            yield PublishedFigure(parameter, each.value, reading=text("value of a phase"))
    for kind, constant, readings in (
        ("K_t", stated.get("torque_constant"), _OF_CURRENT),
        ("K_e", _volts(stated), _OF_VOLTAGE),
    ):
        if constant is None:
            continue
        if not pairs:
            sheet.unread.append(text("no flux linkage from {constant}: the pole pairs are missing", constant=kind))
            continue
        for reading in readings:
            if _possible(reading, constant):
                yield PublishedFigure(
                    "flux_linkage",
                    constant.value * reading.factor / pairs,
                    reading=text("{constant}: {words}", constant=kind, words=reading.words),
                )


def _possible(reading: _Reading, stated: _Stated) -> bool:
    """Tell whether a row may be read so: what it says is not contradicted, and who says rms or peak means no block commutation."""
    open_line = stated.line is None or reading.line is None or stated.line == reading.line
    return open_line and stated.rms in (None, reading.rms)


def _checks(stated: dict[str, _Stated]) -> Iterator[Text]:
    torque, volts = stated.get("torque_constant"), _volts(stated)
    if torque is not None and volts is not None and volts.value:
        ratio = torque.value / volts.value
        fits = [
            text("K_t {current} with K_e {voltage}", current=c.words, voltage=v.words)
            for c in _OF_CURRENT
            for v in _OF_VOLTAGE
            if _possible(c, torque) and _possible(v, volts) and abs(ratio * c.factor / v.factor - 1.0) < _NEAR
        ]
        if fits:
            yield text("K_t/K_e = K_t·K_n·2π/60 is {ratio:.3f}, as of: {fits}", ratio=ratio, fits=fits)
        else:
            yield text(
                "K_t/K_e = K_t·K_n·2π/60 is {ratio:.3g}, which no usual pair of conventions gives: one of the two or its unit is wrong "
                "(9.55 or 0.105: rad/s and rpm exchanged)",
                ratio=ratio,
            )
    resistance = stated.get("resistance")
    if torque is None or resistance is None or not torque.value or not resistance.value:
        return
    if "mechanical_time" in stated and "inertia" in stated:
        yield _compared(
            text("mechanical time constant"),
            stated["mechanical_time"].value,
            resistance.value * stated["inertia"].value / torque.value**2,
            "R·J/K_t²",
        )
    if "voltage" in stated:
        stall = stated["voltage"].value / resistance.value
        if "stall_current" in stated:
            yield _compared(text("stall current"), stated["stall_current"].value, stall, "U/R")
        if "stall_torque" in stated:
            yield _compared(text("stall torque"), stated["stall_torque"].value, torque.value * stall, "K_t·U/R")
    if "voltage" in stated and "no_load_speed" in stated and volts is not None and volts.value:
        drop = resistance.value * stated["no_load_current"].value if "no_load_current" in stated else 0.0
        yield _compared(
            text("no-load speed"),
            stated["no_load_speed"].value,
            (stated["voltage"].value - drop) / volts.value,
            "(U − R·I₀)/K_e",
        )


#: Factors between conventions, as they appear in R·J/K_t² and its like.
_FACTORS = {
    "1/2": 0.5, "1.5": 1.5, "2": 2.0, "3": 3.0, "0.75": 0.75, "2/3": 2 / 3,
    "√3": _ROOT3, "1/√3": 1 / _ROOT3, "√2": _ROOT2, "1/√2": 1 / _ROOT2,
}  # fmt: skip


def _compared(name: Text, stated: float, computed: float, formula: str) -> Text:
    ratio = stated / computed if computed else math.inf
    if abs(ratio - 1.0) < 2 * _NEAR:
        return text("{name} agrees with {formula} ({ratio:.3f} times)", name=name, formula=formula, ratio=ratio)
    factor = next((n for n, f in _FACTORS.items() if abs(ratio / f - 1.0) < _NEAR), None)
    if factor is None:
        return text(
            "{name} is {ratio:.3g} times {formula}: a figure, its unit or its convention is another one",
            name=name,
            formula=formula,
            ratio=ratio,
        )
    return text(
        "{name} is {ratio:.3g} times {formula}, the factor {factor}: R is that of a phase or between two lines, or K_t is per ampere "
        "rms or peak",
        name=name,
        formula=formula,
        ratio=ratio,
        factor=factor,
    )
