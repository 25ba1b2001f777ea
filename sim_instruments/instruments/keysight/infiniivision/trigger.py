"""The :TRIGger subsystem of the InfiniiVision: source, level, slope and coupling of the edge."""

import math
from collections.abc import Callable

from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.instruments.keysight.infiniivision.acquisition import AC_CORNER
from sim_instruments.instruments.keysight.infiniivision.channels import CHANNELS, SOURCES, ChannelSubsystem
from sim_instruments.instruments.keysight.infiniivision.edge import Edge, Slope
from sim_instruments.instruments.keysight.infiniivision.record import DIVISIONS
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import choice, choices, exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, bare

#: Corner (Hz) of the rejection of low and of high frequencies in the trigger's path, and of its couplings.
_REJECTION = 50.0e3
_TRIGGER_CORNERS = {"DC": 0.0, "AC": AC_CORNER, "LFR": _REJECTION}
_TRIGGER_SOURCES = {**SOURCES, **choices(("EXTernal", "LINE"))}
_REJECTED = choices(("OFF", "LFReject", "HFReject"))


class TriggerSubsystem:
    """State of the edge trigger; `changed` is called when a running acquisition is to follow, `force` triggers it."""

    def __init__(
        self,
        tree: CommandTree,
        settings: ScpiSettings,
        channels: ChannelSubsystem,
        changed: Callable[[], None],
        force: Callable[[], None],
    ) -> None:
        self._settings, self._channels, self._changed = settings, channels, changed
        self.reset()
        self._add_commands(tree, force)

    def reset(self) -> None:
        """Return to the crossing of zero by channel 1."""
        self._source = "CHAN1"
        self._levels = dict.fromkeys(range(1, CHANNELS + 1), 0.0)

    @property
    def channel(self) -> int:
        """The channel that triggers, 0 for another source."""
        return int(self._source[-1]) if self._source in SOURCES else 0

    def rescale(self, channel: int, factor: float) -> None:
        """Have a channel's level follow its probe's ratio."""
        self._levels[channel] *= factor

    def edge(self, hysteresis: float) -> Edge:
        """Return the edge to look for, with a hysteresis (V or A) before noise is rejected."""
        slope: Slope = {"POS": "POS", "NEG": "NEG"}.get(self._settings.word("slope"), "EITH")  # type: ignore[assignment]
        factor = 3.0 if self._settings.flag("noise_reject") else 1.0
        return Edge(self._levels.get(self.channel, 0.0), slope, factor * hysteresis)

    def _add_commands(self, tree: CommandTree, force: Callable[[], None]) -> None:
        put, changed = self._settings, lambda _: self._changed()
        put.add_choice("trigger_mode", "TRIGger:MODE", ("EDGE",), "EDGE")
        put.add_choice("sweep", "TRIGger:SWEep", ("AUTO", "NORMal"), "AUTO", changed=changed)
        put.add_number("holdoff", "TRIGger:HOLDoff", 4.0e-8, 10.0, 4.0e-8, unit="S", changed=changed)
        put.add_flag("noise_reject", "TRIGger:NREJect", False, changed=changed)
        put.add_flag("hf_reject", "TRIGger:HFReject", False, changed=changed)
        put.add_choice(
            "slope",
            "TRIGger[:EDGE]:SLOPe",
            ("POSitive", "NEGative", "EITHer", "ALTernate"),
            "POS",
            changed=changed,
        )
        couplings = ("AC", "DC", "LFReject")
        put.add_choice("trigger_coupling", "TRIGger[:EDGE]:COUPling", couplings, "DC", changed=changed)
        tree.add("TRIGger[:EDGE]:SOURce", command=self._set_source, query=bare(lambda: self._source))
        tree.add("TRIGger[:EDGE]:LEVel", command=self._set_level, query=self._get_level)
        tree.add("TRIGger[:EDGE]:REJect", command=self._set_reject, query=bare(self._reject))
        tree.add("TRIGger:FORCe", command=bare(force))

    def _set_source(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._source = choice(call.arguments[0], _TRIGGER_SOURCES)
        self._changed()

    def _set_reject(self, call: Call) -> None:
        """Set one rejection: that of low frequencies is the coupling's, too."""
        exactly(call.arguments, 1)
        rejected = choice(call.arguments[0], _REJECTED)
        if rejected == "LFR" or self._settings.word("trigger_coupling") == "LFR":
            self._settings.put("trigger_coupling", "LFR" if rejected == "LFR" else "DC")
        self._settings.put("hf_reject", rejected == "HFR")
        self._changed()

    def _reject(self) -> str:
        if self._settings.word("trigger_coupling") == "LFR":
            return "LFR"
        return "HFR" if self._settings.flag("hf_reject") else "OFF"

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

    def path(self) -> ChannelPath:
        """Return what lies between the channel and the trigger."""
        settings = self._settings
        corner = _TRIGGER_CORNERS[settings.word("trigger_coupling")]
        pole = _REJECTION if settings.flag("hf_reject") else math.inf
        return ChannelPath(coupling_corner=corner, pole=pole)
