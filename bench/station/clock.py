"""The wall's time for a real bench."""

import time
from datetime import UTC, date, datetime


def wall_date() -> date:
    """Return today's date where this computer stands."""
    return datetime.now(UTC).astimezone().date()


class SystemClock:
    """Seconds since the clock was made; sleeping is real."""

    def __init__(self) -> None:
        self._start = time.monotonic()

    def now(self) -> float:
        """Return the time (s) since the clock was made."""
        return time.monotonic() - self._start

    def sleep(self, seconds: float) -> None:
        """Wait for a time (s)."""
        if seconds > 0.0:
            time.sleep(seconds)  # noqa: TID251  the one place besides the virtual clock


class ReplayClock:
    """Time of a replay: what was waited for once is not waited for again."""

    def __init__(self) -> None:
        self._now = 0.0

    def now(self) -> float:
        """Return the time (s) that the replayed measurement would have reached."""
        return self._now

    def sleep(self, seconds: float) -> None:
        """Count the time (s) as passed."""
        self._now += max(0.0, seconds)
