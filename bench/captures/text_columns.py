"""Columns of a table that are no readings: remarks, the operator's name, results beside the first rows, what a spreadsheet left empty."""

from bench.captures.cell_units import has_units
from bench.captures.marks import over_range_marked
from bench.captures.text import number

#: Numbers in fewer than one of so many rows, and blanks in all others, are results beside a table.
_SPARSE = 10


def without_text_columns(lines: list[str], first: int, delimiter: str | None) -> tuple[list[str], dict[str, int]]:
    """Return the lines without headed columns that hold no number from row `first` on, or numbers in a few rows and blanks in the others;
    and these columns' headings, with how many numbers they hold.

    The row above `first` that has as many cells as the widest row is the heading; without one, nothing is left out.
    """
    if delimiter is None:
        return lines, {}
    above = [_split(line, delimiter) for line in lines[:first] if line.strip()]
    width = len(above[-1]) if above else 0
    shown = [_split(line, delimiter) for line in lines[first : first + 2]]
    full = (all(_holds(row[k], delimiter) if k < len(row) else False for k in range(width)) for row in shown)
    if width < len(shown[0]) or all(full):
        return lines, {}
    rows = [_split(line, delimiter) for line in lines[first:] if line.strip()]
    held = {k: sum(_holds(row[k], delimiter) for row in rows if k < len(row)) for k in range(width)}
    left_out = [
        k
        for k, count in held.items()
        if not count or (k and _SPARSE * count < len(rows) and _blank(rows, k) == len(rows) - count)
    ]
    if not left_out:
        return lines, {}
    kept = [
        delimiter.join(cell for k, cell in enumerate(cells) if k not in left_out) if len(cells) > left_out[0] else line
        for line, cells in ((line, _split(line, delimiter)) for line in lines)
    ]
    headings = next(cells for cells in above if len(cells) == width)
    return kept, {headings[k].strip() or str(k + 1): held[k] for k in left_out}


def _blank(rows: list[list[str]], k: int) -> int:
    return sum(k >= len(row) or not row[k] for row in rows)


def _split(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def _holds(cell: str, delimiter: str) -> bool:
    """Return whether a cell holds a reading: a number, one with its unit, or a mark of over range."""
    marked = over_range_marked([cell], 0)[0]
    bare = marked if delimiter == "," else marked.replace(",", ".")
    return number(bare) is not None or (bool(cell) and has_units([cell]))
