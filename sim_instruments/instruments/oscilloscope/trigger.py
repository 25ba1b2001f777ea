"""The edge trigger of an oscilloscope: source, level, slope, coupling, below the header TRIGger."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.instruments.oscilloscope.acquisition import AC_CORNER
from sim_instruments.instruments.oscilloscope.channels import CHANNELS, SOURCES, ChannelSubsystem
from sim_instruments.instruments.oscilloscope.edge import Edge, Slope
from sim_instruments.instruments.oscilloscope.record import DIVISIONS
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import choice, choices, exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, bare

#: Corner (Hz) of the rejection of low and of high frequencies in the trigger's path, and of its couplings.
_REJECTION = 50.0e3
_CORNERS = {"DC": 0.0, "HFR": 0.0, "AC": AC_CORNER, "LFR": _REJECTION}
_TRIGGER_SOURCES = {**SOURCES, **choices(("EXTernal", "LINE"))}
_HYSTERESIS_DIVISIONS = 0.1


@dataclass(frozen=True)
class TriggerWords:
    """A make's commands of its edge trigger: its settings below `node`, the words of its `slopes` in the notation of the manual.

    `coupling` is a header by itself; `least_holdoff` in s.
    """

    slopes: Mapping[str, Slope]
    node: str = "TRIGger:EDGE"
    coupling: str = "TRIGger:COUPling"
    sweeps: Sequence[str] = ("AUTO", "NORMal")
    couplings: Sequence[str] = ("AC", "DC", "LFReject")
    least_holdoff: float = 4.0e-8


class TriggerSubsystem:
    """State of the edge trigger; `changed` is called when a running acquisition is to follow."""

    def __init__(
        self,
        tree: CommandTree,
        settings: ScpiSettings,
        channels: ChannelSubsystem,
        words: TriggerWords,
        changed: Callable[[], None],
    ) -> None:
        self._settings, self._channels, self._words, self._changed = settings, channels, words, changed
        self._meant = {short: slope for name, slope in words.slopes.items() for short in choices((name,)).values()}
        self.reset()
        self._add_commands(tree)

    def reset(self) -> None:
        """Return to the crossing of zero by channel 1."""
        self._source = "CHAN1"
        self._levels = dict.fromkeys(range(1, CHANNELS + 1), 0.0)

    @property
    def channel(self) -> int:
        """The channel that triggers, 0 for another source."""
        return int(self._source[-1]) if self._source in SOURCES else 0

    @property
    def automatic(self) -> bool:
        """True if a record is taken without a trigger, too."""
        return self._settings.word("sweep") == "AUTO"

    def rescale(self, channel: int, factor: float) -> None:
        """Rescale a channel's level with its probe's ratio."""
        self._levels[channel] *= factor

    def edge(self) -> Edge:
        """Return the edge to look for."""
        hysteresis = _HYSTERESIS_DIVISIONS * self._channels.scale(self.channel) if self.channel else 0.0
        factor = 3.0 if self._settings.flag("noise_reject") else 1.0
        slope = self._meant[self._settings.word("slope")]
        return Edge(self._levels.get(self.channel, 0.0), slope, factor * hysteresis)

    def path(self) -> ChannelPath:
        """Return what lies between the channel and the trigger."""
        coupling = self._settings.word("trigger_coupling")
        pole = _REJECTION if self._rejects_high or coupling == "HFR" else math.inf
        return ChannelPath(coupling_corner=_CORNERS[coupling], pole=pole)

    @property
    def _rejects_high(self) -> bool:
        return False

    def _add_commands(self, tree: CommandTree) -> None:
        put, changed = self._settings, lambda _: self._changed()
        put.add_choice("trigger_mode", "TRIGger:MODE", ("EDGE",), "EDGE")
        put.add_choice("sweep", "TRIGger:SWEep", self._words.sweeps, "AUTO", changed=changed)
        least = self._words.least_holdoff
        put.add_number("holdoff", "TRIGger:HOLDoff", least, 10.0, least, unit="S", changed=changed)
        put.add_flag("noise_reject", "TRIGger:NREJect", False, changed=changed)
        put.add_choice("slope", f"{self._words.node}:SLOPe", self._words.slopes, "POS", changed=changed)
        put.add_choice("trigger_coupling", self._words.coupling, self._words.couplings, "DC", changed=changed)
        tree.add(f"{self._words.node}:SOURce", command=self._set_source, query=bare(lambda: self._source))
        tree.add(f"{self._words.node}:LEVel", command=self._set_level, query=self._get_level)

    def _set_source(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._source = choice(call.arguments[0], _TRIGGER_SOURCES)
        self._changed()

    def _level_channel(self, call: Call, position: int) -> int:
        source = choice(call.arguments[position], SOURCES) if len(call.arguments) > position else self._source
        if source not in SOURCES:
            raise ScpiError(-221)
        return int(source[-1])

    def _set_level(self, call: Call) -> None:
        exactly(call.arguments, 1, 2)
        channel = self._level_channel(call, 1)
        limit = 0.75 * DIVISIONS * self._channels.scale(channel)
        center = self._channels.offset(channel)
        self._levels[channel] = number(
            call.arguments[0], center - limit, center + limit, unit=self._channels.unit(channel)
        )
        self._changed()

    def _get_level(self, call: Call) -> str:
        exactly(call.arguments, 0, 1)
        return f"{self._levels[self._level_channel(call, 0)]:+.8E}"
