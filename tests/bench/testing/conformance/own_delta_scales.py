"""Scales of a dynamometer that contradict each other: its speed against the drive's frequency, its power against torque and speed."""

from collections.abc import Sequence

from bench.testing.conformance.manual import Manual, NotYet, Reply
from drivers.interfaces import MeasurementError

_BEGINS = "driving_speed begins"
#: 1.2345 N·m at the 15 rad/s that are commanded, 18.5 W, in counts of 0.1 mN·m and 0.01 rpm.
_TORQUE, _SPEED = 12345, 14324


def _sensor(power: int) -> bytes:
    """Return torque, speed, and so many counts of power."""
    return b"".join(one.to_bytes(4, "big", signed=True) for one in (_TORQUE, _SPEED, power))


def _speed(frequency: int, says: str = "") -> Reply:
    error = MeasurementError if says else None
    return Reply("read 1 2103H 1", frequency.to_bytes(2, "big"), error, call=_BEGINS, says=says)


def _power(counts: int, says: str = "") -> Reply:
    return Reply("read 2 0000H 6", _sensor(counts), MeasurementError if says else None, call=_BEGINS, says=says)


#: 15 rad/s of two pole pairs are 4.77 Hz: a third more or less may be slip, a power of ten is another number of decimals.
SCALES: Sequence[Reply] = (
    *(_speed(frequency) for frequency in (477, 620, 366)),
    *(_speed(frequency, "Check pole_pairs") for frequency in (655, 350, 1500)),
    _speed(4775, "Set speed_decimals = 1"),
    _speed(48, "Set speed_decimals = 3"),
    # 0.1, 1 and 10 W a count, within a factor of two; too few counts settle nothing.
    *(_power(counts) for counts in (185, -185, 2, 100, 360)),
    *(_power(counts, "its decimals (08H, 20H)") for counts in (80, 400, 1000)),
)
#: A shaft that is pushed to 30 rad/s: a power of ten may be a filter that lags, but not three readings of it.
PUSHED: Sequence[NotYet] = tuple(
    NotYet("read 1 2103H 1", frequency.to_bytes(2, "big"), call="measure", between="read 2 0000H")
    for frequency in (9550, 95)
)
#: The station says what a count is.
POWER_STATED = {
    "power_step": 1.0,
    "manual": Manual(replies=(_power(185, "Set power_step = 0.1"), _power(2, "Set power_step = 10"))),
}
