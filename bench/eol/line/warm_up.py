"""Warm-up: instruments read what their data sheets say only some time after they were switched on."""

from collections.abc import Callable
from datetime import datetime, timedelta

from bench.eol.line.admission.golden_gate import wall_time
from bench.eol.line.preparation.line_file import ProductionLine
from drivers.interfaces.text import Text, text


class WarmUp:
    """A line that was idle takes no motor until it is warm; `until` is when (UTC), None where it need not wait.

    `last` is when its last motor's test ended (UTC). A virtual bench is always warm.
    """

    def __init__(self, line: ProductionLine, last: datetime | None, now: Callable[[], datetime] = wall_time) -> None:
        self._now = now
        self._idle_for, begin = timedelta(hours=line.cold_after), now()
        # A last test that is still to come was made while the clock was ahead, and nobody knows when.
        cold = last is None or abs(begin - last) >= self._idle_for
        self.until = begin + timedelta(seconds=line.warm_up) if line.warm_up and cold and not line.is_virtual else None

    @property
    def waits(self) -> bool:
        """Return whether it is not warm yet."""
        return self.until is not None and self._now() < self.until

    @property
    def words(self) -> Text:
        """Say until when it waits."""
        return text(
            "the station warms up until {time}, because it has measured nothing for {hours:g} h (line.warm_up, "
            "line.cold_after). If its instruments have been on, a person can start at once: --warm --person NAME",
            time=self.until.astimezone().strftime("%H:%M:%S") if self.until else "",
            hours=self._idle_for.total_seconds() / 3600.0,
        )
