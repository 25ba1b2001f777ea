"""Tables of numbers by named columns: currents, flux linkages, torque, speed, as others write them."""

import csv
import io
import math
import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.captures.units import si
from bench.i18n.errors import InputError, UsageError, at
from drivers.interfaces.text import reason_of, text

_LARGEST = 20_000_000
#: Units that are not of captures, with their factor to SI.
_UNITS = {
    "vs": 1.0, "v·s": 1.0, "v*s": 1.0, "wb": 1.0, "mvs": 1e-3, "mwb": 1e-3, "mv·s": 1e-3, "w": 1.0, "kw": 1e3, "mh": 1e-3,
    "degc": 1.0, "°c": 1.0, "c": 1.0,
}  # fmt: skip
_UNIT = re.compile(r"[\s_]*[\[(/]?\s*([^\s\[\]()/_]+)\s*[\])]?$")
_RMS = re.compile(r"[\s_]*(?:rms|eff)(?![a-z])")
#: As rad/s, which is a quotient itself.
_QUOTIENT = re.compile(r"[\s_]*[\[(]?\s*([^\s\[\]()_]+)\s*[\])]?$")


def read_table(
    path: Path, known: Mapping[str, Sequence[str]], needed: Sequence[str], mapped: Sequence[str] = ()
) -> dict[str, NDArray[np.float64]]:
    """Return the columns of a table with a heading, in SI, by our names; an empty cell is NaN.

    `known` are headings by our name, `needed` those that must be there, `mapped` NAME=HEADING as typed.
    Raises InputError naming file, line and column, UsageError for a mapping that names nothing.
    """
    content = _content(path)
    lines = [line for line in content.splitlines() if line.strip() and not line.lstrip().startswith("#")]
    if len(lines) < 2:
        raise InputError(at(str(path), text("a heading and rows of numbers are needed")))
    mark = next((each for each in ("\t", ";", ",") if each in lines[0]), " ")
    rows = list(csv.reader(io.StringIO("\n".join(lines)), delimiter=mark, skipinitialspace=True))
    heading = [cell.strip() for cell in rows[0]]
    units, first = [1.0] * len(heading), 1
    if len(rows[1]) == len(heading) and all(_unit_row(cell) is not None for cell in rows[1]):
        units, first = [_unit_row(cell) or 1.0 for cell in rows[1]], 2
    places: dict[str, tuple[int, float]] = {}
    for each in mapped:
        name, _, column = each.partition("=")
        if name not in known or not column:
            raise UsageError(
                text("--column {typed}: give NAME=HEADING with a name of {known}", typed=each, known=list(known))
            )
        if column not in heading:
            raise UsageError(
                text("--column {typed}: {path} has no column {column}; there are {there}", typed=each, path=str(path), column=column,
                     there=heading)
            )  # fmt: skip
        places[name] = heading.index(column), _split(column)[1] * units[heading.index(column)]
    for number, cell in enumerate(heading):
        name, factor = _split(cell)
        ours = next((key for key, aliases in known.items() if name in aliases), None)
        if ours is not None and ours not in places and number not in {place for place, _ in places.values()}:
            places[ours] = number, factor * units[number]
    lacking = [name for name in needed if name not in places]
    if lacking:
        raise InputError(
            at(str(path), text("no column for {lacking}; there are {there}: name it with --column {first}=HEADING", lacking=lacking,
                               there=heading, first=lacking[0]))
        )  # fmt: skip
    return {
        name: _numbers(path, rows, first, place, heading[place]) * factor for name, (place, factor) in places.items()
    }


def _content(path: Path) -> str:
    try:
        if path.stat().st_size > _LARGEST:
            raise InputError(at(str(path), text("the file is larger than 20 MB; a table of figures is wanted")))
        content = path.read_bytes()
    except OSError as error:
        raise InputError(at(str(path), text("cannot be read: {why}", why=reason_of(error)))) from None
    if content.startswith(b"PK\x03\x04"):
        raise InputError(at(str(path), text("is a workbook; save the sheet with the table as CSV")))
    marked = content.startswith((b"\xff\xfe", b"\xfe\xff"))
    # Spreadsheets write UTF-16 with a mark, or the old Western encoding.
    for encoding in ("utf-16",) if marked else ("utf-8-sig", "cp1252"):
        try:
            decoded = content.decode(encoding)
        except UnicodeDecodeError:
            continue
        if "\0" not in decoded:
            return decoded
    raise InputError(at(str(path), text("is no text in UTF-8")))


def _split(heading: str) -> tuple[str, float]:
    """Return a heading's name, plain, and its unit's factor to SI, from rms to peak where it says so."""
    plain, rms = _RMS.subn("", heading.strip().lower())
    peak = math.sqrt(2.0) if rms else 1.0
    for pattern in (_QUOTIENT, _UNIT):
        found = pattern.search(plain)
        factor = _factor(found[1]) if found and found.start() > 0 else None
        if found and factor is not None:
            return _plain(plain[: found.start()]), factor * peak
    return _plain(plain), peak


def _unit_row(cell: str) -> float | None:
    """Return a unit's factor to SI, from rms to peak where it says so; 1 for an empty cell, None where it is no unit."""
    plain, rms = _RMS.subn("", cell.strip().lower().strip("[]()"))
    factor = 1.0 if plain in ("", "-") else _factor(plain.strip())
    return None if factor is None else factor * (math.sqrt(2.0) if rms else 1.0)


def _factor(unit: str) -> float | None:
    if unit in _UNITS:
        return _UNITS[unit]
    known = si(unit)
    return known[1] if known else None


def _plain(name: str) -> str:
    return (
        re.sub(r"[\s_]+", "", name)
        .replace("ψ", "psi")
        .replace("λ", "psi")
        .replace("ω", "w")
        .replace("lambda", "psi")
        .replace("fluxlinkage", "flux")
    )


def _numbers(path: Path, rows: Sequence[Sequence[str]], first: int, place: int, heading: str) -> NDArray[np.float64]:
    made = np.full(len(rows) - first, np.nan)
    for line, row in enumerate(rows[first:], first + 1):
        cell = row[place].strip() if place < len(row) else ""
        if not cell or cell.lower() == "nan":
            continue
        try:
            made[line - first - 1] = float(cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell)
        except ValueError:
            raise InputError(
                at(
                    str(path),
                    text("line {line}, column {column}: '{cell}' is no number", line=line, column=heading, cell=cell),
                )
            ) from None
    return made
