"""A motor's data sheet typed as a table of name, value and unit: its figures by each convention that it leaves open; do they agree?"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from bench.analysis.published import PublishedFigure
from bench.analysis.sheet_values import Stated, stated_values
from drivers.interfaces.text import Text, text

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
    stated, unread = stated_values(path, content)
    if len(stated) < 2:
        return None
    sheet = DataSheet(unread=unread)
    sheet.figures = list(_figures(stated, sheet))
    sheet.checks = list(_checks(stated))
    if not sheet.figures and not sheet.checks and not sheet.unread:
        sheet.unread.append(
            text(
                "these rows alone give no figure: add resistance, inductance, torque or speed constant, inertia, or pole pairs"
            )
        )
    return sheet


def _pairs(stated: dict[str, Stated]) -> float | None:
    if "pole_pairs" in stated:
        return stated["pole_pairs"].value
    return stated["poles"].value / 2.0 if "poles" in stated else None


def _volts(stated: dict[str, Stated]) -> Stated | None:
    """Return the EMF constant (V·s/rad), its own or that of the speed constant."""
    if "emf_constant" in stated:
        return stated["emf_constant"]
    each = stated.get("speed_constant")
    return each._replace(value=1.0 / each.value) if each is not None and each.value else None


def _figures(stated: dict[str, Stated], sheet: DataSheet) -> Iterator[PublishedFigure]:
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


def _possible(reading: _Reading, stated: Stated) -> bool:
    """Tell whether a row may be read so: what it says is not contradicted, and who says rms or peak means no block commutation."""
    open_line = stated.line is None or reading.line is None or stated.line == reading.line
    return open_line and stated.rms in (None, reading.rms)


def _checks(stated: dict[str, Stated]) -> Iterator[Text]:
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
