"""The part of a ramp in which the shaft turns, without readings that are impossible for a shaft."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from procedures.estimation.fitting.checks import increasing, same_length, series
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.fitting.misfit import Answer, Cause, Finding
from procedures.estimation.fitting.noise import rounded_to, white_noise
from procedures.estimation.fitting.repeated_rows import RepeatedRows, repeated_rows
from procedures.estimation.mechanics.ramp_torque import ramp_torque

#: A reading this many standard deviations and this share of the top speed from its neighbours is none of the shaft's.
_WILD, _WILD_SHARE, _END_SHARE, _NEIGHBOURS = 9.0, 0.01, 0.1, 5
#: Nor is one that is off by more than so many times what the speed changes over two readings there.
_STEEP = 2.0
#: Readings of standstill between readings above this share of the top speed are no standstill.
_TURNING_SHARE = 0.1
#: Counted speeds come again so often each, in steps of more than so many digits; in steps of more than this share of the top no ramp is
#: read.
_EACH_LEVEL, _MANY_DIGITS, _COARSE = 3.0, 10.0, 0.25
#: A ramp that lost more than this share of its readings is none.
_MOST_LOST = 1.0 / 3.0


@dataclass(frozen=True)
class SpeedRamp:
    """One ramp: `time` (s), `speed` (rad/s, mechanical), shape (n,), and the driving `torque` (N·m): one value, or (n,).

    A coast-down has torque 0. `speed_resolution` (rad/s) is one step of the readings; `speed_filter` and `torque_filter` (s) are time
    constants of first-order filters that the readings went through.
    """

    time: NDArray[np.float64]
    speed: NDArray[np.float64]
    torque: float | NDArray[np.float64] = 0.0
    speed_resolution: float = 0.0
    speed_filter: float = 0.0
    torque_filter: float = 0.0


@dataclass(frozen=True)
class Run:
    """The part of a ramp that turns, as if it turned forwards: `time` (s) from 0, `speed` (rad/s) and `driven` (N·m) by `sign`.

    `begin` (s) is where it begins in the ramp; `noise` (rad/s) one speed's, `torque_noise` (N·m) the torque's level's; `varies` where
    the torque is more than a level; `lost` readings of `readings` were left out. Of `repeated` rows the new ones are taken.
    `counted` (rad/s) is the step of speeds that are a few counted pulses each, 0 where they are none.
    """

    begin: float
    time: FloatArray
    speed: FloatArray
    driven: FloatArray
    sign: float
    noise: float
    torque_noise: float
    resolution: float
    varies: bool
    lost: int
    readings: int
    speed_filter: float
    torque_filter: float
    repeated: RepeatedRows | None = None
    counted: float = 0.0


def wild(speed: FloatArray, noise: float) -> NDArray[np.bool_]:
    """Return which speeds (n,) no neighbour has anything to do with: against the median of the means of those 1 … 5 places away."""
    n = speed.size
    count = min(_NEIGHBOURS, (n - 1) // 3)
    if count < 2:
        return np.zeros(n, dtype=bool)
    places = np.arange(n)
    expected, climb = np.empty((count, n)), np.empty((count, n))
    for k in range(1, count + 1):
        expected[k - 1] = 0.5 * (speed[np.maximum(places - k, 0)] + speed[np.minimum(places + k, n - 1)])
        climb[k - 1] = np.abs(speed[np.minimum(places + k, n - 1)] - speed[np.maximum(places - k, 0)]) / k
        # Beside an end there is one side only, which goes on straight.
        first, last = places < count, places >= n - count
        expected[k - 1, first] = 2.0 * speed[places[first] + k] - speed[places[first] + 2 * k]
        expected[k - 1, last] = 2.0 * speed[places[last] - k] - speed[places[last] - 2 * k]
    off = np.abs(speed - np.median(expected, axis=0))
    # What bends or ripples is off from its neighbours everywhere, what goes on straight beyond an end may bend.
    usual = max(noise, 1.4826 * float(np.median(off)))
    limit = np.full(n, max(_WILD * usual, _WILD_SHARE * float(np.max(np.abs(speed)))))
    limit[:count] = limit[n - count :] = max(float(limit[n // 2]), _END_SHARE * float(np.max(np.abs(speed))))
    return np.asarray(off > np.maximum(limit, _STEEP * np.median(climb, axis=0)))


def counted_step(speed: FloatArray, digit: float) -> float:
    """Return the step (rad/s) of speeds (n,) that are a few whole steps of much more than the last digit, as counted pulses are; else 0."""
    levels = np.unique(speed)
    gaps = np.diff(levels)
    if not digit or not 2 <= gaps.size <= speed.size / _EACH_LEVEL:
        return 0.0
    step = float(np.median(gaps))
    whole = np.abs(gaps - step * np.rint(gaps / step)) <= 2.0 * digit
    return step if step > _MANY_DIGITS * digit and bool(np.all(whole)) else 0.0


def turning(ramp: SpeedRamp, number: int) -> Run:
    """Return what turns one way, standstill cut off both ends, wild readings left out. Raises EstimationError where nothing does."""
    time = series(f"time of ramp {number}", ramp.time, least=5)
    speed = series(f"speed of ramp {number}", ramp.speed, least=5)
    same_length(time=time, speed=speed)
    increasing(time)
    repeated = repeated_rows((speed,))
    if repeated is not None:
        new = repeated.new
        driven = ramp.torque if np.size(ramp.torque) != time.size else np.asarray(ramp.torque)[new]
        return replace(
            turning(replace(ramp, time=repeated.times(time), speed=speed[new], torque=driven), number),
            repeated=repeated,
        )
    # A speed column of few digits says by itself to what it was rounded.
    counted = counted_step(speed, ramp.speed_resolution)
    resolution = counted or ramp.speed_resolution or rounded_to(speed)
    noise = white_noise(speed, resolution)
    kept = ~wild(speed, noise)
    top = float(np.max(np.abs(speed[kept]))) if np.any(kept) else 0.0
    if counted > _COARSE * top:
        raise EstimationError(
            f"the speed of ramp {number} is read in steps of {counted:.3g} rad/s up to {top:.3g} rad/s, as few pulses counted over a "
            "short time give it; use a sensor of more pulses a turn, count for longer, or ramp to a higher speed"
        )
    if top == 0 or np.ptp(speed[kept]) <= max(3 * resolution, 1e-9 * top):
        raise EstimationError(f"the speed of ramp {number} does not change; record while it accelerates or coasts")
    sign = float(np.sign(speed[kept][np.argmax(np.abs(speed[kept]))]))
    possible = kept
    part, kept = _longest(sign * speed, kept, top, noise)
    inside = kept[part]
    if np.count_nonzero(inside) < 5:
        raise EstimationError(f"ramp {number} has fewer than 5 points that turn; sample faster or ramp more slowly")
    # Few pulses are now and then none.
    lost = int(inside.size - np.count_nonzero(possible[part] if counted else inside))
    if lost > _MOST_LOST * inside.size:
        raise EstimationError(
            f"{lost} of the {inside.size} speeds of ramp {number} are zero or outliers; check the speed sensor's cable and threshold"
        )
    begin = float(time[part][inside][0])
    given = ramp.torque
    if np.ndim(given):
        if np.size(given) != time.size:
            raise EstimationError(f"series differ in length: time {time.size}, torque {np.size(given)}")
        # What came as a zero with the speed is no torque either.
        given = np.asarray(given, dtype=np.float64)[part][inside]
    torque = ramp_torque(given, time[part][inside], speed[part][inside], number)
    return Run(
        begin, time[part][inside] - begin, sign * speed[part][inside], sign * torque.values, sign, noise, torque.noise,
        resolution, torque.varies, lost, int(inside.size), ramp.speed_filter, ramp.torque_filter,
        counted=counted,
    )  # fmt: skip


def _longest(
    forwards: FloatArray, kept: NDArray[np.bool_], top: float, noise: float
) -> tuple[slice, NDArray[np.bool_]]:
    """Return the longest stretch that turns, and which readings are the shaft's."""
    turns = forwards > max(0.02 * top, 5 * noise)
    # A reading that is left out does not end a stretch.
    bridged = turns | ~kept
    edges = np.flatnonzero(np.diff(np.concatenate(([0], bridged.astype(np.int8), [0]))))
    stretches = [(int(b), int(e)) for b, e in zip(edges[::2], edges[1::2], strict=True)]
    joined: list[tuple[int, int]] = []
    fast, last = _TURNING_SHARE * top, 0.0
    for begin, end in stretches:
        true = forwards[begin:end][(turns & kept)[begin:end]]
        if not true.size:
            continue
        if joined and last > fast and true[0] > fast:
            joined[-1] = (joined[-1][0], end)
        else:
            joined.append((begin, end))
        last = float(true[-1])
    # What lies outside is standstill, where friction holds instead of braking.
    begin, end = max(joined, key=lambda each: each[1] - each[0], default=(0, 0))
    return slice(begin, end), kept & turns


def dropouts(runs: Sequence[Run]) -> list[Finding]:
    """Return the findings for readings that were left out."""
    repeated = [run.repeated.finding for run in runs if run.repeated is not None][:1]
    lost = sum(run.lost for run in runs)
    if not lost:
        return repeated
    count = sum(run.readings for run in runs)
    figures: dict[str, float | str] = {"count": float(lost), "readings": float(count)}
    return [*repeated, Finding(Cause.DROPOUTS, Answer.MODELLED, figures=figures)]
