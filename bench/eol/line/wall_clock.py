"""The computer's clock, and how it stands beside one that nobody sets."""

import time
from datetime import UTC, datetime, timedelta

#: Counts while the computer sleeps too, where the system has such a one.
_RUNNING = getattr(time, "CLOCK_BOOTTIME", time.CLOCK_MONOTONIC)


class WallClock:
    """Tells the time, which a person or a time server may set, and how long the computer has run, which nobody sets."""

    def now(self) -> datetime:
        """Return what time it is (UTC)."""
        return datetime.now(UTC)

    def running(self) -> timedelta:
        """Return for how long the computer has run."""
        return timedelta(seconds=time.clock_gettime(_RUNNING))

    def standing(self) -> timedelta:
        """Return a number that stays as it is until the clock is set, and then changes by as much."""
        return self.now() - datetime.min.replace(tzinfo=UTC) - self.running()
