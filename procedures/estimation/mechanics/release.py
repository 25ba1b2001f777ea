"""Finds where a record of the speed becomes a coast-down; before the release the speed was held or driven."""

import numpy as np

from procedures.estimation.fitting.fit import FloatArray

#: Means that a record is looked at in, and the least of them on either side of the release.
_MEANS, _LEAST = 300, 3
#: A release is where a bend explains so much of χ² beyond a smooth course.
_SEEN = 30.0
#: Friction brakes faster speeds more: before the release the speed falls by less than this share of what it falls by after it.
_HELD = 0.5
#: What the shaft would have lost meanwhile is this share of its top speed at least.
_LOST = 0.005
#: A shaft below this share of its top speed stands, or soon will.
_SLOW = 0.05
#: A mean below this share of the top speed, before that speed, is of the shaft's start.
_STARTED = 0.98
#: The release is in the mean of the top speed or in the next one.
_BEYOND = 2
#: So many means from the bend on are left out.
_BESIDE = 3
#: A shaft above this share of its top speed is fast, and below the other it has slowed down: no coast-down does so twice.
_FAST, _SLOWED = 0.5, 0.25
#: So many equal readings at the end, this share of all, below this share of the top speed, are those of a sensor without pulses.
_STUCK, _STUCK_SHARE, _STUCK_SLOW = 20, 0.02, 0.2


def release_of(time: FloatArray, speed: FloatArray) -> int:
    """Return the index of the first reading (s, rad/s, shape (n,)) that belongs to the coast-down, 0 where all of them do.

    No friction brakes a shaft less at its top speed than soon after: a speed that holds or rises, and falls from an instant on, was driven
    until then. Means of many readings are fitted by a line to that instant, and a cubic polynomial from there on. No friction drives a
    shaft: what lies before the top speed was driven if the speed rose to it.
    """
    count = time.size // max(1, time.size // _MEANS)
    if count < 4 * _LEAST:
        return 0
    block = time.size // count
    count = time.size // block
    t = time[: count * block].reshape(count, block).mean(axis=1)
    forwards = speed * (1.0 if np.abs(np.max(speed)) >= np.abs(np.min(speed)) else -1.0)
    # Single wild readings are in no median.
    w = np.median(forwards[: count * block].reshape(count, block), axis=1)
    top = float(np.max(w))
    fast = np.flatnonzero(w > _SLOW * top)
    if not top > 0.0 or fast.size < 4 * _LEAST:
        return 0
    peak = int(np.argmax(w))
    starting = np.flatnonzero(w[:peak] < _STARTED * top)
    begin = int(starting[-1]) + 1 if starting.size else 0
    bend = _bend(t[begin : fast[-1] + 1], w[begin : fast[-1] + 1] / top)
    if bend is None and not begin:
        return 0
    # What the means around the bend hold belongs to neither.
    first = max(peak + _BEYOND, 0 if bend is None else begin + bend + _BESIDE)
    return int(min(first * block, time.size - 1))


def driven_again(speed: FloatArray) -> int | None:
    """Return the index from which on a shaft that has slowed down from its top speed becomes fast again (n,), None where it does not."""
    block = max(1, speed.size // _MEANS)
    count = speed.size // block
    w = np.abs(np.median(speed[: count * block].reshape(count, block), axis=1))
    fast, slowed = w > _FAST * np.max(w), w < _SLOWED * np.max(w)
    if count < 4 * _LEAST:
        return None
    first = int(np.argmax(w))
    slow = np.flatnonzero(slowed[first:])
    if not slow.size:
        return None
    again = np.flatnonzero(fast[first + slow[0] :])
    if again.size < _LEAST:
        return None
    rise = first + int(slow[0]) + int(again[0])
    return int(np.flatnonzero(slowed[:rise])[-1]) * block


def _bend(t: FloatArray, w: FloatArray) -> int | None:
    """Return the place in means of speeds (s, share of the top speed, shape (n,)) where a held speed begins to fall, None for none."""
    if w.size < 4 * _LEAST:
        return None
    x = (t - t[0]) / (t[-1] - t[0])
    smooth = np.vander(x, 5)
    without = _squares(smooth, w)[0]
    places = np.arange(_LEAST, x.size - 2 * _LEAST)
    found = [_squares(_bent(x, float(x[place])), w) for place in places]
    best = int(np.argmin([squares for squares, _ in found]))
    squares, values = found[best]
    variance = max(squares / (x.size - 6), 1e-18)
    at = float(x[places[best]])
    before, after = float(values[1]), float(values[2])
    spread = float(np.sqrt(variance * 12.0 / places[best] ** 3)) * x.size
    held = after < 0.0 and before - 2.0 * spread > _HELD * after
    if without - squares < _SEEN * variance or not held or -after * at < _LOST:
        return None
    return int(places[best])


def standstill_of(speed: FloatArray) -> int:
    """Return the index behind the last reading (n,) of a shaft that turns, n where it turns to the end.

    A sensor that counts goes on giving its last value, which is well above zero, when the shaft has stopped.
    """
    stuck = np.flatnonzero(speed != speed[-1])
    begin = int(stuck[-1]) + 1 if stuck.size else 0
    long = speed.size - begin >= max(_STUCK, int(_STUCK_SHARE * speed.size))
    slow = abs(float(speed[-1])) < _STUCK_SLOW * float(np.max(np.abs(speed)))
    return begin if long and slow and begin > _STUCK else int(speed.size)


def _bent(x: FloatArray, at: float) -> FloatArray:
    """Return the design (n, 5) of a course that is a line until `at` and a cubic polynomial from there on, without a jump."""
    before, after = np.minimum(x - at, 0.0), np.maximum(x - at, 0.0)
    return np.column_stack((np.ones_like(x), before, after, after**2, after**3))


def _squares(design: FloatArray, values: FloatArray) -> tuple[float, FloatArray]:
    solution = np.linalg.lstsq(design, values, rcond=None)[0]
    left = values - design @ solution
    return float(left @ left), np.asarray(solution, dtype=np.float64)
