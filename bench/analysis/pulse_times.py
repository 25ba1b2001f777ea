"""Speeds that were read off the times between a shaft's pulses: each is a mean over its interval, and belongs to the middle of it."""

import numpy as np

from bench.captures.written_digits import FloatArray

#: So many rows at least, over which the intervals change by this factor at least: speed times interval shows nothing in less.
_LEAST, _CHANGE = 12, 1.3
#: A speed is the mean over so many intervals at the most.
_MOST_INTERVALS = 60
#: Speed times interval is the same angle in all rows but few, up to this share; a speed of that instant is off it by twice that at least.
_ALIKE, _ROWS, _BETTER = 0.01, 0.98, 0.5
#: An interval is that of a tooth too few where it is so many times as long as its neighbours'; so many turns at least show it.
_LONGER, _GAPS = (1.6, 2.5), 4
#: So many whole turns at least, that their means alone describe a coast-down.
_TURNS = 20


def pulse_intervals(time: FloatArray, speed: FloatArray) -> tuple[int, float] | None:
    """Return over how many rows each speed (rad/s, shape (n,)) is the mean, and the angle (rad) that the shaft turned meanwhile; None where
    the speeds are not those of pulses.

    The rows end with a speed's own time (s), or begin with it where their number is negative. A logger that writes a row for each pulse
    has speed times interval the same in all rows, to the last digit, which no shaft that slows down between even rows has.
    """
    steps = np.diff(time)
    speed = np.abs(speed)
    if time.size < _LEAST or np.min(steps) <= 0.0 or np.min(speed) <= 0.0:
        return None
    if np.max(steps[: steps.size // 2]) * _CHANGE > np.max(steps[steps.size // 2 :]):
        return None
    # Taken as that of its instant, a speed fits the interval around it.
    apart = _spread(speed[1:-1] * 0.5 * (time[2:] - time[:-2]))
    found = None
    for rows in range(1, min(_MOST_INTERVALS, time.size // 4) + 1):
        passed = time[rows:] - time[:-rows]
        for sign, read in ((1, speed[rows:]), (-1, speed[:-rows])):
            angle = read * passed
            spread = _spread(angle)
            if spread < min(_ALIKE, _BETTER * apart) and (found is None or spread < _BETTER * found[2]):
                found = sign * rows, float(np.median(angle)), spread
    return found[:2] if found else None


def with_missing_tooth(time: FloatArray, speed: FloatArray) -> tuple[FloatArray, FloatArray, int] | None:
    """Return times (s) and speeds (rad/s, (n,)) with the pulses of a tooth that is missing put in, and the teeth of a turn; None where none
    is missing.

    A logger takes each interval for one tooth's, and shows half the speed where one is missing: once a turn, so that the intervals between
    two such tell how many teeth there are, and the speeds whether they count it among them.
    """
    steps = np.diff(time)
    if steps.size < _LEAST or np.min(steps) <= 0.0:
        return None
    for first in (1, 0):
        read = speed[1:] if first else speed[:-1]
        angle = np.abs(read) * steps
        one = float(np.median(angle))
        around = 0.5 * (steps[:-2] + steps[2:])
        share = steps[1:-1] / around
        gaps = np.flatnonzero((share > _LONGER[0]) & (share < _LONGER[1])) + 1
        if one <= 0.0 or _spread(angle) > _ALIKE or gaps.size < _GAPS:
            continue
        apart = np.unique(np.diff(gaps))
        if apart.size != 1 or abs((apart[0] + 1) * one / (2.0 * np.pi) - 1.0) > _ALIKE:
            continue
        speeds = speed.copy()
        speeds[gaps + first] *= 2.0
        # Its pulse would have come midway, but for what the shaft slows down meanwhile, every turn at one place.
        times = np.insert(time, gaps + 1, 0.5 * (time[gaps] + time[gaps + 1]))
        return times, np.insert(speeds, gaps + 1, speeds[gaps + first]), int(apart[0] + 1)
    return None


def at_middles(time: FloatArray, rows: int) -> tuple[FloatArray, slice]:
    """Return the middles (s) of the intervals over which speeds are means, and which rows these are."""
    count = abs(rows)
    return 0.5 * (time[count:] + time[:-count]), slice(count, None) if rows > 0 else slice(None, -count)


def over_turns(time: FloatArray, speed: FloatArray, rows: int, angle: float) -> tuple[FloatArray, FloatArray] | None:
    """Return middles (s) and means (rad/s) of whole turns of speeds that are means over one interval, of this angle (rad) each; None where
    those are no parts of a turn, or the turns are too few.

    Pulses are nowhere evenly spaced, and a shaft's cogging comes again with its turn: both drop out.
    """
    pulses = round(2.0 * np.pi / angle)
    if abs(rows) != 1 or pulses < 2 or abs(pulses * angle / (2.0 * np.pi) - 1.0) > _ALIKE:
        return None
    read, edges = (speed[1:], time) if rows > 0 else (speed[:-1], time)
    turns = read.size // pulses
    if turns < _TURNS:
        return None
    edges = edges[: turns * pulses + 1 : pulses]
    means = pulses / np.sum(1.0 / read[: turns * pulses].reshape(turns, pulses), axis=1)
    return 0.5 * (edges[1:] + edges[:-1]), means


def _spread(angles: FloatArray) -> float:
    """Return within what share of their median all angles but few lie."""
    return float(np.quantile(np.abs(angles / np.median(angles) - 1.0), _ROWS))
