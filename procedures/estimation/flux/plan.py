"""The locations at which a map is read, and their order, by the current circle, the voltage at the speed, heat and drift."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.fit import EstimationError, FloatArray

#: Rows of equal i_q lie denser at small |i_q|, where bridges saturate. The first beside the d axis is so near to it that what it says along
#: i_d is little new: its locations are so many times farther apart.
_DENSER, _BESIDE_AXIS = 1.4, 1.5
_LEAST = 8
#: Locations that are read in all four quadrants, and readings from one at zero current to the next.
ANCHORS, BETWEEN_ZEROS = 6, 6
#: Currents that tie a session to those before, one more for each block.
_TIES = 3


@dataclass(frozen=True)
class PlannedReading:
    """One reading to take: currents (A) and the sign of the speed."""

    i_d: float
    i_q: float
    direction: int


def within_voltage(
    points: FloatArray,
    flux: Callable[[FloatArray], FloatArray],
    electrical_speed: float,
    resistance: float,
    voltage: float,
) -> NDArray[np.bool_]:
    """Tell at which currents (n, 2) the phase voltage stays below `voltage` (V, peak), motoring and braking both, by flux linkages
    (n, 2) that are known so far.
    """
    psi = flux(points)
    drop = resistance * points
    turning = abs(electrical_speed) * np.column_stack((-psi[:, 1], psi[:, 0]))
    largest = np.maximum(np.hypot(*(drop + turning).T), np.hypot(*(drop - turning).T))
    return np.asarray(largest <= voltage)


def grid_locations(
    largest: float,
    count: int,
    *,
    i_d_range: tuple[float, float] | None = None,
    both_sides: bool = False,
    allowed: Callable[[FloatArray], NDArray[np.bool_]] | None = None,
) -> FloatArray:
    """Return about `count` locations (m, 2) in A with i_q ≥ 0 within a circle, its arc among them, the first without current.

    Never more than `count`. `i_d_range` (A) cuts the circle, `both_sides` adds i_q < 0 for a motor that is not symmetric, `allowed` tells
    which currents the voltage has room for. Raises EstimationError for a count or a range that holds too few.
    """
    low, high = i_d_range or (-largest, largest)
    if not (largest > 0.0 and low <= 0.0 <= high and high > low):
        raise EstimationError(
            f"a largest current of {largest:g} A with i_d from {low:g} to {high:g} A holds no map; give a current above 0 and a range "
            "with 0 in it"
        )
    if count < _LEAST:
        raise EstimationError(f"{count} locations do not carry a map; at least {_LEAST} are needed")
    best = np.empty((0, 2))
    for rows in range(2, max(3, int(2.0 * np.sqrt(count)))):
        for spacing in np.linspace(0.8, 1.6, 33):
            most = _count(largest, rows, spacing, low, high, both_sides)
            if most < len(best) or (most > count and allowed is None):
                continue
            made = _rows(largest, rows, spacing, low, high, both_sides)
            if allowed is not None:
                made = made[allowed(made)]
            if best.shape[0] < len(made) <= count or (len(made) == len(best) and _evener(made, best, largest)):
                best = made
    if len(best) < _LEAST:
        raise EstimationError(
            f"{len(best)} locations remain within {largest:g} A and the voltage; lower the speed, or raise the current"
        )
    order = np.argsort(np.hypot(best[:, 0], best[:, 1]), kind="stable")
    return np.asarray(best[order])


def anchors(points: FloatArray, count: int) -> NDArray[np.intp]:
    """Return which locations are read in all four quadrants: far from each other, the smallest and the largest current among them.

    At the smallest, dead time and drops still grow with the current, and no other location shows them there.
    """
    size = np.hypot(points[:, 0], points[:, 1])
    places = np.flatnonzero(points[:, 1] != 0.0)
    if not places.size:
        return places
    chosen = [int(places[np.argmin(size[places])]), int(places[np.argmax(size[places])])]
    while len(chosen) < min(count, places.size):
        apart = np.min(np.hypot(*(points[places, None, :] - points[None, chosen, :]).transpose(2, 0, 1)), axis=1)
        chosen.append(int(places[np.argmax(apart)]))
    return np.array(list(dict.fromkeys(chosen)))


def reading_order(points: FloatArray, random: np.random.Generator) -> Sequence[PlannedReading]:
    """Return the readings of a map: each location once, the sign of i_q alternating, anchors in all four quadrants, the ends and the
    middle of the d axis at both speeds.

    They come in random order, which keeps the temperature even, in blocks that begin at zero current and between which the speed
    reverses; an anchor's four readings lie far apart. Locations on both sides of i_q are read on their own side.
    """
    sides = (1, -1) if np.all(points[:, 1] >= 0.0) else (1,)
    moving = [k for k in random.permutation(len(points)) if np.any(points[k])]
    chosen = [k for k in anchors(points, 2 * ANCHORS // len(sides)) if k in moving]
    # Nothing stands for a current's mirror image where both sides are read: more is read at both speeds, for R is known by that alone.
    both_ways = _of_d_axis(points) if len(sides) > 1 else np.flatnonzero((points[:, 1] == 0.0) & (points[:, 0] != 0.0))
    single: dict[int, list[PlannedReading]] = {1: [], -1: []}
    repeated: dict[int, list[PlannedReading]] = {1: [], -1: []}
    flip = 0
    for k in moving:
        i_d, i_q = (float(each) for each in points[k])
        if k in chosen:
            for direction in (1, -1):
                repeated[direction] += [PlannedReading(i_d, side * i_q, direction) for side in sides]
        elif k in both_ways:
            for direction in (1, -1):
                repeated[direction].append(PlannedReading(i_d, i_q, direction))
        else:
            direction = 1 if len(single[1]) <= len(single[-1]) else -1
            single[direction].append(PlannedReading(i_d, sides[flip] * i_q, direction))
            flip = (flip + 1) % len(sides)
    return _in_blocks(single, repeated, random)


def other_sides(planned: Sequence[PlannedReading], random: np.random.Generator) -> Sequence[PlannedReading]:
    """Return what a plan for a symmetric motor lacks where the motor is not: the other sign of i_q, at the other speed, of each current
    that was read at one only, and those on the d axis at the other speed, in the order and with the readings at zero current that
    `reading_order` has. Empty where nothing lacks.
    """
    read = {(each.i_d, each.i_q) for each in planned}
    on_axis = {(each.i_d, each.direction) for each in planned if each.i_q == 0.0}
    single: dict[int, list[PlannedReading]] = {1: [], -1: []}
    for each in planned:
        if (each.i_d, -each.i_q) not in read or (each.i_q == 0.0 and (each.i_d, -each.direction) not in on_axis):
            single[-each.direction].append(PlannedReading(each.i_d, -each.i_q, -each.direction))
    return _in_blocks(single, {1: [], -1: []}, random) if single[1] or single[-1] else []


def further_readings(points: FloatArray, random: np.random.Generator, *, both_sides: bool) -> Sequence[PlannedReading]:
    """Return the readings of further locations (m, 2), i_q > 0: each once, the signs of i_q and of the speed alternating, or with
    `both_sides` at either sign of i_q, in the order that `reading_order` has. Empty where there are none.

    The two of the largest currents are read at both speeds: the resistance is not known beyond the readings before.
    """
    single: dict[int, list[PlannedReading]] = {1: [], -1: []}
    repeated: dict[int, list[PlannedReading]] = {1: [], -1: []}
    largest = np.argsort(-np.hypot(*points.T), kind="stable")[:2]
    for number, (i_d, i_q) in enumerate(points.tolist()):
        # All of them motor: what the resistance is wrong by is then no slope from one to the next, which the largest torque hangs on.
        direction = 1 if number % 2 == 0 else -1
        single[direction].append(PlannedReading(i_d, direction * i_q, direction))
        if both_sides:
            single[-direction].append(PlannedReading(i_d, -direction * i_q, -direction))
        if number in largest:
            repeated[-direction].append(PlannedReading(i_d, direction * i_q, -direction))
    return _in_blocks(single, repeated, random) if len(points) else []


def remaining(
    planned: Sequence[PlannedReading],
    read: Sequence[PlannedReading],
    random: np.random.Generator,
    *,
    tie: bool = True,
) -> Sequence[PlannedReading]:
    """Return what of a plan is left where a part of it was read, in the order that `reading_order` has. Empty where nothing is.

    Where it is a `tie` to an earlier session, currents of the part come again, at both speeds: three, and one more for each block.
    """
    left = list(planned)
    for each in read:
        if each in left:
            left.remove(each)
    single: dict[int, list[PlannedReading]] = {1: [], -1: []}
    for each in left:
        if each.i_d or each.i_q:
            single[each.direction].append(each)
    loaded = [each for each in read if each.i_d or each.i_q]
    most = max(len(single[1]), len(single[-1]))
    if not most:
        return []
    repeated: dict[int, list[PlannedReading]] = {1: [], -1: []}
    if loaded and tie:
        points = np.array([(each.i_d, each.i_q) for each in loaded])
        chosen = anchors(points, _TIES + most // BETWEEN_ZEROS)
        for place in chosen if chosen.size else [int(np.argmax(np.abs(points[:, 0])))]:
            for direction in (1, -1):
                repeated[direction].append(PlannedReading(float(points[place, 0]), float(points[place, 1]), direction))
    return _in_blocks(single, repeated, random)


def _in_blocks(
    single: Mapping[int, list[PlannedReading]],
    repeated: Mapping[int, list[PlannedReading]],
    random: np.random.Generator,
) -> Sequence[PlannedReading]:
    """Return the readings at either speed in blocks that begin at zero current."""
    blocks = {}
    number = -(-max(len(single[way]) + len(repeated[way]) for way in (1, -1)) // BETWEEN_ZEROS)
    for way in (1, -1):
        random.shuffle(repeated[way])
        # Repeated readings are spread over the blocks first, so that each has some and the resistance is known throughout.
        dealt: list[list[PlannedReading]] = [[] for _ in range(number)]
        for k, each in enumerate([*repeated[way], *single[way]]):
            dealt[k % number].append(each)
        for each_block in dealt:
            random.shuffle(each_block)
        blocks[way] = dealt
    made: list[PlannedReading] = []
    for turn in range(number):
        for way in (1, -1) if turn % 2 == 0 else (-1, 1):
            made += [PlannedReading(0.0, 0.0, way), *blocks[way][turn]]
    return [*made, PlannedReading(0.0, 0.0, made[-1].direction)]


def _of_d_axis(points: FloatArray) -> NDArray[np.intp]:
    """Return the locations on the d axis with the smallest and the largest current of either sign."""
    made = []
    for sign in (1.0, -1.0):
        places = np.flatnonzero((points[:, 1] == 0.0) & (sign * points[:, 0] > 0.0))
        if places.size:
            size = np.abs(points[places, 0])
            made += [places[np.argmin(size)], places[np.argmax(size)]]
    return np.unique(np.array(made, dtype=np.intp))


def _count(largest: float, rows: int, spacing: float, low: float, high: float, both_sides: bool) -> int:
    """Return how many locations `_rows` makes."""
    step = spacing * largest / rows
    counts = [1 + _gaps(row, step, *_ends(largest, row, rows, low, high)[1:]) for row in range(rows + 1)]
    return sum(counts) + (sum(counts[1:]) if both_sides else 0)


def _ends(largest: float, row: int, rows: int, low: float, high: float) -> tuple[float, float, float]:
    """Return a row's i_q, and its smallest and largest i_d (A)."""
    i_q = largest * (row / rows) ** _DENSER
    half = math.sqrt(max(largest**2 - i_q**2, 0.0))
    return i_q, max(low, -half), min(high, half)


