"""Wires clipped elsewhere than requested: what hands believe to have done and have not."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sim_instruments.world.probes import Node, PlacedCurrentProbe, PlacedVoltageProbe
from sim_instruments.world.settings import Socket, Terminal


@dataclass(frozen=True)
class _Wire:
    """One wire at a socket of its own, or two that have changed places; `occasion` None is every time."""

    terminals: tuple[Terminal, ...]
    socket: Socket | None
    occasion: int | None

    def of(self, requested: Mapping[Terminal, Socket]) -> dict[Terminal, Socket]:
        if self.socket is not None:
            return {**requested, self.terminals[0]: self.socket}
        first, second = self.terminals
        return {**requested, first: requested[second], second: requested[first]}


@dataclass(frozen=True)
class _Sense:
    """Nodes that the leads of a channel (None: the voltmeter) go to by mistake; None is as requested."""

    positive: Node | None = None
    negative: Node | None = None
    terminal: Terminal | None = None
    turned: bool = False


class Miswirings:
    """The miswirings to come. Occasions count from the next connection of the terminals, which is 1."""

    def __init__(self) -> None:
        self._wires: list[_Wire] = []
        self._senses: dict[int | None, _Sense] = {}

    def wire(self, terminal: Terminal, socket: Socket, occasion: int | None = 1) -> None:
        """Connect a terminal's wire to a socket, whatever is requested; None for the occasion is every time."""
        self._wires.append(_Wire((terminal,), socket, occasion))

    def exchange(self, first: Terminal, second: Terminal, occasion: int | None = 1) -> None:
        """Exchange the wires of two terminals."""
        self._wires.append(_Wire((first, second), None, occasion))

    def voltage_leads(self, channel: int | None, positive: Node | None = None, negative: Node | None = None) -> None:
        """Connect a channel's tip or reference (None for the channel: the voltmeter's leads) to a node, "loose" being none."""
        self._senses[channel] = _Sense(positive, negative)

    def current_probe(self, channel: int, terminal: Terminal | None = None, *, turned: bool = False) -> None:
        """Put a channel's current probe round another wire, or turn it round."""
        self._senses[channel] = _Sense(terminal=terminal, turned=turned)

    def clear(self) -> None:
        """Remove all mistakes, so that connections are as requested."""
        self._wires, self._senses = [], {}

    def listed(self) -> list[str]:
        """Return them in words, for the actual state."""
        wires = [
            f"{'-'.join(miswiring.terminals)} → {miswiring.socket or 'exchanged'} ({miswiring.occasion})"
            for miswiring in self._wires
        ]
        return wires + [f"channel {channel}: {miswiring}" for channel, miswiring in self._senses.items()]

    def connected(self, requested: Mapping[Terminal, Socket]) -> dict[Terminal, Socket]:
        """Return where the wires go, and count the occasion."""
        real = dict(requested)
        for miswiring in self._wires:
            if miswiring.occasion in (None, 1):
                real = miswiring.of(real)
        self._wires = [
            miswiring if miswiring.occasion is None else replace(miswiring, occasion=miswiring.occasion - 1)
            for miswiring in self._wires
            if miswiring.occasion != 1
        ]
        return real

    def voltage(self, channel: int | None, requested: PlacedVoltageProbe) -> PlacedVoltageProbe:
        """Return where a channel's voltage probe, or the voltmeter, is."""
        miswiring = self._senses.get(channel, _Sense())
        return PlacedVoltageProbe(miswiring.positive or requested.positive, miswiring.negative or requested.negative)

    def current(self, channel: int, requested: PlacedCurrentProbe) -> PlacedCurrentProbe:
        """Return where a channel's current probe is."""
        miswiring = self._senses.get(channel, _Sense())
        return PlacedCurrentProbe(
            miswiring.terminal or requested.terminal, -requested.sign if miswiring.turned else requested.sign
        )
