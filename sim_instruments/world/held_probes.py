"""The signals of an oscilloscope's probes over a stretch of time, computed when the record is read."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import cast

import numpy as np

from sim_instruments.world.history import History
from sim_instruments.world.probes import HALL_NODES, SUPPLY_NODES, Node, PlacedCurrentProbe, Probe
from sim_instruments.world.settings import TERMINALS, FloatArray, Terminal, WorldSettings


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


def node_row(node: Node, settings: WorldSettings) -> int:
    """Return the row of a node among the potentials, as the motor is wired. Raises ValueError for a loose lead."""
    if node == "N":
        return 3
    if node == "star":
        return 4
    if node == "loose":
        raise ValueError("node 'loose' has no potential")
    if node in HALL_NODES:
        return FIRST_HALL + HALL_NODES.index(node)
    if node in SUPPLY_NODES:
        return FIRST_SUPPLY + SUPPLY_NODES.index(node)
    return TERMINALS.index(settings.motor_terminal(cast("Terminal", node)))


def places(probes: Mapping[int, Probe], settings: WorldSettings) -> dict[int, Place]:
    """Return what each channel's probe is on; one with a loose lead is left out, it senses nothing."""
    result: dict[int, Place] = {}
    for channel, probe in probes.items():
        if isinstance(probe, PlacedCurrentProbe):
            result[channel] = InTerminal(TERMINALS.index(settings.motor_terminal(probe.terminal)), probe.sign)
        elif not probe.loose:
            result[channel] = node_row(probe.positive, settings), node_row(probe.negative, settings)
    return result


class HeldProbes:
    """Signals of the channels at times of a stretch of the past, the probes being where they were then.

    Channels are mostly read one after the other at the same times: what they have in common is kept.
    """

    def __init__(self, past: History, places: Mapping[int, Place]) -> None:
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
        return self._potential(place[0], times) - self._potential(place[1], times)

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
