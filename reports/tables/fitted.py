"""Tables for terminals of any width: where it is narrow fewer columns, never fewer digits."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import repeat
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.table import Table


@dataclass(frozen=True)
class FittedColumn:
    """A column of a table.

    Where the terminal is narrow, the one with the smallest `leaves` goes first; 0 stays. The text of one that `breaks` may be
    broken into lines of so many columns of the terminal; 0 stays on one line.
    """

    heading: str
    leaves: int = 0
    right: bool = False
    breaks: int = 0
    footer: str = ""


def fitted(
    columns: Sequence[FittedColumn], rows: Sequence[Sequence[str]], width: int, styles: Sequence[str | None] = ()
) -> "Table":
    """Return a table of those columns that `width` columns of a terminal hold; a style for each row, or none."""
    kept = list(range(len(columns)))
    while True:
        result = _of([columns[k] for k in kept], [[row[k] for k in kept] for row in rows], styles)
        goes = min((columns[k].leaves for k in kept if columns[k].leaves), default=0)
        if not goes or _needed(result, [columns[k] for k in kept]) <= width:
            return result
        kept = [k for k in kept if columns[k].leaves != goes]


def _of(columns: Sequence[FittedColumn], rows: Sequence[Sequence[str]], styles: Sequence[str | None]) -> "Table":
    from rich import box
    from rich.table import Table

    footer = any(column.footer for column in columns)
    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1), show_footer=footer)
    for column in columns:
        table.add_column(
            column.heading,
            footer=column.footer,
            justify="right" if column.right else "left",
            no_wrap=not column.breaks,
            # What a terminal of a few columns cuts must look cut.
            overflow="fold" if column.breaks else "ellipsis",
        )
    for cells, style in zip(rows, styles or repeat(None), strict=False):
        table.add_row(*cells, style=style)
    return table


def _needed(made: "Table", columns: Sequence[FittedColumn]) -> int:
    """Return the least width (columns of a terminal) in which nothing is broken that may not be."""
    from rich.console import Console
    from rich.measure import Measurement

    console = Console(width=10_000)
    natural = Measurement.get(console, console.options, made).maximum
    for column, drawn in zip(columns, made.columns, strict=True):
        if column.breaks:
            widths = (Measurement.get(console, console.options, cell).maximum for cell in drawn.cells)
            widest = max(widths, default=0)
            natural -= max(widest - column.breaks, 0)
    return natural
