"""Plain tables: a column of time (or angle) and columns of values, with or without headings."""

import csv
import re
from dataclasses import replace
from pathlib import Path

import numpy as np

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.cell_units import has_units, without_units
from bench.captures.decimal_marks import doubtful_number
from bench.captures.marks import OVER_RANGE, at_the_ends, over_range_marked, seconds_by_the_clock
from bench.captures.no_heading import names_without_heading, without_comments
from bench.captures.plain_time import take_time
from bench.captures.signs import without_blanks
from bench.captures.text import check_increasing, number, read_numbers
from bench.captures.text_columns import without_text_columns
from bench.captures.units import si, split_heading
from bench.captures.written_digits import FloatArray
from drivers.interfaces.text import Text, text

#: What may be a blank between thousands.
_GROUPED = re.compile(r"\d \d{3}")
#: A number without a decimal mark.
_WHOLE = re.compile(r"[+-]?\d+(?:[eE][+-]?\d+)?")
#: A decimal comma inside quotation marks, and what stands in quotation marks.
_QUOTED_COMMA, _QUOTED = re.compile(r'"[^",]*\d,\d[^",]*"'), re.compile(r'"[^"]*"')


def _without_quoted_commas(lines: list[str]) -> list[str]:
    """Return lines whose cells are apart by semicolons where commas do that, and decimal commas stand in quotation marks."""
    if not any("," in _QUOTED.sub("", line) and _QUOTED_COMMA.search(line) for line in lines[:100]):
        return lines
    return [";".join(next(csv.reader([line], skipinitialspace=True), [])) for line in lines]


def _separator(line: str) -> str | None:
    for mark in ("\t", ";"):
        if mark in line:
            return mark
    # A comma between digits with blanks elsewhere is a decimal comma, as in "0,001 1,25".
    cells = line.split()
    if (
        len(cells) > 1
        and all(number(c.replace(",", ".")) is not None for c in cells)
        and not line.strip().rstrip(",").endswith(",")
    ):
        separated = any(c.endswith(",") for c in cells)
        return "," if separated else None
    return "," if "," in line else None


def _cells(line: str, delimiter: str | None) -> list[str]:
    cells = [cell.strip() if delimiter is None else without_blanks(cell.strip()) for cell in line.split(delimiter)]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


def _without_blanks(line: str, delimiter: str) -> str:
    return delimiter.join(map(without_blanks, line.split(delimiter))) if _GROUPED.search(line) else line


def _numeric(line: str, delimiter: str | None) -> bool:
    # A first cell that is a number makes a row of data, however broken the rest: it is complained of, not passed over.
    cells = _cells(line, delimiter)
    if not cells:
        return False
    return number(cells[0].replace(",", ".") if delimiter != "," else cells[0]) is not None or (
        len(cells) > 1 and has_units(cells)
    )


def read_plain(
    path: Path,
    lines: list[str],
    *,
    abscissa: str = "time",
    time_column: str | None = None,
    time_unit: str | None = None,
) -> Capture:
    """Return the capture; comma, semicolon, tab or blanks between columns, decimal comma or point.

    `abscissa` says what the first column is where no heading does: "time" (s), "angle" (rad) or "current" (A); `time_column` is the name
    of the column of time, or its number from 1, where it is not the first; `time_unit` is its unit where it says none. Raises CaptureError.
    """
    lines = without_comments(lines)
    if abscissa == "time":
        # A blank line among samples may stand for one that is missing.
        return _read_table(path, lines, abscissa, time_column, time_unit)
    places = [k for k, line in enumerate(lines) if line.strip(" \t;,")]
    try:
        table = _read_table(path, [lines[k] for k in places], abscissa, time_column, time_unit)
    except CaptureError as error:
        if error.line is None or places[error.line - 1] == error.line - 1:
            raise
        raise CaptureError(error.source, error.what, places[error.line - 1] + 1) from error
    return replace(table, first_line=places[table.first_line - 1] + 1)


