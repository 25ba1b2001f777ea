"""Tables of numbers by named columns: currents, flux linkages, torque, speed, as others write them."""

import csv
import io
import math
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.analysis.heading_row import heading_of, refuse_open_quotation
from bench.captures.arrays import array_lines
from bench.captures.decimal_marks import doubtful_number
from bench.captures.encoding import decoded
from bench.captures.no_heading import without_comments
from bench.captures.signs import plain_signs, without_blanks
from bench.captures.text import BEYOND, NEGLIGIBLE, number
from bench.captures.units import si
from bench.i18n.errors import InputError, UsageError, at
from drivers.interfaces.text import reason_of, text

_LARGEST = 20_000_000
#: Units that are not of captures, with SI unit and factor.
_UNITS = {
    "vs": ("V·s", 1.0), "v·s": ("V·s", 1.0), "v*s": ("V·s", 1.0), "wb": ("V·s", 1.0), "mvs": ("V·s", 1e-3), "mwb": ("V·s", 1e-3),
    "mv·s": ("V·s", 1e-3), "mv*s": ("V·s", 1e-3),
    **dict.fromkeys(("uvs", "µvs", "μvs", "uwb", "µwb", "μwb"), ("V·s", 1e-6)),
    **dict.fromkeys(("°c", "degc", "deg c", "celsius", "℃"), ("°C", 1.0)),
    "w": ("W", 1.0), "watt": ("W", 1.0), "watts": ("W", 1.0), "kw": ("W", 1e3),
}  # fmt: skip
#: What a refusal offers for a unit.
_OFFERED = {
    "A": ("A", "mA", "A rms"), "V·s": ("Vs", "mVs", "Wb", "mWb"), "N·m": ("Nm", "mNm"), "W": ("W", "kW"), "rad/s": ("rpm", "rad/s"),
    "H": ("H", "mH", "uH"), "rad": ("deg", "rad"), "V": ("V", "mV"), "Hz": ("Hz", "kHz"), "°C": ("°C",),
}  # fmt: skip
_RMS = re.compile(r"[\s_,]*(?:rms|eff)(?![a-z])")
_PEAK = re.compile(r"[\s_,]*(?:peak|pk)(?![a-z-])")
#: Where a heading's unit may stand: in brackets, after "in", after a blank or an underscore, a quotient or not, after a stroke.
_PLACES = (
    re.compile(r"[\s_]*[\[(]\s*([^\[\]()]+?)\s*[\])]$"),
    re.compile(r"\s+in\s+(\S+)$"),
    re.compile(r"[\s_]+((?:rad|deg)[_/]s|[^\s\[\]()_]+)$"),
    re.compile(r"\s*/\s*([^\s\[\]()/_]+)$"),
)


@dataclass(frozen=True)
class KnownColumn:
    """A column that is looked for: its SI unit, and the headings that it may have, plain."""

    unit: str
    headings: tuple[str, ...]


#: Headings of a torque and of a speed.
TORQUE = ("torque", "t", "m", "outputtorque", "shafttorque", "motortorque")
SPEED = (
    "speed", "n", "w", "rpm", "krpm", "1/min", "min-1", "u/min", "r/min", "rad/s", "outputspeed", "shaftspeed", "motorspeed",
)  # fmt: skip


@dataclass(frozen=True)
class _Heading:
    """A heading's name, plain, and its unit (SI) with its factor, from rms to peak where it says rms; an empty unit where it says none."""

    name: str
    unit: str = ""
    factor: float = 1.0
    rms: bool = False


