"""Finds the heading in a table that others wrote: above it may stand a title, the time of the test, or names with values."""

import csv
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from bench.captures.text import number
from bench.i18n.errors import InputError, at
from drivers.interfaces.text import text

#: What parts the cells of a row.
_MARKS = ("\t", ";", ",", " ")
#: A heading stands among so many rows, and so many rows tell how wide the table is.
_FIRST, _ROWS = 30, 200


def heading_of(lines: Sequence[str]) -> tuple[int, str]:
    """Return the place of the heading in two or more lines, and the mark between its cells.

    The heading is the first row without a number that is as wide as most rows are; without one it is the first line.
    """
    found = [(place, _MARKS.index(mark)) for mark in _MARKS if (place := _place(lines, mark)) is not None]
    if found:
        place, mark = min(found)
        return place, _MARKS[mark]
    return 0, next((mark for mark in _MARKS if mark in lines[0]), " ")


def refuse_open_quotation(path: Path, rows: Sequence[Sequence[str]], lines: Sequence[int]) -> None:
    """Raise InputError with the line whose quotation mark is not closed, so that its last cell holds all rows below."""
    within = sum(cell.count("\n") for cell in rows[-1])
    if within:
        raise InputError(
            at(
                str(path),
                text(
                    "line {line}: a quotation mark is not closed; remove it, or close it in the same cell",
                    line=lines[-1 - within],
                ),
            )
        )


def _place(lines: Sequence[str], mark: str) -> int | None:
    rows = [
        [cell.strip() for cell in row]
        for row in csv.reader((line.strip() if mark == " " else line for line in lines[:_ROWS]), delimiter=mark, skipinitialspace=True)
    ]  # fmt: skip
    widths = Counter(len(row) for row in rows[1:])
    # A quotation mark that is not closed makes one row of all that follow.
    if not widths or widths.most_common(1)[0][0] < 2:
        return None
    width = widths.most_common(1)[0][0]
    return next((k for k, row in enumerate(rows[:_FIRST]) if len(row) >= width and _names(row)), None)


def _names(row: Sequence[str]) -> bool:
    """Return whether a row's cells may be names: two or more, and none a number."""
    return sum(bool(cell) for cell in row) > 1 and all(number(cell.replace(",", ".")) is None for cell in row)
