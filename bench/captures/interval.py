"""The sampling interval that a file's heading states, held against its column of time."""

import re
from collections.abc import Iterator

from bench.captures.capture import Capture, CaptureError
from drivers.interfaces.text import text

#: Lines in which a heading says such a thing.
_HEADING = 40
_NUMBER = r"[+-]?\d+(?:\.\d*)?(?:[eE][+-]?\d+)?"
_SAID = re.compile(
    r"\b(?:(?P<interval>sampl\w*[ _-]*(?:interval|period|time)|(?:x|time|horizontal)[ _-]*increment|time[ _-]*step)"
    r"|sampl\w*[ _-]*(?:rate|frequency))\b"
    rf"(?P<between>[^\d+\n-]{{0,12}}?)(?P<number>{_NUMBER})\s*(?P<after>[a-zA-Zµμ]*)",
    re.IGNORECASE,
)
_BRACKETS = re.compile(r"[\[(]\s*([a-zA-Zµμ]+)[^\])]*[\])]")
_SECONDS = {"": 1.0, "s": 1.0, "sec": 1.0, "ms": 1e-3, "us": 1e-6, "µs": 1e-6, "μs": 1e-6, "ns": 1e-9}
_PREFIXES = {"k": 1e3, "m": 1e6, "g": 1e9}
#: Off by a power of a thousand, to this share: a unit's error, not an interval of another record.
_POWERS, _WITHIN = (1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e9), 0.1


def check_interval(lines: list[str], capture: Capture) -> None:
    """Raise CaptureError where the heading's sampling interval or rate says that the time's unit is another than the column's (s)."""
    if capture.time is None or capture.time.size < 3:
        return
    found = float(capture.time[-1] - capture.time[0]) / (capture.time.size - 1)
    for line, stated in _stated(lines[:_HEADING]):
        if any(abs(found / stated / power - 1.0) < _WITHIN for power in _POWERS):
            raise CaptureError(
                capture.source,
                text(
                    "the heading states a sampling interval of {stated:.4g} s, but the time column has steps of "
                    "{found:.4g} s: its unit is different. Write the unit into the column's heading, as 'time "
                    "(ms)', or correct the stated interval",
                    stated=stated,
                    found=found,
                ),
                line,
            )


def _stated(lines: list[str]) -> Iterator[tuple[int, float]]:
    """Give the lines' numbers, and the intervals (s) that they state."""
    for at, line in enumerate(lines, start=1):
        match = _SAID.search(line)
        if match is None or not float(match["number"]) > 0.0:
            continue
        inside = _BRACKETS.search(match["between"])
        unit = (inside[1] if inside else match["after"]).strip()
        if match["interval"]:
            if unit.lower() in _SECONDS:
                yield at, float(match["number"]) * _SECONDS[unit.lower()]
        elif unit.lower().endswith(("hz", "sa", "s", "sps")) or not unit:
            prefix = _PREFIXES.get(unit[:1].lower(), 1.0) if unit.lower() not in ("hz", "sa", "s", "sps") else 1.0
            yield at, 1.0 / (float(match["number"]) * prefix)