def read_table(
    path: Path,
    known: Mapping[str, KnownColumn],
    needed: Sequence[str],
    mapped: Sequence[str] = (),
    *,
    instead: Mapping[str, str] | None = None,
    unless: Mapping[str, Collection[str]] | None = None,
    rms: Collection[str] = (),
    most: int | None = None,
) -> dict[str, NDArray[np.float64]]:
    """Return the columns of a table with a heading, in SI, peak values, by our names; an empty cell is NaN.

    `known` are the columns by our name, `needed` those that must be there, `mapped` NAME=HEADING as typed, where a unit in brackets may
    follow the heading; `instead` names the column that does in place of a needed one, `unless` those that are passed over where one is
    there; those in `rms` are rms whether their heading says so or not. Raises InputError naming file, line and column, also where a unit
    is left open, or for more than `most` rows; UsageError for a mapping that names nothing.
    """
    content = array_lines(path) or _content(path).splitlines()
    numbered = [(place, line) for place, line in enumerate(without_comments(content), 1) if line.strip()]
    lines = [line for _, line in numbered]
    if len(lines) < 2:
        raise InputError(at(str(path), text("a heading and rows of numbers are needed")))
    place, mark = heading_of(lines)
    numbered, lines = numbered[place:], lines[place:]
    if len(lines) < 2:
        raise InputError(at(str(path), text("a heading and rows of numbers are needed")))
    if most is not None and len(lines) - 1 > most:
        raise InputError(
            at(
                str(path),
                text("{count} rows; up to {most} are taken, thin the table out", count=len(lines) - 1, most=most),
            )
        )
    rows = list(csv.reader(io.StringIO("\n".join(lines)), delimiter=mark, skipinitialspace=True))
    refuse_open_quotation(path, rows, [each for each, _ in numbered])
    heading = [cell.strip() for cell in rows[0]]
    below, first = [_Heading("")] * len(heading), 1
    if len(rows[1]) == len(heading):
        units = _unit_row(rows[1])
        if units is not None:
            below, first = units, 2
    places: dict[str, tuple[int, _Heading]] = {}
    twice: dict[str, int] = {}
    for each in mapped:
        name, place, said = _mapped(path, each, known, heading)
        places[name] = place, said if said.unit else below[place]
    for place, cell in enumerate(heading):
        said = _split(cell, known)
        ours = next((key for key, column in known.items() if said.name in column.headings), None)
        if ours is None or place in {taken for taken, _ in places.values()}:
            continue
        if ours not in places:
            places[ours] = place, said if said.unit else below[place]
            twice[ours] = -1
        elif twice.get(ours) == -1:
            twice[ours] = place
    for name in (each for there, others in (unless or {}).items() if there in places for each in others):
        places.pop(name, None)
        twice.pop(name, None)
    if not places and heading and all(number(cell) is not None for cell in heading[1:]):
        raise InputError(
            at(
                str(path),
                text(
                    "the first row has numbers in place of headings. A table with one current along its rows and the other along its "
                    "columns is to be written row by row under headings, or saved as matrices of these names (.mat, .npz): {needed}",
                    needed=list(needed),
                ),
            )
        )
    lacking = [name for name in needed if name not in places and (instead or {}).get(name) not in places]
    if lacking:
        raise InputError(
            at(str(path), text("no column found for {lacking}. The columns are {there}; name the right one with --column "
                "{first}=HEADING", lacking=lacking,
                               there=heading, first=lacking[0]))
        )  # fmt: skip
    for name, (place, said) in places.items():
        if said.unit != known[name].unit:
            raise _open_unit(path, name, known[name], heading[place])
    for name, other in twice.items():
        if other >= 0:
            raise InputError(
                at(
                    str(path),
                    text(
                        "two columns could be the {name}: {first} and {second}; choose one with --column "
                        "{name}=HEADING",
                        name=name,
                        first=heading[places[name][0]],
                        second=heading[other],
                    ),
                )
            )
    _refuse_surplus(path, rows, [each for each, _ in numbered], first)
    _refuse_doubtful(path, rows, [each for each, _ in numbered], first, heading, comma_between=mark == ",")
    return {
        name: _numbers(path, rows, [each for each, _ in numbered], first, place, heading[place])
        * said.factor
        * (math.sqrt(2.0) if name in rms and not said.rms else 1.0)
        for name, (place, said) in places.items()
    }


def _mapped(
    path: Path, typed: str, known: Mapping[str, KnownColumn], heading: Sequence[str]
) -> tuple[str, int, _Heading]:
    """Return our name, the column's place and its unit of NAME=HEADING as typed."""
    name, _, column = typed.partition("=")
    if name not in known or not column:
        raise UsageError(
            text("--column {typed}: give NAME=HEADING with a name of {known}", typed=typed, known=list(known))
        )
    bare = _PLACES[0].sub("", column)
    if column not in heading and bare not in heading:
        raise UsageError(
            text("--column {typed}: {path} has no column {column}; there are {there}", typed=typed, path=str(path), column=column,
                 there=heading)
        )  # fmt: skip
    return name, heading.index(column if column in heading else bare), _split(column, known)


def _open_unit(path: Path, name: str, column: KnownColumn, heading: str) -> InputError:
    offered = _OFFERED[column.unit]
    return InputError(
        at(
            str(path),
            text(
                "column '{heading}' states no unit for {name}, or the unit of another quantity. Write the unit "
                "into the heading, as in '{bare} ({unit})', or give --column '{name}={heading} ({unit})'; known "
                "units are {offered}",
                heading=heading,
                bare=_PLACES[0].sub("", heading),
                name=name,
                unit=offered[0],
                offered=list(offered),
            ),
        )
    )


def _content(path: Path) -> str:
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(at(str(path), text("the file is larger than 20 MB; give a table of figures")))
        content = path.read_bytes()
    except OSError as error:
        raise InputError(at(str(path), text("cannot be read: {why}", why=reason_of(error)))) from None
    if content.startswith(b"PK\x03\x04"):
        raise InputError(at(str(path), text("is a workbook; save the sheet with the table as CSV")))
    words = decoded(content)
    if words is None:
        raise InputError(at(str(path), text("is no text in UTF-8")))
    return plain_signs(words)


