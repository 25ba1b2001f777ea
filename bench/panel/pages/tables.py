"""Tables as HTML whose every cell is escaped."""

from collections.abc import Iterable, Sequence
from html import escape


def html_table(head: Sequence[str], lines: Iterable[Sequence[str]], *, numeric: frozenset[int] = frozenset()) -> str:
    """Return a table; columns of `numeric` stand to the right."""
    cells = "".join(
        f'<th scope="col"{" class=num" if n in numeric else ""}>{escape(title)}</th>' for n, title in enumerate(head)
    )
    body = "".join(
        "<tr>"
        + "".join(f"<td{' class=num' if n in numeric else ''}>{escape(cell)}</td>" for n, cell in enumerate(line))
        + "</tr>"
        for line in lines
    )
    return f'<table class="mb-table"><thead><tr>{cells}</tr></thead><tbody>{body}</tbody></table>'
