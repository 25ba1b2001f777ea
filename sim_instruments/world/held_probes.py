"""What an oscilloscope's probes have sensed over a stretch of time, worked out when the record is read."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from sim_instruments.world.history import Past
from sim_instruments.world.settings import FloatArray


@dataclass(frozen=True)
class InTerminal:
    """Place of a current probe: the row of its terminal, and −1 where it is the wrong way round."""

    row: int
    sign: int


#: Of a voltage probe the rows of its two nodes: A, B, C, N, the artificial star, the Hall sensors' leads with H0 last, the supply's output.
Place = tuple[int, int] | InTerminal
#: The row of H1; H0 is three below.
FIRST_HALL = 5
#: The row of the supply's plus; its minus follows.
FIRST_SUPPLY = 9


class HeldProbes:
    """Signals of the channels at times of a stretch of the past, the probes being where they were then.

    Channels are mostly read one after the other at the same times: what they have in common is kept.
    """

    def __init__(self, past: Past, places: Mapping[int, Place]) -> None:
        self._past = past
        self._places = dict(places)
        self._times: FloatArray = np.zeros(0)
        self._nodes: FloatArray | None = None
        self._halls: FloatArray | None = None

    def signal(self, channel: int, times: FloatArray) -> FloatArray:
        """Return the true signal (V or A, shape (n,)) of a channel's probe; without a probe it is zero."""
        place = self._places.get(channel)
        if place is None or not len(times):
            return np.zeros_like(times)
        if isinstance(place, InTerminal):
            return place.sign * self._past.sample(lambda segment, at: segment.terminal_currents(at)[place.row], times)
        if not np.array_equal(times, self._times):
            self._times, self._nodes, self._halls = times, None, None
        result: FloatArray = self._potential(place[0], times) - self._potential(place[1], times)
        return result

    def _potential(self, row: int, times: FloatArray) -> FloatArray:
        if row < FIRST_HALL:
            if self._nodes is None:
                self._nodes = self._past.sample(lambda segment, at: segment.node_potentials(at), times)
            nodes: FloatArray = self._nodes[row]
            return nodes
        if row == FIRST_SUPPLY:
            return self._past.sample(lambda segment, at: segment.output_voltage(at), times)
        if row in (FIRST_HALL + 3, FIRST_SUPPLY + 1):
            return np.zeros_like(times)
        if self._halls is None:
            self._halls = self._past.sample(lambda segment, at: segment.hall_voltages(at), times)
        voltages: FloatArray = self._halls[row - FIRST_HALL]
        return voltages
