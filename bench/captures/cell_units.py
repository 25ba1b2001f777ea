"""Units that stand behind each value of a table ("-800.0us,1.2V"), as some oscilloscopes write them."""

import re
from decimal import Decimal
from pathlib import Path

from bench.captures.capture import CaptureError
from bench.captures.text import number
from bench.captures.units import si
from drivers.interfaces.text import text

_QUANTITY = re.compile(r'"?\s*([+-]?(?:\d+[.,]?\d*|[.,]\d+)(?:[eE][+-]?\d+)?)\s*([^\W\d_].*|[°%].*)')


def _split(cell: str) -> tuple[str, str] | None:
    """Return number and unit of a cell; None where it is not both."""
    match = _QUANTITY.fullmatch(cell.strip())
    unit = match[2].strip().strip('"').strip() if match else ""
    return (match[1].replace(",", "."), unit) if match and si(unit) else None


def has_units(cells: list[str]) -> bool:
    """Tell whether a row consists of numbers, at least one of them with a unit."""
    split = [_split(cell) for cell in cells]
    return any(split) and all(
        each is not None or number(cell.replace(",", ".")) is not None for each, cell in zip(split, cells, strict=True)
    )


def without_units(path: Path, lines: list[str], first: int, delimiter: str | None) -> tuple[list[str], dict[int, str]]:
    """Return the lines with plain numbers from index `first` on, and the unit of each column (by its index) whose values had one.

    A value in another prefix than the column's first is converted. Raises CaptureError naming line and column for a value without a
    unit among others with one, or of another quantity.
    """
    shown = [_split(cell) for cell in lines[first].split(delimiter)]
    units = {k: each[1] for k, each in enumerate(shown) if each is not None}
    join = "\t" if delimiter is None else delimiter
    return [
        *lines[:first],
        *(
            join.join(_plain(path, cell, at, k, units) for k, cell in enumerate(line.split(delimiter)))
            for at, line in enumerate(lines[first:], first + 1)
        ),
    ], units


def _plain(path: Path, cell: str, line: int, column: int, units: dict[int, str]) -> str:
    unit = units.get(column)
    split = _split(cell)
    if unit is None and split is None:
        return cell
    bare = number(cell.replace(",", "."))
    if unit is not None and split is None:
        if bare is None or bare == 0.0:
            return cell
        raise CaptureError(
            str(path),
            text(
                "column {column}: '{cell}' has no unit, but the values above it are in {unit}; write it with its unit",
                column=column + 1,
                cell=cell.strip()[:30],
                unit=unit,
            ),
            line,
        )
    given = si(split[1]) if split else None
    wanted = si(unit) if unit else None
    if split is None or given is None or wanted is None or given[0] != wanted[0]:
        raise CaptureError(
            str(path),
            text(
                "column {column}: '{cell}' is in another unit than the values above it ({unit}); correct or remove the row",
                column=column + 1,
                cell=cell.strip()[:30],
                unit=unit or "1",
            ),
            line,
        )
    if given[1] == wanted[1]:
        return split[0]
    return str(Decimal(split[0]) * Decimal(repr(given[1])) / Decimal(repr(wanted[1])))
