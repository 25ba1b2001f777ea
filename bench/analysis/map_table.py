"""Tables of numbers by named columns: currents, flux linkages, torque, speed, as others write them."""

import csv
import io
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from bench.analysis.heading_row import heading_of, refuse_open_quotation
from bench.analysis.table_headings import Heading, KnownColumn, bare, offered_units, split, unit_row
from bench.captures.arrays import array_lines
from bench.captures.decimal_marks import doubtful_number
from bench.captures.encoding import decoded
from bench.captures.no_heading import without_comments
from bench.captures.signs import plain_signs, without_blanks
from bench.captures.text import BEYOND, NEGLIGIBLE, number
from bench.i18n.errors import InputError, UsageError, at
from drivers.interfaces.text import Text, reason_of, text

_LARGEST = 20_000_000
#: Headings of a torque and of a speed.
TORQUE = ("torque", "t", "m", "outputtorque", "shafttorque", "motortorque")
SPEED = (
    "speed", "n", "w", "rpm", "krpm", "1/min", "min-1", "u/min", "r/min", "rad/s", "outputspeed", "shaftspeed", "motorspeed",
)  # fmt: skip


@dataclass(frozen=True)
class _Table:
    """The rows of a table's figures, each with its line in the file; `below` is what a row of units says of each heading."""

    path: Path
    heading: Sequence[str]
    below: Sequence[Heading]
    rows: Sequence[tuple[int, Sequence[str]]]
    comma_between: bool

    def wrong(self, said: Text) -> InputError:
        """Return the error of this file."""
        return InputError(at(str(self.path), said))


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
    table = _table(path, most)
    places = _places(table, known, mapped, unless or {})
    if not places and table.heading and all(number(cell) is not None for cell in table.heading[1:]):
        raise table.wrong(
            text(
                "the first row has numbers in place of headings. A table with one current along its rows and the other along its "
                "columns is to be written row by row under headings, or saved as matrices of these names (.mat, .npz): {needed}",
                needed=list(needed),
            )
        )
    lacking = [name for name in needed if name not in places and (instead or {}).get(name) not in places]
    if lacking:
        raise table.wrong(
            text("no column found for {lacking}. The columns are {there}; name the right one with --column "
                "{first}=HEADING", lacking=lacking,
                               there=table.heading, first=lacking[0])
        )  # fmt: skip
    for name, spots in places.items():
        if spots[0][1].unit != known[name].unit:
            raise _open_unit(table, name, known[name], table.heading[spots[0][0]])
    for name, spots in places.items():
        if len(spots) > 1:
            raise table.wrong(
                text(
                    "two columns could be the {name}: {first} and {second}; choose one with --column {name}=HEADING",
                    name=name,
                    first=table.heading[spots[0][0]],
                    second=table.heading[spots[1][0]],
                )
            )
    _refuse_surplus(table)
    _refuse_doubtful(table)
    return {
        name: _numbers(table, place) * said.factor * (math.sqrt(2.0) if name in rms and not said.rms else 1.0)
        for name, ((place, said), *_) in places.items()
    }


def _table(path: Path, most: int | None) -> _Table:
    content = array_lines(path) or _content(path).splitlines()
    numbered = [(place, line) for place, line in enumerate(without_comments(content), 1) if line.strip()]
    place, mark = heading_of([line for _, line in numbered]) if len(numbered) > 1 else (0, "")
    numbered = numbered[place:]
    if len(numbered) < 2:
        raise InputError(at(str(path), text("a heading and rows of numbers are needed")))
    if most is not None and len(numbered) - 1 > most:
        said = text("{count} rows; up to {most} are taken, thin the table out", count=len(numbered) - 1, most=most)
        raise InputError(at(str(path), said))
    lines = "\n".join(line for _, line in numbered)
    rows = list(csv.reader(io.StringIO(lines), delimiter=mark, skipinitialspace=True))
    places = [place for place, _ in numbered]
    refuse_open_quotation(path, rows, places)
    heading = [cell.strip() for cell in rows[0]]
    units = unit_row(rows[1]) if len(rows[1]) == len(heading) else None
    figures = list(zip(places, rows, strict=False))[1 if units is None else 2 :]
    return _Table(path, heading, units or [Heading("")] * len(heading), figures, mark == ",")


