"""Lines and numbers of a text file, with the line's number in every complaint."""

import gzip
import zlib
from io import BytesIO
from pathlib import Path
from typing import Protocol

import numpy as np

from bench.captures.capture import CaptureError
from bench.captures.encoding import decoded
from bench.captures.signs import plain_signs
from bench.captures.written_digits import FloatArray
from drivers.interfaces.text import reason_of, text

#: The longest text that is read (bytes), unpacked: a few bytes of gzip may unpack to any length.
LONGEST = 512 * 1024 * 1024


#: A file with more blank lines than this share has one behind each line, and they mean nothing.
_BLANK = 0.4
#: No instrument reads such a value, in whatever unit: files mark a missing reading so.
BEYOND = 1e30
#: A number nearer to zero than this is taken as zero.
NEGLIGIBLE = 1e-100


class Readable(Protocol):
    """A file that is open for reading."""

    def read(self, size: int, /) -> bytes:
        """Return up to `size` bytes."""


def read_lines(path: Path) -> list[str]:
    """Return the lines of a text file, gzip'ed or not, trailing blank ones left out. Raises CaptureError."""
    try:
        with path.open("rb") as file:
            raw = _up_to_longest(path, file)
    except OSError as error:
        raise CaptureError(
            str(path), text("cannot be read: {strerror}; check the path", strerror=reason_of(error))
        ) from error
    if raw[:2] == b"\x1f\x8b":
        try:
            with gzip.GzipFile(fileobj=BytesIO(raw)) as file:
                raw = _up_to_longest(path, file)
        except (OSError, EOFError, zlib.error) as error:
            raise CaptureError(
                str(path), text("is not a whole gzip file ({error}); copy it again", error=error)
            ) from error
    content = decoded(raw)
    if content is None:
        raise CaptureError(
            str(path),
            text("is no text: it contains zero bytes, as where saving was interrupted; export the record again as CSV"),
        )
    # Two carriage returns before the line feed are one end of a line, written twice.
    lines = plain_signs(content.replace("\r\r\n", "\n")).splitlines()
    if sum(not line.strip() for line in lines) > _BLANK * len(lines):
        lines = [line for line in lines if line.strip()]
    while lines and not lines[-1].strip():
        lines.pop()
    if not lines:
        raise CaptureError(str(path), text("is empty; export the record again"))
    return lines


def _up_to_longest(path: Path, file: Readable) -> bytes:
    raw = file.read(LONGEST + 1)
    if len(raw) > LONGEST:
        raise CaptureError(
            str(path), text("holds more than {most} MiB; export a shorter record", most=LONGEST // 2**20)
        )
    return raw


def number(cell: str) -> float | None:
    """Return a cell as a number; None where it is not one."""
    try:
        # Python takes 1_5 for a number.
        return None if "_" in cell else float(cell.strip().strip('"'))
    except ValueError:
        return None


def cells_of(line: str) -> list[str]:
    """Return a line's cells that commas part, without blanks and without empty ones at its end."""
    cells = [cell.strip() for cell in line.split(",")]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells


def read_numbers(
    path: Path,
    lines: list[str],
    first: int,
    columns: tuple[int, ...],
    delimiter: str | None,
    *,
    allowed: float | None = None,
) -> FloatArray:
    """Return the columns (n, k) of the lines from index `first`, ± `allowed` as it stands. Raises CaptureError with the line that has
    no number.
    """
    try:
        table = np.loadtxt(
            lines[first:], delimiter=delimiter, usecols=columns, comments=None, ndmin=2, dtype=np.float64
        )
    except (ValueError, IndexError):
        table = None
    # Blank lines are passed over by the fast reader, and would shift the numbers of lines.
    if table is None or table.shape[0] != len(lines) - first:
        table = np.array([_row(path, line, first + k + 1, columns, delimiter) for k, line in enumerate(lines[first:])])
    # What is left of a subtraction is no reading, and overflows where it divides.
    table[np.abs(table) < NEGLIGIBLE] = 0.0
    bad = np.argwhere(~np.isfinite(table))
    size = np.abs(table)
    beyond = np.argwhere(~((size < BEYOND) | (size == allowed)))
    if beyond.size and not bad.size:
        line = first + 1 + int(beyond[0][0])
        raise CaptureError(
            str(path),
            text(
                "'{content}' contains {value:.3g}, which is not a possible reading; correct or remove the row",
                content=lines[line - 1].strip()[:60],
                value=float(table[tuple(beyond[0])]),
            ),
            line,
        )
    if bad.size:
        line = first + 1 + int(bad[0][0])
        raise CaptureError(
            str(path),
            text(
                "'{content}' contains a value that is not a finite number; remove the row or record again",
                content=lines[line - 1].strip()[:60],
            ),
            line,
        )
    return np.asarray(table, dtype=np.float64)


def _row(path: Path, line: str, at: int, columns: tuple[int, ...], delimiter: str | None) -> list[float]:
    cells = line.split(delimiter)
    row = []
    for c in columns:
        value = number(cells[c]) if c < len(cells) else None
        if value is None:
            raise CaptureError(
                str(path),
                text(
                    "'{content}' is not a row of {count} numbers like the others; correct or remove it (column {column}: '{cell}')",
                    content=line.strip()[:60],
                    count=len(columns),
                    column=c + 1,
                    cell=cells[c].strip()[:30] if c < len(cells) else "",
                ),
                at,
            )
        row.append(value)
    return row


def check_increasing(path: Path, time: FloatArray, first: int) -> None:
    """Raise CaptureError where the time column (line index `first` its first) does not increase."""
    back = np.flatnonzero(np.diff(time) <= 0)
    if back.size:
        line = first + 2 + int(back[0])
        if time[back[0]] == time[back[0] + 1]:
            raise CaptureError(
                str(path),
                text(
                    "the time {time:.12g} s stands in two rows, as where times are written with too few digits: export them with more",
                    time=time[back[0]],
                ),
                line,
            )
        raise CaptureError(
            str(path),
            text(
                "time does not increase ({time:g} s, then {following:g} s); sort or export again",
                time=time[back[0]],
                following=time[back[0] + 1],
            ),
            line,
        )
