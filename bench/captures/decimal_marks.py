"""Numbers as "1.000" in a file whose decimal mark is a comma: a thousand or one, the file does not say."""

import re
from collections.abc import Iterable

from drivers.interfaces.text import Text, text

#: One mark with three digits behind it: thousands are written so, and decimals.
_GROUPED = re.compile(r"[+-]?[1-9]\d{0,2}([.,])\d{3}")
_NUMBER = re.compile(r"[+-]?\d*[.,]?\d*(?:[eE][+-]?\d+)?")


def doubtful_number(cells: Iterable[str], *, comma_between: bool = False) -> tuple[int, Text] | None:
    """Return the place of the first cell that may be thousands or decimals, and what to do about it; None where there is none.

    Such a cell is one as "1.000" where another number of the file has the other mark, or "1,000" in a file whose cells commas divide.
    """
    doubtful: dict[str, tuple[int, str]] = {}
    shown: dict[str, str] = {",": "", ".": ""}
    for place, cell in enumerate(cells):
        written = cell.strip().strip('"')
        if not any(mark in written for mark in shown) or not _NUMBER.fullmatch(written):
            continue
        mark = "," if "," in written else "."
        shown[mark] = shown[mark] or written
        if _GROUPED.fullmatch(written):
            doubtful.setdefault(mark, (place, written))
    for mark, other in ((".", ","), (",", ".")):
        if mark in doubtful and (shown[other] or (comma_between and mark == ",")):
            place, written = doubtful[mark]
            whole = re.sub("[.,]", "", written)
            if shown[other]:
                return place, text(
                    "'{cell}' may mean {whole} or {decimal}, because another number of the file, '{other}', uses "
                    "the other mark. Use one mark for all decimals, and no mark for thousands",
                    cell=written,
                    whole=whole,
                    decimal=f"{float(written.replace(',', '.')):g}",
                    other=shown[other],
                )
            return place, text(
                "'{cell}' may mean {whole} or {decimal}. Write thousands without a mark; if commas separate the "
                "columns, write decimals with a dot",
                cell=written,
                whole=whole,
                decimal=f"{float(written.replace(',', '.')):g}",
            )
    return None