def _read_table(path: Path, lines: list[str], abscissa: str, time_column: str | None, time_unit: str | None) -> Capture:
    lines, by_clock = seconds_by_the_clock(_without_quoted_commas(lines))
    first, delimiter = 0, None
    for k, line in enumerate(lines[:100]):
        delimiter = _separator(line)
        if line.strip() and _numeric(line, delimiter):
            first = k
            break
    else:
        raise CaptureError(
            str(path), text("no row of numbers within the first 100 lines; export time and values as columns"), 1
        )
    if delimiter is not None and _GROUPED.search("\n".join(lines[first:])):
        lines = [*lines[:first], *(_without_blanks(line, delimiter) for line in lines[first:])]
    lines, left_out = without_text_columns(lines, first, delimiter)
    units: dict[int, str] = {}
    if has_units(_cells(lines[first], delimiter)):
        lines, units = without_units(path, lines, first, delimiter)
    width = len(_cells(lines[first], delimiter))
    if width < 2:
        raise CaptureError(str(path), text("has one column only; export time and values side by side"), first + 1)
    if delimiter != "," and any("," in line for line in lines[first : first + 50]):
        _refuse_doubtful(path, lines, first, delimiter)
        lines = [*lines[:first], *(line.replace(",", ".") for line in lines[first:])]
    if delimiter == ",":
        _refuse_decimal_commas(path, lines, first)
        lines = [*lines[:first], *(line.rstrip().rstrip(",") for line in lines[first:])]
    table = read_numbers(
        path, over_range_marked(lines, first), first, tuple(range(width)), delimiter, allowed=OVER_RANGE
    )
    _refuse_over_range(path, table, first)
    if table.shape[0] < 2:
        raise CaptureError(str(path), text("holds one row of numbers only; export the whole record"), first + 1)
    headings, assumptions = _headings(lines[:first], width, abscissa, time_column)
    no_heading = bool(assumptions) and not by_clock and 0 not in units
    noted = [
        text("column '{name}' has {count} numbers and blanks below; it is left out", name=name, count=count)
        if count
        else text("column '{name}' holds no number; it is left out", name=name)
        for name, count in left_out.items()
    ]
    headings = [(name, units.get(k, unit)) for k, (name, unit) in enumerate(headings)]
    if by_clock:
        headings[0] = headings[0][0], "s"
        assumptions = [text("time by the clock, counted in seconds from the first sample")]
    assumptions += noted
    columns = []
    for k, (name, unit) in enumerate(headings):
        known = si(unit) if unit else None
        if unit and known is None:
            assumptions.append(
                text(
                    "unit '{unit}' of column '{name}' is not known; its values are used unchanged", unit=unit, name=name
                )
            )
        column = at_the_ends(table[:, k]) if k else None
        if column is not None:
            assumptions.append(
                text(
                    "column '{name}': {count} readings are marked as over range; they are treated as clipped at "
                    "the extreme of its other readings",
                    name=name,
                    count=int(np.count_nonzero(np.abs(table[:, k]) >= OVER_RANGE)),
                )
            )
        values = (table[:, k] if column is None else column) * (known[1] if known else 1.0)
        clipped = None if column is None else True
        columns.append(CaptureChannel.written(name, known[0] if known else unit, values, clipped))
    is_time, unit_open = take_time(
        path, columns, assumptions, first, time_column, time_unit, no_heading=no_heading, said=headings[0][1]
    )
    if is_time:
        check_increasing(path, columns[0].values, first)
    return Capture(
        tuple(columns[1:] if is_time else columns),
        np.asarray(columns[0].values) if is_time else None,
        str(path),
        "plain table",
        tuple(assumptions),
        first_line=first + 1,
        time_unit_open=unit_open,
    )


def _refuse_over_range(path: Path, table: FloatArray, first: int) -> None:
    """Raise CaptureError where the first column is over range, or another one has no other reading."""
    over = np.abs(table) >= OVER_RANGE
    lost = [k for k in range(table.shape[1]) if (over[:, k].all() if k else over[:, k].any())]
    if lost:
        raise CaptureError(
            str(path),
            text("column {number} has no reading but over range; record again in a larger range", number=lost[0] + 1)
            if lost[0]
            else text(
                "the first column contains a value that is neither a time nor an angle (∞, OL); correct or remove the "
                "row"
            ),
            first + 1 + int(np.argmax(over[:, lost[0]])),
        )


def _refuse_doubtful(path: Path, lines: list[str], first: int, delimiter: str | None) -> None:
    """Raise CaptureError for a number that may be thousands or decimals, in a record with commas."""
    if not any("." in line for line in lines[first:]):
        return
    cells = [(place, cell) for place, line in enumerate(lines[first:], first + 1) for cell in line.split(delimiter)]
    doubtful = doubtful_number(cell for _, cell in cells)
    if doubtful is not None:
        raise CaptureError(str(path), doubtful[1], cells[doubtful[0]][0])


def _refuse_decimal_commas(path: Path, lines: list[str], first: int) -> None:
    """Raise CaptureError where commas are between the columns and decimal marks: more cells than headings, no decimal dot."""
    above = next((line for line in reversed(lines[:first]) if line.strip()), "")
    rows = [_cells(line, ",") for line in lines[first : first + 50] if line.strip()]
    headings, most = len(_cells(above, ",")), max(len(row) for row in rows)
    whole = all(_WHOLE.fullmatch(cell) for row in rows for cell in row)
    if headings > 1 and headings < most <= 2 * headings and whole:
        raise CaptureError(
            str(path),
            text(
                "rows have up to {most} numbers under {headings} headings, and no number has a dot: the comma is "
                "used as decimal mark and as separator of the columns. Export again with semicolons or tabs "
                "between the columns, or with decimal dots",
                most=most,
                headings=headings,
            ),
            first + 1,
        )


def _headings(
    before: list[str], width: int, abscissa: str, time_column: str | None
) -> tuple[list[tuple[str, str]], list[Text]]:
    """Return name and unit of each column, and what had to be assumed."""
    rows = [line for line in before if line.strip()]
    rows = [row for row in rows if len(_cells(row, _separator_of_heading(row, width))) == width]
    if not rows:
        names, message = names_without_heading(width, abscissa, time_column)
        return names, [message]
    cells = [_cells(row, _separator_of_heading(row, width)) for row in rows]
    last = cells[-1]
    if len(cells) > 1 and _are_units(last) and not _are_units(cells[-2]):
        return [(name.strip('"'), unit.strip("()[]")) for name, unit in zip(cells[-2], last, strict=True)], []
    return [split_heading(cell) for cell in last], []


def _are_units(cells: list[str]) -> bool:
    """Return whether a row below the names is one of units: most of its cells are known ones, as beside a column in °C or %."""
    named = [cell for cell in cells if cell.strip("()[]- ")]
    known = sum(si(cell.strip("()[]")) is not None for cell in named)
    return bool(named) and 2 * known > len(named)


def _separator_of_heading(row: str, width: int) -> str | None:
    for mark in ("\t", ";", ","):
        if len(_cells(row, mark)) == width:
            return mark
    return None
