"""CSV of Rohde & Schwarz RTB/RTM scopes: heading "in s,C1 in V,…", then rows of time and values."""

import re
from pathlib import Path

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.text import check_increasing, read_numbers
from bench.captures.units import si, split_heading
from drivers.interfaces.text import text

_HEADING = re.compile(r"\s*(?:time\s+)?in s\s*,\s*[^,]+ in \S+", re.IGNORECASE)


def is_rohde_schwarz(lines: list[str]) -> bool:
    """Tell whether the first line is the maker's heading."""
    return bool(_HEADING.match(lines[0]))


def read_rohde_schwarz(path: Path, lines: list[str]) -> Capture:
    """Return the capture. Raises CaptureError where a row is broken or the time does not increase."""
    headings = [split_heading(cell) for cell in lines[0].rstrip(",").split(",")]
    if len(lines) < 3:
        raise CaptureError(
            str(path), text("holds a heading and fewer than two samples; export the record again"), len(lines)
        )
    table = read_numbers(path, lines, 1, tuple(range(len(headings))), ",")
    check_increasing(path, table[:, 0], 1)
    channels = []
    for k, (name, unit) in enumerate(headings[1:], start=1):
        known, factor = si(unit) or (unit, 1.0)
        values = table[:, k] * factor
        channels.append(CaptureChannel.written(name, known, values))
    return Capture(tuple(channels), table[:, 0], str(path), "Rohde & Schwarz CSV", first_line=2)
