"""CSV of Siglent SDS scopes: settings by name, the channels' names in "Source", then "Second" and rows of time and values.

Sources: exports of an SDS1104X-E as MartinCowen/SigFyCSV documents them (six lines of settings, or "Source" alone); the heading that
an SDS1104X-U's own export has, as third parties' programs read and write it ("Vertical Units" and "Source" of several channels). The
maker's manuals do not print the layout.
"""

from pathlib import Path

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.text import cells_of, check_increasing, number, read_numbers
from bench.captures.units import si
from drivers.interfaces.text import text

#: Lines within which the heading ends.
_HEADING = 40


def is_siglent(lines: list[str]) -> bool:
    """Tell whether a heading ends in the maker's row of units, which names the time's first."""
    first = cells_of(lines[0])[0]
    return (first.endswith("Record Length") or first == "Source") and _units_row(lines) is not None


def read_siglent(path: Path, lines: list[str]) -> Capture:
    """Return the capture; the record length stated is not always the file's. Raises CaptureError."""
    row = _units_row(lines) or 0
    units = cells_of(lines[row])[1:]
    settings = {cells[0]: cells[1:] for cells in map(cells_of, lines[:row])}
    settings["Record Length"] = next((said for name, said in settings.items() if name.endswith("Record Length")), [""])
    names = _names(settings, len(units))
    body = [line.rstrip().rstrip(",") for line in lines]
    if len(lines) - row < 3:
        raise CaptureError(
            str(path), text("holds a heading and fewer than two samples; export the record again"), len(lines)
        )
    table = read_numbers(path, body, row + 1, tuple(range(1 + len(units))), ",")
    check_increasing(path, table[:, 0], row + 1)
    # "CH1:V" of each channel, where the rows' heading says no more than "Value".
    said = dict(cell.split(":", 1) for cell in settings.get("Vertical Units", []) if ":" in cell)
    channels = []
    for k, (name, unit) in enumerate(zip(names, units, strict=True), start=1):
        written = said.get(name, "") if unit == "Value" else unit
        known, factor = si(written) or (written, 1.0)
        values = table[:, k] * factor
        channels.append(CaptureChannel.written(name, known, values))
    model = settings.get("Model Number", [""])[0]
    stated = number(settings.get("Record Length", [""])[0].removeprefix("Analog:"))
    assumptions = [text("values used unchanged; they include the oscilloscope's probe setting")]
    if stated is not None and int(stated) != len(table):
        assumptions.append(
            text(
                "the heading states {stated} samples, but the file contains {held}; the samples in the file are used",
                stated=int(stated),
                held=len(table),
            )
        )
    if not all(channel.unit for channel in channels):
        assumptions.append(text("unit of the values not stated"))
    return Capture(
        tuple(channels),
        table[:, 0],
        str(path),
        f"Siglent CSV{f' of an {model}' if model else ''}",
        tuple(assumptions),
        first_line=row + 2,
    )


def _units_row(lines: list[str]) -> int | None:
    """Return the index of the row that names the columns' units."""
    for at, line in enumerate(lines[:_HEADING]):
        cells = cells_of(line)
        if cells[0] == "Second" and len(cells) > 1:
            return at
    return None


def _names(settings: dict[str, list[str]], count: int) -> list[str]:
    """Return the channels' names, by "Source", or by what another setting says of each, as "CH1: 0.05"."""
    if len(settings.get("Source", [])) == count:
        return settings["Source"]
    for cells in settings.values():
        names = [cell.partition(":")[0].strip() for cell in cells if ":" in cell and not cell.startswith("Analog")]
        if len(names) == count:
            return names
    return [f"CH{k + 1}" for k in range(count)]
