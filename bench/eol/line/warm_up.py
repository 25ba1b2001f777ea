"""Warm-up: instruments read what their data sheets say only some time after they were switched on."""

from datetime import datetime, timedelta

from bench.eol.line.preparation.line_file import ProductionLine
from bench.eol.line.wall_clock import WallClock
from drivers.interfaces.text import Text, text


class WarmUp:
    """A line that was idle takes no motor until it is warm; `until` is when (UTC), None where it need not wait.

    `last` is when its last motor's test ended (UTC). A virtual bench is always warm.
    """

    def __init__(self, line: ProductionLine, last: datetime | None, clock: WallClock | None = None) -> None:
        self._clock = clock or WallClock()
        self._idle_for, begin = timedelta(hours=line.cold_after), self._clock.now()
        # A last test that is still to come was made while the clock was ahead, and nobody knows when.
        cold = last is None or abs(begin - last) >= self._idle_for
        warming = timedelta(seconds=line.warm_up)
        self.until = begin + warming if warming and cold and not line.is_virtual else None
        # A clock that is set meanwhile makes no instrument warm, and none cold for a year.
        self._warm_at = self._clock.running() + warming

    @property
    def waits(self) -> bool:
        """Return whether it is not warm yet."""
        return self.until is not None and self._clock.running() < self._warm_at

    @property
    def words(self) -> Text:
        """Say until when it waits."""
        return text(
            "the station warms up until {time}, because it has measured nothing for {hours:g} h (line.warm_up, "
            "line.cold_after). If its instruments have been on, a person can start at once: --warm --person NAME",
            time=self.until.astimezone().strftime("%H:%M:%S") if self.until else "",
            hours=self._idle_for.total_seconds() / 3600.0,
        )
