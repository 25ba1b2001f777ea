"""CSV of Yokogawa DLM scopes: settings by name in quotation marks, then rows of values, the time stated as resolution and offset.

Sources: IM DLM3054-01EN, appendix 3 (the names; X = HResolution × (number − 1) + HOffset); a third party's reader of a DLM4000's files
(an empty first cell in the rows of values, a blank line before them).
"""

from pathlib import Path

import numpy as np

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.text import number, read_numbers
from bench.captures.units import si
from drivers.interfaces.text import text

#: Lines within which the heading ends.
_HEADING = 40
#: How far the traces' resolutions may differ, relative to one another.
_SAME = 1e-6


def is_yokogawa(lines: list[str]) -> bool:
    """Tell whether the heading has the maker's names for the traces and their blocks."""
    return {"TraceName", "BlockSize"} <= {_cells(line)[0] for line in lines[:_HEADING]}


def read_yokogawa(path: Path, lines: list[str]) -> Capture:
    """Return the capture, its time made of resolution and offset. Raises CaptureError for several blocks, and another axis than time."""
    settings, first = _heading(lines)
    names = [name for name in settings["TraceName"] if name]
    steps, offsets = (_numbers(settings.get(key, []), len(names)) for key in ("HResolution", "HOffset"))
    units = {unit.lower() for unit in settings.get("HUnit", []) if unit}
    if not names or steps is None or offsets is None or not steps[0] > 0.0 or not units <= {"s"}:
        raise CaptureError(
            str(path),
            text(
                "a Yokogawa heading, but without TraceName, HResolution and HOffset in s for each trace: the time is not known from it; "
                "export the waveform with its time, as a table with a column of time"
            ),
            first,
        )
    if np.ptp(steps) > _SAME * steps[0] or np.ptp(offsets) > _SAME * steps[0]:
        raise CaptureError(
            str(path), text("the traces have different HResolution or HOffset; export traces of one time base"), first
        )
    blocks = _numbers(settings.get("BlockNumber", []), 1)
    if blocks is not None and blocks[0] > 1.0:
        raise CaptureError(
            str(path), text("holds {count:.0f} blocks of the history; export one of them", count=blocks[0]), first
        )
    if len(lines) - first < 2:
        raise CaptureError(
            str(path), text("holds a heading and fewer than two samples; export the record again"), len(lines)
        )
    body = [line.rstrip().rstrip(",") for line in lines]
    # An empty cell or the time stands before the values.
    before = max(0, len(body[first].split(",")) - len(names))
    table = read_numbers(path, body, first, tuple(range(before, before + len(names))), ",")
    assumptions = [text("values used unchanged; they include the oscilloscope's probe setting")]
    stated = _numbers(settings["BlockSize"], 1)
    if stated is not None and int(stated[0]) != len(table):
        assumptions.append(
            text(
                "the heading states {stated} samples, but the file contains {held}; the samples in the file are used",
                stated=int(stated[0]),
                held=len(table),
            )
        )
    written = [*settings.get("VUnit", []), *([""] * len(names))]
    channels = []
    for k, name in enumerate(names):
        known, factor = si(written[k]) or (written[k], 1.0)
        values = table[:, k] * factor
        channels.append(CaptureChannel.written(name, known, values))
    if not all(channel.unit for channel in channels):
        assumptions.append(text("unit of the values not stated"))
    model = next(iter(settings.get("Model Name", [])), "")
    return Capture(
        tuple(channels),
        offsets[0] + steps[0] * np.arange(len(table), dtype=np.float64),
        str(path),
        f"Yokogawa CSV{f' of a {model}' if model else ''}",
        tuple(assumptions),
        first_line=first + 1,
    )


def _heading(lines: list[str]) -> tuple[dict[str, list[str]], int]:
    """Return the settings by name, and the index of the first row of values."""
    settings: dict[str, list[str]] = {}
    for at, line in enumerate(lines):
        cells = _cells(line)
        if any(cells) and (not cells[0] or number(cells[0]) is not None):
            return settings, at
        if cells[0]:
            settings[cells[0]] = cells[1:]
    return settings, len(lines)


def _numbers(cells: list[str], count: int) -> list[float] | None:
    """Return so many numbers, None where they are not there."""
    found = [number(cell) for cell in cells[:count]]
    known = [value for value in found if value is not None]
    return known if known and len(known) == count else None


def _cells(line: str) -> list[str]:
    cells = [cell.strip().strip('"').strip() for cell in line.split(",")]
    while len(cells) > 1 and not cells[-1]:
        cells.pop()
    return cells
