"""CSV: one parameter a row, SI units."""

import csv
import io
import math

from reports.exports.target import Sheet, Target

COLUMNS = (
    "motor",
    "serial_number",
    "run",
    "parameter",
    "value",
    "unit",
    "standard_uncertainty",
    "low_95",
    "high_95",
    "degrees_of_freedom",
    "convention",
    "procedure",
    "section",
    "source",
)


def write(sheet: Sheet) -> str:
    """Return a heading and the rows, separated by commas, lines ended as RFC 4180 has it."""
    subject = sheet.subject
    stream = io.StringIO()
    writer = csv.writer(stream)
    writer.writerow(COLUMNS)
    for name, parameter in subject.parameters.items():
        low, high = parameter.coverage_interval
        writer.writerow(
            (
                _cell(subject.motor),
                _cell(subject.serial_number),
                _cell(subject.run),
                name,
                _number(parameter.value),
                parameter.unit,
                *(_number(v) for v in (parameter.standard_uncertainty, low, high, parameter.degrees_of_freedom)),
                parameter.convention,
                parameter.procedure,
                parameter.section,
                parameter.source,
            )
        )
    return stream.getvalue().encode("utf-8", "backslashreplace").decode("utf-8")


def _number(value: float) -> str:
    return f"{value:.12g}" if math.isfinite(value) else ""


def _cell(words: str) -> str:
    """Return words that no spreadsheet takes for a formula."""
    return f"'{words}" if words[:1] in ("=", "+", "-", "@", "\t", "\r") else words


TARGET = Target("csv", "CSV", ".csv", (), write)
