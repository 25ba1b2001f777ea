"""CSV of Rigol scopes that numbers its samples: the time stands in the heading, as its start and its increment (one kind of source: users).

Sources: exports of the series DS1000Z ("X,CH1,Start,Increment", then "Sequence,Volt" with both numbers) and MSO5000 ("CH1V,CH2V,t0 = …,
tInc = …", no column of time), as their users post them; the maker's manuals do not print the layout. Files with a column of time are
plain tables.
"""

import re
from pathlib import Path

import numpy as np

from bench.captures.capture import Capture, CaptureChannel, CaptureError
from bench.captures.text import cells_of, number, read_numbers
from bench.captures.units import si
from drivers.interfaces.text import text

_NUMBER = r"([+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?)"
_START, _STEP = (
    re.compile(rf"\bt0\s*=\s*{_NUMBER}", re.IGNORECASE),
    re.compile(rf"\btInc\s*=\s*{_NUMBER}", re.IGNORECASE),
)
_CHANNEL = re.compile(r"(CH\d+|MATH\d*|D\d+(?:-D\d+)?)\s*\(?([a-zA-Z]*)\)?", re.IGNORECASE)


def is_rigol(lines: list[str]) -> bool:
    """Tell whether the heading states start and increment of the time, and the rows hold no time."""
    first, second = cells_of(lines[0]), cells_of(lines[1]) if len(lines) > 1 else []
    if first[0].upper() == "X" and second[:1] == ["Sequence"]:
        return True
    return _CHANNEL.fullmatch(first[0]) is not None and _STEP.search(lines[0]) is not None


def read_rigol(path: Path, lines: list[str]) -> Capture:
    """Return the capture, its time made of start and increment. Raises CaptureError where the heading does not state them."""
    numbered = cells_of(lines[0])[0].upper() == "X"
    heading = 2 if numbered else 1
    headings = _numbered(lines) if numbered else _unnumbered(lines)
    start, step, channels = headings
    if start is None or step is None or not step > 0.0 or not channels:
        raise CaptureError(
            str(path),
            text(
                "numbers its samples, and its heading does not state where the time begins and how far apart the samples are; export it "
                "with a column of time"
            ),
            heading,
        )
    body = [line.rstrip().rstrip(",") for line in lines]
    if len(lines) - heading < 2:
        raise CaptureError(
            str(path), text("holds a heading and fewer than two samples; export the record again"), len(lines)
        )
    table = read_numbers(path, body, heading, tuple(range(len(channels) + numbered)), ",")
    index = table[:, 0] if numbered else np.arange(len(table), dtype=np.float64)
    missing = np.flatnonzero(np.diff(index) != 1.0)
    if missing.size:
        raise CaptureError(
            str(path),
            text(
                "sample {number:.0f} is followed by {following:.0f}; export the record whole",
                number=index[missing[0]],
                following=index[missing[0] + 1],
            ),
            heading + 2 + int(missing[0]),
        )
    made = []
    for k, (name, unit) in enumerate(channels):
        known, factor = si(unit) or (unit, 1.0)
        values = table[:, k + numbered] * factor
        made.append(CaptureChannel.written(name, known, values))
    assumptions = [text("values used unchanged; they include the oscilloscope's probe setting")]
    if not all(channel.unit for channel in made):
        assumptions.append(text("unit of the values not stated"))
    return Capture(
        tuple(made), start + step * index, str(path), "Rigol CSV", tuple(assumptions), first_line=heading + 1
    )


_Heading = tuple[float | None, float | None, list[tuple[str, str]]]


def _numbered(lines: list[str]) -> _Heading:
    """Return start, increment, and the channels with their units, of a heading in two rows."""
    names, below = cells_of(lines[0]), cells_of(lines[1])
    said = {name.lower(): cell for name, cell in zip(names, below, strict=False)}
    channels = [
        (name, unit)
        for name, unit in list(zip(names, below, strict=False))[1:]
        if name.lower() not in ("start", "increment")
    ]
    return number(said.get("start", "")), number(said.get("increment", "")), channels


def _unnumbered(lines: list[str]) -> _Heading:
    """Return start, increment, and the channels with their units, of a heading in one row."""
    start, step = _START.search(lines[0]), _STEP.search(lines[0])
    said = [_CHANNEL.fullmatch(cell) for cell in cells_of(lines[0])]
    channels = [(match[1], match[2]) for match in said if match]
    return float(start[1]) if start else None, float(step[1]) if step else None, channels
