"""Wires clipped elsewhere than told: what hands believe to have done and have not."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

from sim_instruments.world.probes import CurrentProbe, Node, VoltageProbe
from sim_instruments.world.settings import Socket, Terminal


@dataclass(frozen=True)
class _Wire:
    """One wire at a socket of its own, or two that have changed places; `occasion` None is every time."""

    terminals: tuple[Terminal, ...]
    socket: Socket | None
    occasion: int | None

    def of(self, told: Mapping[Terminal, Socket]) -> dict[Terminal, Socket]:
        if self.socket is not None:
            return {**told, self.terminals[0]: self.socket}
        first, second = self.terminals
        return {**told, first: told[second], second: told[first]}


@dataclass(frozen=True)
class _Sense:
    """Where the leads of a channel (None: the voltmeter) go instead; None is as told."""

    positive: Node | None = None
    negative: Node | None = None
    terminal: Terminal | None = None
    turned: bool = False


class Slips:
    """The slips that are to come. Occasions count from the next connection of the terminals, which is 1."""

    def __init__(self) -> None:
        self._wires: list[_Wire] = []
        self._senses: dict[int | None, _Sense] = {}

    def wire(self, terminal: Terminal, socket: Socket, occasion: int | None = 1) -> None:
        """Have a terminal's wire end at a socket, whatever is told; None for the occasion is every time."""
        self._wires.append(_Wire((terminal,), socket, occasion))

    def exchange(self, first: Terminal, second: Terminal, occasion: int | None = 1) -> None:
        """Have two terminals' wires change places."""
        self._wires.append(_Wire((first, second), None, occasion))

    def voltage_leads(self, channel: int | None, positive: Node | None = None, negative: Node | None = None) -> None:
        """Have a channel's tip or reference (None for the channel: the voltmeter's leads) on a node, "loose" being none."""
        self._senses[channel] = _Sense(positive, negative)

    def current_probe(self, channel: int, terminal: Terminal | None = None, *, turned: bool = False) -> None:
        """Have a channel's current probe round another wire, or turned round."""
        self._senses[channel] = _Sense(terminal=terminal, turned=turned)

    def clear(self) -> None:
        """Have hands do as they are told."""
        self._wires, self._senses = [], {}

    def listed(self) -> list[str]:
        """Return them in words, for the truth."""
        wires = [f"{'-'.join(slip.terminals)} → {slip.socket or 'exchanged'} ({slip.occasion})" for slip in self._wires]
        return wires + [f"channel {channel}: {slip}" for channel, slip in self._senses.items()]

    def connected(self, told: Mapping[Terminal, Socket]) -> dict[Terminal, Socket]:
        """Return where the wires really go, and count the occasion."""
        real = dict(told)
        for slip in self._wires:
            if slip.occasion in (None, 1):
                real = slip.of(real)
        self._wires = [
            slip if slip.occasion is None else replace(slip, occasion=slip.occasion - 1)
            for slip in self._wires
            if slip.occasion != 1
        ]
        return real

    def voltage(self, channel: int | None, told: VoltageProbe) -> VoltageProbe:
        """Return where a channel's voltage probe, or the voltmeter, really is."""
        slip = self._senses.get(channel, _Sense())
        return VoltageProbe(slip.positive or told.positive, slip.negative or told.negative)

    def current(self, channel: int, told: CurrentProbe) -> CurrentProbe:
        """Return where a channel's current probe really is."""
        slip = self._senses.get(channel, _Sense())
        return CurrentProbe(slip.terminal or told.terminal, -told.sign if slip.turned else told.sign)