def _split(heading: str, known: Mapping[str, KnownColumn]) -> _Heading:
    """Return a heading's name and unit; one that is a unit only, as "rpm", is both."""
    plain, rms = _without_kind(heading)
    for pattern in _PLACES:
        match = pattern.search(plain)
        unit = _unit(match[1]) if match and match.start() > 0 else None
        if match and unit is not None:
            return _Heading(_plain(plain[: match.start()]), unit[0], unit[1] * (math.sqrt(2.0) if rms else 1.0), rms)
    name, unit = _plain(plain), _unit(plain)
    if unit is not None and any(name in column.headings and column.unit == unit[0] for column in known.values()):
        return _Heading(name, *unit)
    # A unit that is not known is said to be none, of the column that bears it.
    bare = _plain(_PLACES[0].sub("", plain))
    return _Heading(bare if any(bare in column.headings for column in known.values()) else name, rms=rms)


def _unit_row(cells: Sequence[str]) -> list[_Heading] | None:
    """Return what the cells of a row below the heading say of units, nothing of one that is not known; None where it is no row of units."""
    found: list[_Heading | None] = []
    for cell in cells:
        plain, rms = _without_kind(cell.strip().strip("[]()"))
        unit = None if plain in ("", "-") else _unit(plain)
        if number(plain.replace(",", ".")) is not None:
            return None
        factor = math.sqrt(2.0) if rms else 1.0
        found.append(_Heading("") if plain in ("", "-") else unit and _Heading("", unit[0], unit[1] * factor, rms))
    named = [each for each in found if each is None or each.unit]
    if 2 * sum(each is not None for each in named) < len(named) or not any(named):
        return None if named else [_Heading("")] * len(cells)
    return [each or _Heading("") for each in found]


def _without_kind(words: str) -> tuple[str, bool]:
    """Return words in small letters without what they say of rms or peak, and whether they say rms."""
    plain, rms = _RMS.subn("", words.strip().lower())
    return _PEAK.sub("", plain).strip(), bool(rms)


def _unit(words: str) -> tuple[str, float] | None:
    plain = re.sub(r"^(m?n)[ .\-]m$", r"\1m", words.replace("rad_s", "rad/s").replace("rad s-1", "rad/s"))
    return _UNITS.get(plain) or si(plain)


def _plain(name: str) -> str:
    return (
        re.sub(r"[\s_]+", "", name)
        .replace("ψ", "psi")
        .replace("λ", "psi")
        .replace("ω", "w")
        .replace("lambda", "psi")
        .replace("fluxlinkage", "flux")
    )


def _refuse_surplus(path: Path, rows: Sequence[Sequence[str]], lines: Sequence[int], first: int) -> None:
    """Raise InputError for a row with more figures than headings: a comma may be decimal mark and separator in it."""
    for place, row in enumerate(rows[first:], first):
        if any(cell.strip() for cell in row[len(rows[0]) :]):
            raise InputError(
                at(
                    str(path),
                    text(
                        "line {line}: {count} cells under {headings} headings. If the comma is the decimal mark, separate the columns with "
                        "semicolons or tabs",
                        line=lines[min(place, len(lines) - 1)],
                        count=len(row),
                        headings=len(rows[0]),
                    ),
                )
            )


def _refuse_doubtful(
    path: Path,
    rows: Sequence[Sequence[str]],
    lines: Sequence[int],
    first: int,
    heading: Sequence[str],
    *,
    comma_between: bool,
) -> None:
    """Raise InputError for a number that may be thousands or decimals."""
    cells = [(place, column, cell) for place, row in enumerate(rows[first:], first) for column, cell in enumerate(row)]
    doubtful = doubtful_number((cell for _, _, cell in cells), comma_between=comma_between)
    if doubtful is not None:
        place, column, _ = cells[doubtful[0]]
        raise InputError(
            at(
                str(path),
                text(
                    "line {line}, column {column}: {said}",
                    line=lines[min(place, len(lines) - 1)],
                    column=heading[column] if column < len(heading) else str(column + 1),
                    said=doubtful[1],
                ),
            )
        )


def _numbers(
    path: Path, rows: Sequence[Sequence[str]], lines: Sequence[int], first: int, place: int, heading: str
) -> NDArray[np.float64]:
    result = np.full(len(rows) - first, np.nan)
    for at_row, row in enumerate(rows[first:]):
        cell = without_blanks(row[place].strip()) if place < len(row) else ""
        if not cell or cell.lower() == "nan":
            continue
        line = lines[min(first + at_row, len(lines) - 1)]
        read = number(cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell)
        if read is None:
            raise InputError(
                at(
                    str(path),
                    text(
                        "line {line}, column {column}: '{cell}' is not a number", line=line, column=heading, cell=cell
                    ),
                )
            )
        if not abs(read) < BEYOND:
            raise InputError(
                at(
                    str(path),
                    text(
                        "line {line}, column {column}: {value:.3g} is not a possible reading; correct or remove "
                        "the row",
                        line=line,
                        column=heading,
                        value=read,
                    ),
                )
            )
        result[at_row] = read if abs(read) >= NEGLIGIBLE else 0.0
    return result
