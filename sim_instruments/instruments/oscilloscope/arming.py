"""The setup with which an acquisition of the oscilloscope is armed."""

from dataclasses import dataclass

from sim_instruments.disturbances.channel import CLEAR, ChannelPath
from sim_instruments.instruments.oscilloscope.edge import Edge
from sim_instruments.instruments.oscilloscope.record import Vertical


@dataclass(frozen=True)
class Setup:
    """The setup of an armed acquisition: `origin`, `span` and `holdoff` in s, `source` None if no channel triggers.

    `trigger_path` is what coupling and rejection of the trigger let through to it.
    """

    origin: float
    span: float
    available: int
    verticals: dict[int, Vertical]
    source: Vertical | None
    source_channel: int
    edge: Edge
    automatic: bool
    averages: int
    holdoff: float = 0.0
    trigger_path: ChannelPath = CLEAR

    @property
    def before(self) -> float:
        """Time (s) recorded before the trigger."""
        return max(0.0, -self.origin)

    @property
    def after(self) -> float:
        """Time (s) from the trigger to the end of the record."""
        return max(0.0, self.origin + self.span)

    @property
    def search_step(self) -> float:
        """Spacing (s) at which crossings are looked for."""
        return min(max(self.span / 400.0, 5.0e-6), 1.0e-3)
