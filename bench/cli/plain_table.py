"""Tables that commands print for people."""

from typing import TYPE_CHECKING, Literal

from drivers.interfaces.text import Text, Translate

if TYPE_CHECKING:
    from rich.table import Table


def plain_table(translate: Translate, *headings: Text, left: int = 1) -> "Table":
    """Return an empty table with these headings, the first `left` of them to the left."""
    from rich import box
    from rich.table import Table

    table = Table(box=box.SIMPLE_HEAD, pad_edge=False, padding=(0, 1))
    for n, heading in enumerate(headings):
        justify: Literal["left", "right"] = "left" if n < left else "right"
        table.add_column(
            heading.render(translate), justify=justify, no_wrap=n > 0, overflow="ellipsis" if n else "fold"
        )
    return table
