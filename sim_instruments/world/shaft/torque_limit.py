"""A dynamometer that holds a speed with no more than its own torque."""

import math
from dataclasses import replace

import numpy as np

from sim_instruments.physics.motion.motion import RestingShaft
from sim_instruments.world.segment import Segment

#: Points over which a torque is averaged: of an electrical turn, so that ripple of six periods in it averages out.
_POINTS = 49
#: How long (s) currents of a shaft at rest may take until they flow.
_BUILT_UP = 1.0
#: A speed that lies within this (relative) of another is that one.
_THERE = 1e-6
#: At the limit the load is looked at anew after so long (s), where nothing tells when the speed is reached.
_AGAIN = 0.02


def torque_beyond(segment: Segment, most: float) -> float:
    """Return the torque (N·m, signed) that a machine of at most `most` gives in place of what a motion takes; 0 where it suffices."""
    taken = _taken(segment)
    return math.copysign(most, taken) if abs(taken) > most * (1.0 + _THERE) else 0.0


def until_speed(segment: Segment, speed: float) -> Segment:
    """Return a segment at the limit, cut where the shaft comes to the speed (rad/s) that it is to be held at."""
    now = float(segment.motion.speed(np.array([segment.start]))[0])
    if abs(now - speed) <= _THERE * max(abs(speed), 1.0):
        return segment
    reaches = getattr(segment.motion, "time_of_speed", None)
    due = segment.start + _AGAIN if reaches is None else float(reaches(speed))
    if isinstance(segment.motion, RestingShaft) or not segment.start < due < segment.end:
        return segment
    return replace(segment, end=due, outcome="none")


def _taken(segment: Segment) -> float:
    """Return the largest mean torque (N·m) that a segment takes of the dynamometer at its beginning or its end, cogging apart."""
    if isinstance(segment.motion, RestingShaft):
        times = segment.start + np.array([0.0, min(_BUILT_UP, 0.999 * (segment.end - segment.start))])
        found = segment.dynamometer_torque(times)
        return float(found[np.argmax(np.abs(found))])
    ends = [segment.start] if math.isinf(segment.end) else [segment.start, segment.end]
    means = []
    for place, end in enumerate(ends):
        speed = abs(float(segment.motion.speed(np.array([end]))[0])) * segment.windings.pole_pairs
        turn = min(2.0 * math.pi / speed if speed else _AGAIN, segment.end - segment.start)
        begin = end - turn if place else end
        times = begin + turn * (np.arange(_POINTS) + 0.5) / _POINTS
        steady = segment.dynamometer_torque(times) + segment.windings.cogging(segment.motion.angle(times))
        means.append(float(np.mean(steady)))
    return max(means, key=abs)
