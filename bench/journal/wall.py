"""The clock time of each event, and whether the computer's clock was set back in the meantime."""

import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta

#: A clock is set right by this much (s) without anybody being told.
_TOLERANCE_NS = 1_000_000_000
_EPOCH = datetime(1970, 1, 1, tzinfo=UTC)


class WallTime:
    """Gives the wall's time and finds steps back by comparing with the monotonic clock; both are handed in as ns.

    `before` is the wall time (ISO 8601) of the last event of an earlier session, where there is one.
    """

    def __init__(
        self,
        before: str = "",
        wall: Callable[[], int] = time.time_ns,
        monotonic: Callable[[], int] = time.monotonic_ns,
    ) -> None:
        self._wall = wall
        self._monotonic = monotonic
        # Time that has passed since the last event of an earlier session is not known, but it is not negative.
        self._due = _nanoseconds(before)
        self._due_at = monotonic()

    def read(self) -> tuple[str, float]:
        """Return the time (ISO 8601, UTC) and by how much the clock was set back since the last time (s); 0 where it was not."""
        now, at = self._wall(), self._monotonic()
        back = self._due + (at - self._due_at) - now
        self._due, self._due_at = now, at
        stamp = (_EPOCH + timedelta(microseconds=now // 1000)).isoformat(timespec="microseconds")
        return stamp, back * 1e-9 if back > _TOLERANCE_NS else 0.0


def _nanoseconds(stamp: str) -> int:
    try:
        then = datetime.fromisoformat(stamp)
        return int((then - _EPOCH) / timedelta(microseconds=1)) * 1000
    except (ValueError, TypeError, OverflowError):
        return 0
