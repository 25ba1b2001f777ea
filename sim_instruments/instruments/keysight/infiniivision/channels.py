"""The :CHANnel subsystem of the InfiniiVision: scale, offset, probe and input of each channel."""

import math
from collections.abc import Callable

from sim_instruments.instruments.errors import ScopeErrors
from sim_instruments.instruments.keysight.infiniivision.record import DIVISIONS, Vertical
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import choice, choices, exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree, bare

CHANNELS = 4
#: Names of a channel, and its answer.
SOURCES = {name: f"CHAN{n}" for n in range(1, CHANNELS + 1) for name in (f"CHAN{n}", f"CHANNEL{n}")}
_CLEAR = choices(("CLEar",))
_MINIMUM_SCALE, _MAXIMUM_SCALE = 1.0e-3, 5.0
#: What 50 Ω leave behind the 9 MΩ of a passive probe, times its ratio; probes of a lower ratio are taken to feed them.
_PASSIVE_PROBE, _LOADED = 5.0, 10.0 * 50.0 / (9.0e6 + 50.0)


class ChannelSubsystem:
    """State of the channels; `changed` is called when a running acquisition is to follow, `rescaled` with a channel and the factor
    by which all that is set at its probe's tip has changed.
    """

    def __init__(
        self,
        tree: CommandTree,
        settings: ScpiSettings,
        errors: ScopeErrors,
        changed: Callable[[], None],
        rescaled: Callable[[int, float], None],
    ) -> None:
        self._settings, self._errors = settings, errors
        self._changed, self._rescaled = changed, rescaled
        self.reset()
        self._add_commands(tree)

    def reset(self) -> None:
        """Return to 5 V/div round zero, by probes of 1:1."""
        self._scales, self._offsets, self._probes = [5.0] * CHANNELS, [0.0] * CHANNELS, [1.0] * CHANNELS

    def shown(self) -> list[int]:
        """Return the channels that the screen shows."""
        return [channel for channel in range(1, CHANNELS + 1) if self._settings.flag("display", channel)]

    def scale(self, channel: int) -> float:
        """Return a channel's vertical scale (V or A a division, at the probe's tip)."""
        return self._scales[channel - 1]

    def offset(self, channel: int) -> float:
        """Return what a channel has at the middle of the screen (V or A)."""
        return self._offsets[channel - 1]

    def unit(self, channel: int) -> str:
        """Return the unit of what a channel's probe senses."""
        return "V" if self._settings.word("unit", channel) == "VOLT" else "A"

    def _add_commands(self, tree: CommandTree) -> None:
        put, changed = self._settings, lambda _: self._changed()
        channel = "CHANnel<n>"
        put.add_flag("display", f"{channel}:DISPlay", True, count=CHANNELS, changed=changed)
        put.add_choice("coupling", f"{channel}:COUPling", ("AC", "DC"), "DC", count=CHANNELS, changed=changed)
        put.add_choice(
            "impedance", f"{channel}:IMPedance", ("ONEMeg", "FIFTy"), "ONEM", count=CHANNELS, changed=changed
        )
        put.add_flag("limit", f"{channel}:BWLimit", False, count=CHANNELS, changed=changed)
        put.add_flag("invert", f"{channel}:INVert", False, count=CHANNELS, changed=changed)
        put.add_choice("unit", f"{channel}:UNITs", ("VOLT", "AMPere"), "VOLT", count=CHANNELS)
        put.add_string("label", f"{channel}:LABel", "", count=CHANNELS)
        put.add_choice("signal type", f"{channel}:PROBe:STYPe", ("DIFFerential", "SINGle"), "SING", count=CHANNELS)
        put.add_flag("vernier", f"{channel}:VERNier", False, count=CHANNELS)
        put.add_number("skew", f"{channel}:PROBe:SKEW", -1.0e-7, 1.0e-7, 0.0, unit="S", count=CHANNELS, changed=changed)
        add = tree.add
        add(
            f"{channel}:SCALe",
            command=lambda call: self._set_scale(call, 1.0),
            query=lambda call: self._get_scale(call, 1.0),
        )
        add(
            f"{channel}:RANGe",
            command=lambda call: self._set_scale(call, float(DIVISIONS)),
            query=lambda call: self._get_scale(call, float(DIVISIONS)),
        )
        add(f"{channel}:OFFSet", command=self._set_offset, query=self._get_offset)
        add(f"{channel}:PROBe", command=self._set_probe, query=self._get_probe)
        add(f"{channel}:PROTection", command=self._clear_protection, query=bare(lambda: "NORM"))

    def _clear_protection(self, call: Call) -> None:
        self._index(call)
        exactly(call.arguments, 0, 1)
        for argument in call.arguments:
            choice(argument, _CLEAR)

    @staticmethod
    def _index(call: Call) -> int:
        if not 1 <= call.channel <= CHANNELS:
            raise ScpiError(-114)
        return call.channel - 1

    def _set_scale(self, call: Call, divisions: float) -> None:
        index = self._index(call)
        exactly(call.arguments, 1)
        probe = self._probes[index] * divisions
        value = number(call.arguments[0], _MINIMUM_SCALE * probe, _MAXIMUM_SCALE * probe, unit=self.unit(index + 1))
        self._scales[index] = value / divisions
        self._changed()

    def _get_scale(self, call: Call, divisions: float) -> str:
        exactly(call.arguments, 0)
        return f"{self._scales[self._index(call)] * divisions:+.8E}"

    def _set_offset(self, call: Call) -> None:
        index = self._index(call)
        exactly(call.arguments, 1)
        limit = (2.0 if self._scales[index] / self._probes[index] < 0.2 else 50.0) * self._probes[index]
        self._offsets[index] = number(call.arguments[0], -limit, limit, default=0.0, unit=self.unit(index + 1))
        self._changed()

    def _get_offset(self, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{self._offsets[self._index(call)]:+.8E}"

    def _set_probe(self, call: Call) -> None:
        index = self._index(call)
        exactly(call.arguments, 1)
        ratio = number(call.arguments[0], 1.0e-3, 1.0e4, unit="X")
        factor = ratio / self._probes[index]
        self._probes[index] = ratio
        # What is set at the probe's tip follows its ratio, the setting of the input stays.
        self._scales[index] *= factor
        self._offsets[index] *= factor
        self._rescaled(index + 1, factor)
        self._changed()

    def _get_probe(self, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{self._probes[self._index(call)]:+.8E}"

    def vertical(self, channel: int, kind: str, averages: int, automatic_bits: int) -> Vertical:
        """Return how a channel is read by this kind of acquisition, of so many averages, by a converter of so many bits."""
        settings, index = self._settings, channel - 1
        factor = 0.6 if settings.flag("limit", channel) else 1.0
        if kind == "HRES":
            factor *= 0.25
        elif kind == "AVER":
            factor /= math.sqrt(averages)
        passive = settings.word("unit", channel) == "VOLT" and self._probes[index] > _PASSIVE_PROBE
        loaded = _LOADED if passive and settings.word("impedance", channel) == "FIFT" else 1.0
        return Vertical(
            self._scales[index],
            self._offsets[index],
            self._probes[index],
            settings.flag("invert", channel),
            settings.word("coupling", channel) == "AC",
            loaded * (1.0 + self._errors.reference + self._errors.gain[index]) - 1.0,
            self._errors.offset[index],
            max(automatic_bits, 12) if kind in ("HRES", "AVER") else automatic_bits,
            factor,
            settings.number("skew", channel),
        )
