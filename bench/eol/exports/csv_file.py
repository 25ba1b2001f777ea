"""CSV: UTF-8, one row a figure, and no cell that a spreadsheet takes for a formula."""

import csv
from collections.abc import Iterable
from datetime import datetime
from typing import IO, Any

from bench.eol.exports.rows import FIGURE_COLUMNS, MOTOR_COLUMNS, rows
from bench.eol.record import MotorRecord

#: What spreadsheets take for a formula's beginning (OWASP, CSV injection), some of them also where it is full-width, as input methods
#: for Chinese send it. An apostrophe before it makes it text.
_FORMULA = (*"=+-@＝＋－＠", "\t", "\r", "\n", "'")


def write_csv(records: Iterable[MotorRecord], file: IO[bytes]) -> int:
    """Write records; return how many."""
    # Written by hand instead of TextIOWrapper, which would close the file with itself.
    writer = csv.writer(_Encoded(file), lineterminator="\r\n")
    columns = (*MOTOR_COLUMNS, *FIGURE_COLUMNS)
    writer.writerow(columns)
    count = 0
    for record in records:
        writer.writerows([_cell(row[name]) for name in columns] for row in rows(record))
        count += 1
    return count


def harmless(words: str) -> str:
    """Return words that no spreadsheet takes for a formula; without the first apostrophe they are as they were."""
    return f"'{words}" if words.startswith(_FORMULA) else words


class _Encoded:
    def __init__(self, file: IO[bytes]) -> None:
        self._file = file

    def write(self, words: str) -> int:
        return self._file.write(words.encode("utf-8"))


def _cell(value: Any) -> Any:
    if isinstance(value, str):
        return harmless(value)
    if isinstance(value, datetime):
        return value.isoformat()
    if isinstance(value, bool):
        return str(value).lower()
    return repr(value) if isinstance(value, float) else value
