"""The channels of an oscilloscope: scale, offset, probe and input of each, below the header CHANnel<n>."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

from sim_instruments.instruments.errors import ScopeErrors
from sim_instruments.instruments.oscilloscope.record import DIVISIONS, Vertical
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.tree import Call, CommandTree

CHANNELS = 4
CHANNEL = "CHANnel<n>"
#: Names of a channel, and its answer.
SOURCES = {name: f"CHAN{n}" for n in range(1, CHANNELS + 1) for name in (f"CHAN{n}", f"CHANNEL{n}")}


@dataclass(frozen=True)
class ChannelWords:
    """A make's commands and scales of its channels.

    `scales` are the least and the greatest V a division at the input, `ampere` the word for a current probe's unit, `limited` the
    answers of the bandwidth limit. `offset_sign` is −1 where what is set is added to the trace, which moves by whole `offset_step`
    (divisions) where that is not 0. The screen is `steps` of the converter high, round the code `middle`.
    """

    scales: tuple[float, float] = (1.0e-3, 5.0)
    ampere: str = "AMPere"
    couplings: Sequence[str] = ("AC", "DC")
    limited: tuple[str, str] = ("0", "1")
    offset_sign: float = 1.0
    offset_step: float = 0.0
    steps: int = 200
    middle: int = 128


class ChannelSubsystem:
    """State of the channels; `changed` is called when a running acquisition is to follow, `rescaled` with a channel and the factor
    by which all that is set at its probe's tip has changed.
    """

    def __init__(
        self,
        tree: CommandTree,
        settings: ScpiSettings,
        errors: ScopeErrors,
        words: ChannelWords,
        changed: Callable[[], None],
        rescaled: Callable[[int, float], None],
    ) -> None:
        self._settings, self._errors, self._words = settings, errors, words
        self._changed, self._rescaled = changed, rescaled
        self.reset()
        self._add_commands(tree)

    def reset(self) -> None:
        """Return to the greatest scale round zero, by probes of 1:1."""
        self._scales, self._offsets, self._probes = (
            [self._words.scales[1]] * CHANNELS,
            [0.0] * CHANNELS,
            [1.0] * CHANNELS,
        )

    def shown(self) -> list[int]:
        """Return the channels that the screen shows."""
        return [channel for channel in range(1, CHANNELS + 1) if self._settings.flag("display", channel)]

    def scale(self, channel: int) -> float:
        """Return a channel's vertical scale (V or A a division, at the probe's tip)."""
        return self._scales[channel - 1]

    def offset(self, channel: int) -> float:
        """Return what a channel has at the middle of the screen (V or A)."""
        words, offset = self._words, self._words.offset_sign * self._offsets[channel - 1]
        step = words.offset_step * self.scale(channel)
        return round(offset / step) * step if step else offset

    def unit(self, channel: int) -> str:
        """Return the unit of what a channel's probe senses."""
        return "V" if self._settings.word("unit", channel) == "VOLT" else "A"

    def vertical(self, channel: int, kind: str, averages: int, automatic_bits: int) -> Vertical:
        """Return how a channel is read by this kind of acquisition, of so many averages, by a converter of so many bits."""
        settings, index = self._settings, channel - 1
        factor = 0.6 if settings.flag("limit", channel) else 1.0
        if kind == "HRES":
            factor *= 0.25
        elif kind == "AVER":
            factor /= math.sqrt(averages)
        through = self.let_through(channel)
        return Vertical(
            self._scales[index],
            self.offset(channel),
            self._probes[index],
            settings.flag("invert", channel),
            settings.word("coupling", channel) == "AC",
            through * (1.0 + self._errors.reference + self._errors.gain[index]) - 1.0,
            self._errors.offset[index],
            max(automatic_bits, 12) if kind in ("HRES", "AVER") else automatic_bits,
            factor,
            self.skew(channel),
            self._words.steps,
            self._words.middle,
        )

    def let_through(self, channel: int) -> float:
        """Return the share of what its probe gives that comes through a channel's input."""
        return 0.0 if self._settings.word("coupling", channel) == "GND" else 1.0

    def skew(self, channel: int) -> float:
        """Return the time (s) by which a channel's trace is shown late."""
        return 0.0

    def _add_commands(self, tree: CommandTree) -> None:
        put, changed = self._settings, lambda _: self._changed()
        put.add_flag("display", f"{CHANNEL}:DISPlay", True, count=CHANNELS, changed=changed)
        put.add_choice("coupling", f"{CHANNEL}:COUPling", self._words.couplings, "DC", count=CHANNELS, changed=changed)
        put.add_flag("limit", f"{CHANNEL}:BWLimit", False, count=CHANNELS, changed=changed, replies=self._words.limited)
        put.add_flag("invert", f"{CHANNEL}:INVert", False, count=CHANNELS, changed=changed)
        put.add_choice("unit", f"{CHANNEL}:UNITs", ("VOLT", self._words.ampere), "VOLT", count=CHANNELS)
        for node, divisions in (("SCALe", 1.0), ("RANGe", float(DIVISIONS))):
            scale, asked = partial(self._set_scale, divisions), partial(self._get_scale, divisions)
            tree.add(f"{CHANNEL}:{node}", command=scale, query=asked)
        tree.add(f"{CHANNEL}:OFFSet", command=self._set_offset, query=self._get_offset)
        tree.add(f"{CHANNEL}:PROBe", command=self._set_probe, query=self._get_probe)

    @staticmethod
    def _index(call: Call) -> int:
        if not 1 <= call.channel <= CHANNELS:
            raise ScpiError(-114)
        return call.channel - 1

    def _set_scale(self, divisions: float, call: Call) -> None:
        index = self._index(call)
        exactly(call.arguments, 1)
        low, high = (scale * self._probes[index] * divisions for scale in self._words.scales)
        self._scales[index] = number(call.arguments[0], low, high, unit=self.unit(index + 1)) / divisions
        self._changed()

    def _get_scale(self, divisions: float, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{self._scales[self._index(call)] * divisions:+.8E}"

    def _set_offset(self, call: Call) -> None:
        index = self._index(call)
        exactly(call.arguments, 1)
        limit = self.highest_offset(self._scales[index] / self._probes[index]) * self._probes[index]
        self._offsets[index] = number(call.arguments[0], -limit, limit, default=0.0, unit=self.unit(index + 1))
        self._changed()

    def highest_offset(self, scale: float) -> float:
        """Return how far the offset goes (V at the input) at a scale (V a division at the input)."""
        return 2.0 if scale < 0.2 else 50.0

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