def _places(
    table: _Table, known: Mapping[str, KnownColumn], mapped: Sequence[str], unless: Mapping[str, Collection[str]]
) -> dict[str, list[tuple[int, Heading]]]:
    """Return by our names where their columns are and what their headings say: the one typed, or all that could be it."""
    typed = {name: (place, said) for name, place, said in (_mapped(table, each, known) for each in mapped)}
    found = {name: [spot] for name, spot in typed.items()}
    taken = {place for place, _ in typed.values()}
    for place, cell in enumerate(table.heading):
        said = split(cell, known)
        ours = next((key for key, column in known.items() if said.name in column.headings), None)
        if ours is not None and place not in taken and ours not in typed:
            found.setdefault(ours, []).append((place, said))
    for name in (each for there, others in unless.items() if there in found for each in others):
        found.pop(name, None)
    return {
        name: [(place, said if said.unit else table.below[place]) for place, said in spots]
        for name, spots in found.items()
    }


def _mapped(table: _Table, typed: str, known: Mapping[str, KnownColumn]) -> tuple[str, int, Heading]:
    """Return our name, the column's place and its unit of NAME=HEADING as typed."""
    heading = table.heading
    name, _, column = typed.partition("=")
    if name not in known or not column:
        raise UsageError(
            text("--column {typed}: give NAME=HEADING with a name of {known}", typed=typed, known=list(known))
        )
    plain = bare(column)
    if column not in heading and plain not in heading:
        raise UsageError(
            text("--column {typed}: {path} has no column {column}; there are {there}", typed=typed, path=str(table.path), column=column,
                 there=heading)
        )  # fmt: skip
    return name, heading.index(column if column in heading else plain), split(column, known)


def _open_unit(table: _Table, name: str, column: KnownColumn, heading: str) -> InputError:
    offered = offered_units(column.unit)
    return table.wrong(
        text(
            "column '{heading}' states no unit for {name}, or the unit of another quantity. Write the unit "
            "into the heading, as in '{bare} ({unit})', or give --column '{name}={heading} ({unit})'; known "
            "units are {offered}",
            heading=heading,
            bare=bare(heading),
            name=name,
            unit=offered[0],
            offered=list(offered),
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


def _refuse_surplus(table: _Table) -> None:
    """Raise InputError for a row with more figures than headings: a comma may be decimal mark and separator in it."""
    for line, row in table.rows:
        if any(cell.strip() for cell in row[len(table.heading) :]):
            raise table.wrong(
                text(
                    "line {line}: {count} cells under {headings} headings. If the comma is the decimal mark, separate the columns with "
                    "semicolons or tabs",
                    line=line,
                    count=len(row),
                    headings=len(table.heading),
                )
            )


def _refuse_doubtful(table: _Table) -> None:
    """Raise InputError for a number that may be thousands or decimals."""
    cells = [(line, column, cell) for line, row in table.rows for column, cell in enumerate(row)]
    doubtful = doubtful_number((cell for _, _, cell in cells), comma_between=table.comma_between)
    if doubtful is not None:
        line, column, _ = cells[doubtful[0]]
        heading = table.heading[column] if column < len(table.heading) else str(column + 1)
        raise table.wrong(text("line {line}, column {column}: {said}", line=line, column=heading, said=doubtful[1]))


def _numbers(table: _Table, place: int) -> NDArray[np.float64]:
    result, heading = np.full(len(table.rows), np.nan), table.heading[place]
    for at_row, (line, row) in enumerate(table.rows):
        cell = without_blanks(row[place].strip()) if place < len(row) else ""
        if not cell or cell.lower() == "nan":
            continue
        read = number(cell.replace(",", ".") if cell.count(",") == 1 and "." not in cell else cell)
        if read is None:
            raise table.wrong(
                text("line {line}, column {column}: '{cell}' is not a number", line=line, column=heading, cell=cell)
            )
        if not abs(read) < BEYOND:
            raise table.wrong(
                text(
                    "line {line}, column {column}: {value:.3g} is not a possible reading; correct or remove the row",
                    line=line,
                    column=heading,
                    value=read,
                )
            )
        result[at_row] = read if abs(read) >= NEGLIGIBLE else 0.0
    return result
