"""Probes of the virtual oscilloscope: what each channel touches."""

from dataclasses import dataclass
from typing import Literal

from sim_instruments.world.settings import Terminal

Node = Literal["A", "B", "C", "N", "star", "H1", "H2", "H3", "H0", "S+", "S-", "loose"]

NODES: tuple[Node, ...] = ("A", "B", "C", "N", "star", "S+", "S-", "loose")
#: The supply's own output, whatever it is connected to.
SUPPLY_NODES: tuple[Node, ...] = ("S+", "S-")
#: The leads of the Hall sensors, where the motor has them.
HALL_NODES: tuple[Node, ...] = ("H1", "H2", "H3", "H0")


@dataclass(frozen=True)
class PlacedVoltageProbe:
    """Differential voltage between two nodes; none where a lead is loose."""

    positive: Node
    negative: Node

    @property
    def loose(self) -> bool:
        """True if a lead touches nothing."""
        return "loose" in (self.positive, self.negative)


@dataclass(frozen=True)
class PlacedCurrentProbe:
    """Current into a terminal, `sign` −1 where the probe is the wrong way round."""

    terminal: Terminal
    sign: int = 1


Probe = PlacedVoltageProbe | PlacedCurrentProbe
