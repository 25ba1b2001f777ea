"""Contacts of the clamps on the motor's terminals: each lies in the loop of the current that flows through it, and warms up by it."""

import math
from dataclasses import replace

import numpy as np

from sim_instruments.disturbances.bench import Contacts
from sim_instruments.world.segment import Segment
from sim_instruments.world.settings import FloatArray

#: A contact's resistance is renewed so often while it warms up or cools under current, and until it is so near to what it tends to.
_STEPS, _SETTLED = 20.0, 1e-3


class Clamps:
    """Clamps that hands put on: each time they make other contacts."""

    def __init__(self, contacts: Contacts, seed: tuple[int, int]) -> None:
        self._contacts = contacts
        self._random = np.random.default_rng(seed)

    def put_on(self, count: int) -> tuple[float, ...]:
        """Return the resistances (Ω) of so many new contacts, cold."""
        contacts = self._contacts
        return tuple(
            contacts.resistance * math.exp(contacts.remaking * self._random.standard_normal()) for _ in range(count)
        )


def warmth_after(contacts: Contacts, warmth: FloatArray | None, segment: Segment, until: float) -> FloatArray | None:
    """Return by what share (3,) the terminals' contacts have risen at a time (s) in a segment that began with `warmth`.

    None is cold, and stays so where there is no resistance.
    """
    passed = until - segment.start
    if not contacts.resistance or passed <= 0.0 or math.isinf(passed):
        return warmth
    fallen = 0.0 if warmth is None else warmth * math.exp(-passed / contacts.heating_time)
    times, weights = segment.nodes_between(segment.start, until)
    felt = weights * np.exp((times - until) / contacts.heating_time) / contacts.heating_time
    return fallen + _tends_to(contacts, segment, times) @ felt


def next_update(contacts: Contacts, warmth: FloatArray | None, segment: Segment) -> Segment:
    """Return the segment, cut short where its contacts will have warmed up or cooled under the supply's current by then."""
    due = segment.start + contacts.heating_time / _STEPS
    if not contacts.resistance or segment.supply_mode == "off" or due >= segment.end:
        return segment
    change = _tends_to(contacts, segment, np.array([due]))[:, 0] - (0.0 if warmth is None else warmth)
    if np.abs(change).max() < _SETTLED:
        return segment
    return replace(segment, end=due, outcome="none")


def _tends_to(contacts: Contacts, segment: Segment, times: FloatArray) -> FloatArray:
    return (segment.terminal_currents(times) / contacts.doubling_current) ** 2
