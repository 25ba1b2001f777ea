"""Probes of the virtual oscilloscope: what each channel touches."""

from dataclasses import dataclass
from typing import Literal

from sim_instruments.settings import Terminal

Node = Literal["A", "B", "C", "N", "star"]

NODES: tuple[Node, ...] = ("A", "B", "C", "N", "star")


@dataclass(frozen=True)
class VoltageProbe:
    """Differential voltage between two nodes."""

    positive: Node
    negative: Node


@dataclass(frozen=True)
class CurrentProbe:
    """Current into a terminal."""

    terminal: Terminal


Probe = VoltageProbe | CurrentProbe
