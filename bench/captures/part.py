"""The part of a stored capture that is analysed: its beginning and end, and its time column."""

import math
from dataclasses import dataclass, replace

import numpy as np

from bench.captures.capture import Capture, CaptureError
from bench.i18n.errors import UsageError
from drivers.interfaces.text import text

#: Fewer samples than these are no record.
_LEAST = 2


@dataclass(frozen=True)
class CapturePart:
    """The user's choice: samples from `begin` to `end` (s, of the file's own time), the name or the number, from 1, of the time
    column, and `time_unit` ("s", "ms", "us" or "ns"), its unit if it states none. Raises UsageError for a begin that is not
    before the end.
    """

    begin: float | None = None
    end: float | None = None
    time_column: str | None = None
    time_unit: str | None = None

    def __post_init__(self) -> None:
        for option, value in (("from", self.begin), ("to", self.end)):
            if value is not None and not math.isfinite(value):
                raise UsageError(text("--{option} {value}: allowed is a number of seconds", option=option, value=value))
        if self.begin is not None and self.end is not None and self.begin >= self.end:
            raise UsageError(
                text(
                    "--from {begin:g} is not before --to {end:g}: allowed are two instants of the record in s, the earlier one first",
                    begin=self.begin,
                    end=self.end,
                )
            )

    def cut(self, capture: Capture) -> Capture:
        """Return the samples chosen. Raises CaptureError where the capture has no time, or none of its samples lie within."""
        if self.begin is None and self.end is None:
            return capture
        time = capture.times()
        first = 0 if self.begin is None else int(np.searchsorted(time, self.begin, side="left"))
        after = time.size if self.end is None else int(np.searchsorted(time, self.end, side="right"))
        if after - first < _LEAST:
            raise CaptureError(
                capture.source,
                text(
                    "--from and --to select only {count} samples; the record lies between {begin:g} s and {end:g} s",
                    count=max(after - first, 0),
                    begin=time[0],
                    end=time[-1],
                ),
            )
        message = text(
            "cut: {count} of {size} samples, from {begin:g} s to {end:g} s",
            count=after - first,
            size=time.size,
            begin=time[first],
            end=time[after - 1],
        )
        return replace(
            capture,
            time=time[first:after],
            channels=tuple(replace(each, values=each.values[first:after]) for each in capture.channels),
            assumptions=(*capture.assumptions, message),
            first_line=capture.first_line + first if capture.first_line else 0,
        )


#: All of a capture.
WHOLE = CapturePart()
