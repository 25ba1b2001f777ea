"""Miswirings of hands: wires, leads and probes elsewhere than requested."""

from typing import TYPE_CHECKING, Literal

from pydantic import Field, model_validator

from sim_instruments.faults.description import ActiveFault, Description, MaybeCount
from sim_instruments.world.probes import Node
from sim_instruments.world.settings import Socket, Terminal

if TYPE_CHECKING:
    from sim_instruments.faults.target import FaultTarget


class MisClipped(Description):
    """Clip a terminal's wire elsewhere than requested, or in the place of another: at the `connection`-th from then, null at every one."""

    fault: Literal["mis_clipped"]
    terminal: Terminal
    socket: Socket | None = None
    exchanged_with: Terminal | None = None
    connection: MaybeCount = 1

    @model_validator(mode="after")
    def _one_way(self) -> "MisClipped":
        if (self.socket is None) == (self.exchanged_with is None):
            raise ValueError("give either socket or exchanged_with, one of the two")
        if self.exchanged_with == self.terminal:
            raise ValueError("exchanged_with must be another terminal")
        return self

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        miswirings = bench.world.miswirings
        if self.socket is not None:
            miswirings.wire(self.terminal, self.socket, self.connection)
        elif self.exchanged_with is not None:
            miswirings.exchange(self.terminal, self.exchanged_with, self.connection)
        return ActiveFault(miswirings.clear)


class MisPlaced(Description):
    """Put a channel's tip or reference (without a channel: the voltmeter's leads) on another node, "loose" being none."""

    fault: Literal["mis_placed"]
    channel: int | None = Field(default=None, ge=1, le=8)
    positive: Node | None = None
    negative: Node | None = None

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.miswirings.voltage_leads(self.channel, self.positive, self.negative)
        return ActiveFault(bench.world.miswirings.clear)


class MisClamped(Description):
    """Clip a channel's current probe round another wire, or turned round."""

    fault: Literal["mis_clamped"]
    channel: int = Field(ge=1, le=8)
    terminal: Terminal | None = None
    turned: bool = False

    def begin(self, bench: "FaultTarget") -> ActiveFault:
        """Do it."""
        bench.world.miswirings.current_probe(self.channel, self.terminal, turned=self.turned)
        return ActiveFault(bench.world.miswirings.clear)
