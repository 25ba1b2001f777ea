"""Plain tables without a heading: what the columns are called, and whether one of them is the heading after all, behind a `#`."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from bench.captures.capture import CaptureChannel, CaptureError
from bench.captures.text import number
from bench.captures.units import si, split_heading
from drivers.interfaces.text import Text, text

_COMMENTS = ("#", "%")
#: So many rows of names and units may stand behind a comment mark.
_MOST = 2
#: What a first column without a heading is taken for.
_ABSCISSAE = {"time": ("s", text("time")), "angle": ("rad", text("angle")), "current": ("A", text("current"))}


def without_comments(lines: Sequence[str]) -> list[str]:
    """Return the lines, blank where they are comments; those right above a first row of numbers that name its columns are kept."""
    plain = ["" if line.lstrip().startswith(_COMMENTS) else line for line in lines]
    first = next((k for k, line in enumerate(plain) if line.strip()), len(plain))
    above = [k for k in range(first) if lines[k].strip()]
    for k in reversed(above[-_MOST:]):
        bare = lines[k].lstrip().lstrip("".join(_COMMENTS)).strip()
        if first == len(plain) or not _names(bare, plain[first]):
            break
        plain[k] = bare
    return plain


def _names(words: str, row: str) -> bool:
    """Return whether words are as many names as there are numbers in a row, and no remark that happens to have as many commas."""
    mark = next((each for each in ("\t", ";", ",") if each in row and each in words), None)
    names, cells = words.split(mark), row.strip().rstrip("\t;,").split(mark)
    held = [number(cell if mark == "," else cell.replace(",", ".")) is not None for cell in cells]
    if not len(names) == len(cells) > 1 or not all(held) or any(number(name) is not None for name in names):
        return False
    united = any(si(split_heading(name)[1]) is not None for name in names)
    return united or all(len(name.split()) == 1 for name in names)


def names_without_heading(width: int, abscissa: str, time_column: str | None) -> tuple[list[tuple[str, str]], Text]:
    """Return name and unit of each column, and what had to be assumed."""
    numbered = [(f"column {k + 1}", "") for k in range(width)]
    if time_column is not None:
        return numbered, text("no heading: all values but the times are used unchanged")
    unit, said = _ABSCISSAE[abscissa]
    return [(abscissa, unit), *numbered[1:]], text(
        "no heading: the first column is taken as {abscissa} in {unit}, the other values are used unchanged",
        abscissa=said,
        unit=unit,
    )


def refuse_another_time(path: Path, columns: Sequence[CaptureChannel], first: int) -> None:
    """Raise CaptureError where the first column, which no heading calls a time, does not increase, and others do."""
    rising = [k + 1 for k, column in enumerate(columns) if np.all(np.diff(column.values) > 0.0)]
    if rising and rising[0] > 1:
        back = int(np.flatnonzero(np.diff(columns[0].values) <= 0.0)[0])
        raise CaptureError(
            str(path),
            text(
                "there is no heading, and the first column is no time: {value:.9g} is followed by {following:.9g}. What increases "
                "is column {columns}: type --time-column {column} if that is the time, and --time-unit",
                value=columns[0].values[back],
                following=columns[0].values[back + 1],
                columns=[str(k) for k in rising],
                column=rising[0],
            ),
            first + 2 + back,
        )
