"""The marks that loggers write in place of plain numbers: the time of day, and readings over range."""

import re
from datetime import date

from bench.captures.written_digits import FloatArray

#: Stands for a reading over range until its column is known; no instrument reads it.
OVER_RANGE = 1.7e308
_OVER = re.compile(r"(?<![\w.])([+-]?)\s*(?:∞|inf(?:inity)?|ol|ovld|over(?:load|range|flow)?)(?![\w.])", re.IGNORECASE)
_STAMP = re.compile(
    r"""\s*["']?(?:(?P<year>\d{4})[-/.](?P<month>\d{1,2})[-/.](?P<day>\d{1,2})[T ]+)?"""
    r"""(?P<hour>\d{1,2}):(?P<minute>\d{2}):(?P<second>\d{2}(?:[.,]\d+)?)(?:Z|[+-]\d{2}:?\d{2})?["']?(?=\s*(?:[,;\t ]|$))"""
)
_DAY = 86400.0
#: What no row of plain numbers contains, in whatever notation.
_NO_NUMBER = re.compile(r"[^\d\s.,;+\-eE]")


def over_range_marked(lines: list[str], first: int) -> list[str]:
    """Return the lines with ∞, inf, OL and the like, from index `first` on, replaced by ±`OVER_RANGE`."""
    # Deep records have millions of rows: one look at all of them costs a tenth of one at each.
    if _NO_NUMBER.search("\n".join(lines[first:])) is None:
        return lines
    return [*lines[:first], *(_OVER.sub(rf"\g<1>{OVER_RANGE!r}", line) for line in lines[first:])]


def at_the_ends(values: FloatArray) -> FloatArray | None:
    """Return a column with readings over range put to its largest or smallest other reading; None where it has none, or no other.

    The converter's end lies there or beyond, so that these readings count as clipped.
    """
    over = abs(values) >= OVER_RANGE
    if not over.any() or over.all():
        return None
    return values.clip(values[~over].min(), values[~over].max())


def seconds_by_the_clock(lines: list[str]) -> tuple[list[str], bool]:
    """Return the lines with seconds since the first sample in place of a time of day (and date), and whether there was one.

    A time of day without date that falls back by more than half a day has passed midnight.
    """
    first = next((k for k, line in enumerate(lines[:100]) if _STAMP.match(line)), None)
    if first is None:
        return lines, False
    begin: tuple[int, float] | None = None
    before, midnights = 0.0, 0
    replaced = list(lines)
    for k, line in enumerate(lines[first:], first):
        match = _STAMP.match(line)
        if match is None:
            continue
        day, clock = _day(match), _clock(match)
        if begin is None:
            begin = day, clock
        elif not match["year"] and before - clock > 0.5 * _DAY:
            midnights += 1
        before = clock
        since = (day - begin[0] + midnights) * _DAY + (clock - begin[1])
        replaced[k] = f"{since:.9f}{line[match.end() :]}"
    return replaced, True


def _day(match: re.Match[str]) -> int:
    """Return the day of a stamp, counted from any one; 0 where it has none."""
    try:
        return date(*(int(match[part]) for part in ("year", "month", "day"))).toordinal() if match["year"] else 0
    except ValueError:
        return 0


def _clock(match: re.Match[str]) -> float:
    """Return the seconds of a stamp since midnight."""
    return 3600.0 * int(match["hour"]) + 60.0 * int(match["minute"]) + float(match["second"].replace(",", "."))