def _gaps(row: int, step: float, first: float, last: float) -> int:
    """Return how many gaps there are between the locations of a row, those of the d axis with one at 0."""
    if row == 0:
        return round(-first / step) + round(last / step)
    if last - first <= 0.3 * step:
        return 0
    return max(round((last - first) / (_BESIDE_AXIS * step if row == 1 else step)), 1)


def _rows(largest: float, rows: int, spacing: float, low: float, high: float, both_sides: bool) -> FloatArray:
    step = spacing * largest / rows
    result: list[FloatArray] = []
    for row in range(rows + 1):
        i_q, first, last = _ends(largest, row, rows, low, high)
        if row == 0:
            left, right = round(-first / step), round(last / step)
            i_d = np.concatenate((np.linspace(first, 0.0, left + 1)[:-1], [0.0], np.linspace(0.0, last, right + 1)[1:]))
        elif gaps := _gaps(row, step, first, last):
            i_d = np.linspace(first, last, gaps + 1)
        else:
            i_d = np.array([0.5 * (first + last)])
        i_d = np.where(np.abs(i_d) < 1e-9 * largest, 0.0, i_d)
        result.append(np.column_stack((i_d, np.full(i_d.size, i_q))))
        if both_sides and row:
            result.append(np.column_stack((i_d, np.full(i_d.size, -i_q))))
    return np.vstack(result)


def _evener(made: FloatArray, than: FloatArray, largest: float) -> bool:
    return _unevenness(made, largest) < _unevenness(than, largest)


def _unevenness(points: FloatArray, largest: float) -> float:
    """Return the largest distance (A) from anywhere in the circle to the nearest location."""
    if not len(points):
        return np.inf
    angle, radius = np.meshgrid(np.linspace(0.0, np.pi, 25), np.linspace(0.2, 1.0, 6) * largest)
    at = np.column_stack(((radius * np.cos(angle)).ravel(), (radius * np.sin(angle)).ravel()))
    return float(np.max(np.min(np.hypot(*(at[:, None, :] - points[None, :, :]).transpose(2, 0, 1)), axis=1)))
