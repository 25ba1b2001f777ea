"""Columns of a table that hold no number at all: remarks, the operator's name, what a spreadsheet left empty."""

from bench.captures.cell_units import has_units
from bench.captures.marks import over_range_marked
from bench.captures.text import number


def without_text_columns(lines: list[str], first: int, delimiter: str | None) -> tuple[list[str], list[str]]:
    """Return the lines without headed columns that hold no number from row `first` on, and these columns' headings.

    The row above `first` that has as many cells as the widest row is the heading; without one, nothing is left out.
    """
    if delimiter is None:
        return lines, []
    above = [_split(line, delimiter) for line in lines[:first] if line.strip()]
    shown = _split(lines[first], delimiter)
    width = len(above[-1]) if above else 0
    if width < len(shown) or all(_holds(cell, delimiter) for cell in (*shown, *[""] * (width - len(shown)))):
        return lines, []
    rows = [_split(line, delimiter) for line in lines[first:]]
    left_out = [k for k in range(width) if not any(_holds(row[k], delimiter) for row in rows if k < len(row))]
    if not left_out:
        return lines, []
    kept = [
        delimiter.join(cell for k, cell in enumerate(cells) if k not in left_out) if len(cells) > left_out[0] else line
        for line, cells in ((line, _split(line, delimiter)) for line in lines)
    ]
    headings = next(cells for cells in above if len(cells) == width)
    return kept, [headings[k].strip() or str(k + 1) for k in left_out]


def _split(line: str, delimiter: str) -> list[str]:
    return [cell.strip().strip('"').strip() for cell in line.split(delimiter)]


def _holds(cell: str, delimiter: str) -> bool:
    """Return whether a cell holds a reading: a number, one with its unit, or a mark of over range."""
    marked = over_range_marked([cell], 0)[0]
    bare = marked if delimiter == "," else marked.replace(",", ".")
    return number(bare) is not None or (bool(cell) and has_units([cell]))
