"""Keysight InfiniiVision DSOX3024T (3000T X-Series programmer's guide): channels, time base, trigger, acquisition."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.disturbances.channel import ChannelPath
from sim_instruments.instruments.errors import ScopeErrors
from sim_instruments.instruments.keysight.infiniivision_acquisition import AC_CORNER, Acquisition
from sim_instruments.instruments.keysight.infiniivision_arming import Setup
from sim_instruments.instruments.keysight.infiniivision_measure import MeasureSubsystem
from sim_instruments.instruments.keysight.infiniivision_record import DIVISIONS, Vertical
from sim_instruments.instruments.keysight.infiniivision_screen import screen_block
from sim_instruments.instruments.keysight.infiniivision_setup import SetupSubsystem
from sim_instruments.instruments.keysight.infiniivision_trigger import Edge, Slope
from sim_instruments.instruments.keysight.infiniivision_waveform import WaveformSubsystem
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.parameters import choice, choices, exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, Handling, bare

if TYPE_CHECKING:
    from sim_instruments.world.world import World

CHANNELS = 4
SOURCES = {
    **{f"CHAN{n}": f"CHAN{n}" for n in range(1, CHANNELS + 1)},
    **{f"CHANNEL{n}": f"CHAN{n}" for n in range(1, CHANNELS + 1)},
}
#: Corner (Hz) of the rejection of low and of high frequencies in the trigger's path, and of its couplings.
_REJECTION = 50.0e3
_TRIGGER_CORNERS = {"DC": 0.0, "AC": AC_CORNER, "LFR": _REJECTION}
_TRIGGER_SOURCES = {**SOURCES, **choices(("EXTernal", "LINE"))}
_REJECTED = choices(("OFF", "LFReject", "HFReject"))
_CLEAR = choices(("CLEar",))
_RUN_BIT, _WAIT_BIT = 0x08, 0x20
_MEMORY = 4_000_000
_RATE = 5.0e9
_POLL_TIME = 1.0e-3
_REFERENCES = {"LEFT": 0.1, "CENT": 0.5, "RIGH": 0.9}
_MINIMUM_SCALE, _MAXIMUM_SCALE = 1.0e-3, 5.0
_HYSTERESIS_DIVISIONS = 0.1
#: What 50 Ω leave behind the 9 MΩ of a passive probe, times its ratio; probes of a lower ratio are taken to feed them.
_PASSIVE_PROBE, _LOADED = 5.0, 10.0 * 50.0 / (9.0e6 + 50.0)


class KeysightInfiniiVision(ScpiInstrument):
    """Simulated side of the oscilloscope; `bits` is its converter's resolution outside the high-resolution mode."""

    channels = CHANNELS
    leftovers = (
        *(("", f"CHAN{n}:INV ON") for n in range(1, CHANNELS + 1)),
        *(("", f"CHAN{n}:BWL ON") for n in range(1, CHANNELS + 1)),
        *(("", f"CHAN{n}:COUP AC") for n in range(1, CHANNELS + 1)),
        *(("", "", f"CHAN{n}:IMP FIFT") for n in range(1, CHANNELS + 1)),
        *(("", f"CHAN{n}:PROB:SKEW 5E-8") for n in range(1, CHANNELS + 1)),
        *(("", f"CHAN{n}:DISP ON", f"CHAN{n}:DISP OFF") for n in range(1, CHANNELS + 1)),
        *(("", f"CHAN{n}:UNIT AMP;PROB 100") for n in range(1, CHANNELS + 1)),
        ("", "TRIG:COUP AC", "TRIG:COUP LFR"),
        ("", "TRIG:HOLD 0.5"),
        ("", "TRIG:HFR ON"),
        ("", "TRIG:NREJ ON"),
        ("", "TRIG:SLOP NEG;SOUR EXT", "TRIG:SWE NORM"),
        ("", "ACQ:TYPE AVER;COUN 64", "ACQ:TYPE PEAK", "ACQ:TYPE HRES"),
        ("", "TIM:REF LEFT;POS 0.1", "TIM:MODE WIND", "TIM:MODE ROLL"),
        ("", "WAV:FORM ASC", "WAV:BYT LSBF", "WAV:UNS OFF", "WAV:POIN 100"),
        ("", "STOP", "SING"),
    )

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: ScopeErrors | None = None,
        *,
        bits: int = 8,
        serial: str = "MY60101234",
    ) -> None:
        if not 8 <= bits <= 12:
            raise ValueError(f"a converter of {bits} bits is not known here; allowed are 8 … 12")
        identity = f"KEYSIGHT TECHNOLOGIES,DSO-X 3024T,{serial},07.40.2021031200"
        super().__init__(world.clock, generator, identity, queue_depth=30)
        self._errors = errors or ScopeErrors()
        self._bits = bits
        self.acquisition = Acquisition(
            world.clock.now,
            world.probe_signal,
            world.hold_probes,
            generator,
            self._errors.time_base,
            world.disturbances.channel,
        )
        self.settings = ScpiSettings(self.tree, "+.8E")
        self._add_channels()
        self._add_time_base()
        self._add_trigger()
        self._add_acquire()
        self._add_root()
        self._waveform = WaveformSubsystem(self.tree, self.settings, self.acquisition, self._available)
        self._measure = MeasureSubsystem(self.tree, self.acquisition)
        SetupSubsystem(self.tree, self.settings, self.reset)
        self.tree.add("DISPlay:DATA", query=self._screen)
        self._stop_listening = world.clock.on_advance(self.acquisition.on_advance)
        self.reset()

    def close(self) -> None:
        """Stop following the clock."""
        self._stop_listening()

    def reset(self) -> None:
        """Return to the default setup: channel 1, 5 V/div, 100 µs/div, running with automatic trigger."""
        self.settings.reset()
        self._waveform.reset()
        self._measure.reset()
        self._source = "CHAN1"
        self._scales, self._offsets, self._probes = [5.0] * CHANNELS, [0.0] * CHANNELS, [1.0] * CHANNELS
        for channel in range(2, CHANNELS + 1):
            self.settings.put("display", False, channel)
        self._levels = dict.fromkeys(range(1, CHANNELS + 1), 0.0)
        self.acquisition.run(self._setup())

    def give_up(self, busy: bool) -> None:
        """Give up a :DIGitize that is waited for, too."""
        if busy:
            self.acquisition.stop()
        super().give_up(busy)

    def catch_up(self) -> bool:
        """Look for the trigger a little further; return whether there is more to look through."""
        return self.acquisition.catch_up()

    def pending(self) -> float | None:
        """Return when to look again whether the single acquisition is done."""
        return self.acquisition.next_look()

    # channels

    def _add_channels(self) -> None:
        put = self.settings
        channel = "CHANnel<n>"
        put.add_flag("display", f"{channel}:DISPlay", True, count=CHANNELS, changed=self._rearm)
        put.add_choice("coupling", f"{channel}:COUPling", ("AC", "DC"), "DC", count=CHANNELS, changed=self._rearm)
        put.add_choice(
            "impedance", f"{channel}:IMPedance", ("ONEMeg", "FIFTy"), "ONEM", count=CHANNELS, changed=self._rearm
        )
        put.add_flag("limit", f"{channel}:BWLimit", False, count=CHANNELS, changed=self._rearm)
        put.add_flag("invert", f"{channel}:INVert", False, count=CHANNELS, changed=self._rearm)
        put.add_choice("unit", f"{channel}:UNITs", ("VOLT", "AMPere"), "VOLT", count=CHANNELS)
        put.add_string("label", f"{channel}:LABel", "", count=CHANNELS)
        put.add_choice("signal type", f"{channel}:PROBe:STYPe", ("DIFFerential", "SINGle"), "SING", count=CHANNELS)
        put.add_flag("vernier", f"{channel}:VERNier", False, count=CHANNELS)
        put.add_number(
            "skew", f"{channel}:PROBe:SKEW", -1.0e-7, 1.0e-7, 0.0, unit="S", count=CHANNELS, changed=self._rearm
        )
        self._scales = [5.0] * CHANNELS
        self._offsets = [0.0] * CHANNELS
        self._probes = [1.0] * CHANNELS
        add = self.tree.add
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
        unit = "V" if self.settings.word("unit", index + 1) == "VOLT" else "A"
        value = number(call.arguments[0], _MINIMUM_SCALE * probe, _MAXIMUM_SCALE * probe, unit=unit)
        self._scales[index] = value / divisions
        self._rearm()

    def _get_scale(self, call: Call, divisions: float) -> str:
        exactly(call.arguments, 0)
        return f"{self._scales[self._index(call)] * divisions:+.8E}"

    def _set_offset(self, call: Call) -> None:
        index = self._index(call)
        exactly(call.arguments, 1)
        unit = "V" if self.settings.word("unit", index + 1) == "VOLT" else "A"
        limit = (2.0 if self._scales[index] / self._probes[index] < 0.2 else 50.0) * self._probes[index]
        self._offsets[index] = number(call.arguments[0], -limit, limit, default=0.0, unit=unit)
        self._rearm()

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
        self._levels[index + 1] *= factor
        self._rearm()

    def _get_probe(self, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{self._probes[self._index(call)]:+.8E}"

    def _vertical(self, channel: int, automatic_bits: int) -> Vertical:
        settings, index = self.settings, channel - 1
        kind = settings.word("type")
        factor = 0.6 if settings.flag("limit", channel) else 1.0
        if kind == "HRES":
            factor *= 0.25
        elif kind == "AVER":
            factor /= math.sqrt(self._averages())
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

    # time base

    def _add_time_base(self) -> None:
        put = self.settings
        put.add_choice("mode", "TIMebase:MODE", ("MAIN", "WINDow", "XY", "ROLL"), "MAIN")
        put.add_choice("reference", "TIMebase:REFerence", ("LEFT", "CENTer", "RIGHt"), "CENT", changed=self._rearm)
        put.add_number("range", "TIMebase:RANGe", 2.0e-8, 500.0, 1.0e-3, unit="S", changed=self._rearm)
        put.add_number("position", "TIMebase:POSition", -500.0, 500.0, 0.0, unit="S", changed=self._rearm)
        self.tree.add("TIMebase:SCALe", command=self._set_time_scale, query=self._get_time_scale)

    def _set_time_scale(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self.settings.put("range", 10.0 * number(call.arguments[0], 2.0e-9, 50.0, unit="S"))
        self._rearm()

    def _get_time_scale(self, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{self.settings.number('range') / 10.0:+.8E}"

    # trigger

    def _add_trigger(self) -> None:
        put = self.settings
        put.add_choice("trigger_mode", "TRIGger:MODE", ("EDGE",), "EDGE")
        put.add_choice("sweep", "TRIGger:SWEep", ("AUTO", "NORMal"), "AUTO", changed=self._rearm)
        put.add_number("holdoff", "TRIGger:HOLDoff", 4.0e-8, 10.0, 4.0e-8, unit="S", changed=self._rearm)
        put.add_flag("noise_reject", "TRIGger:NREJect", False, changed=self._rearm)
        put.add_flag("hf_reject", "TRIGger:HFReject", False, changed=self._rearm)
        put.add_choice(
            "slope",
            "TRIGger[:EDGE]:SLOPe",
            ("POSitive", "NEGative", "EITHer", "ALTernate"),
            "POS",
            changed=self._rearm,
        )
        couplings = ("AC", "DC", "LFReject")
        put.add_choice("trigger_coupling", "TRIGger[:EDGE]:COUPling", couplings, "DC", changed=self._rearm)
        self._source = "CHAN1"
        self._levels = dict.fromkeys(range(1, CHANNELS + 1), 0.0)
        self.tree.add("TRIGger[:EDGE]:SOURce", command=self._set_source, query=bare(lambda: self._source))
        self.tree.add("TRIGger[:EDGE]:LEVel", command=self._set_level, query=self._get_level)
        self.tree.add("TRIGger[:EDGE]:REJect", command=self._set_reject, query=bare(self._reject))
        self.tree.add("TRIGger:FORCe", command=bare(lambda: self.acquisition.force()))

    def _set_source(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._source = choice(call.arguments[0], _TRIGGER_SOURCES)
        self._rearm()

    def _set_reject(self, call: Call) -> None:
        """Set one rejection: that of low frequencies is the coupling's, too."""
        exactly(call.arguments, 1)
        rejected = choice(call.arguments[0], _REJECTED)
        if rejected == "LFR" or self.settings.word("trigger_coupling") == "LFR":
            self.settings.put("trigger_coupling", "LFR" if rejected == "LFR" else "DC")
        self.settings.put("hf_reject", rejected == "HFR")
        self._rearm()

    def _reject(self) -> str:
        if self.settings.word("trigger_coupling") == "LFR":
            return "LFR"
        return "HFR" if self.settings.flag("hf_reject") else "OFF"

    def _level_channel(self, call: Call, position: int) -> int:
        source = choice(call.arguments[position], SOURCES) if len(call.arguments) > position else self._source
        if source not in SOURCES:
            raise ScpiError(-221)
        return int(source[-1])

    def _set_level(self, call: Call) -> None:
        exactly(call.arguments, 1, 2)
        channel = self._level_channel(call, 1)
        limit = 0.75 * DIVISIONS * self._scales[channel - 1]
        center = self._offsets[channel - 1]
        unit = "V" if self.settings.word("unit", channel) == "VOLT" else "A"
        self._levels[channel] = number(call.arguments[0], center - limit, center + limit, unit=unit)
        self._rearm()

    def _get_level(self, call: Call) -> str:
        exactly(call.arguments, 0, 1)
        return f"{self._levels[self._level_channel(call, 0)]:+.8E}"

    # acquisition

    def _add_acquire(self) -> None:
        put = self.settings
        put.add_choice(
            "type", "ACQuire:TYPE", ("NORMal", "AVERage", "HRESolution", "PEAK"), "NORM", changed=self._rearm
        )
        put.add_choice("acquire_mode", "ACQuire:MODE", ("RTIMe", "SEGMented"), "RTIM", changed=self._refuse_segments)
        put.add_integer("averages", "ACQuire:COUNt", 2, 65536, 8, changed=self._rearm)
        put.add_integer("complete", "ACQuire:COMPlete", 100, 100, 100)
        self.tree.add("ACQuire:SRATe[:ANALog]", query=bare(lambda: f"{self._rate():+.8E}"))
        self.tree.add("ACQuire:POINts[:ANALog]", query=bare(lambda: f"{self._available():+d}"))

    def _refuse_segments(self, _: int) -> None:
        if self.settings.word("acquire_mode") == "SEGM":
            self.settings.put("acquire_mode", "RTIM")
            raise ScpiError(-241)

    def _averages(self) -> int:
        return round(self.settings.number("averages")) if self.settings.word("type") == "AVER" else 1

    def _shown(self) -> list[int]:
        return [channel for channel in range(1, CHANNELS + 1) if self.settings.flag("display", channel)]

    def _rate(self) -> float:
        """Return the sample rate (1/s): both halves of an interleaved pair share converter and memory."""
        shown = set(self._shown())
        share = 2 if {1, 2} <= shown or {3, 4} <= shown else 1
        limit = min(_RATE / share, _MEMORY / share / self.settings.number("range"))
        decade = 10.0 ** math.floor(math.log10(limit) + 1.0e-9)
        return max(step * decade for step in (1.0, 2.0, 2.5, 5.0) if step * decade <= limit * (1.0 + 1.0e-9))

    def _available(self) -> int:
        return max(1, round(self._rate() * self.settings.number("range")))

    def _setup(self) -> Setup:
        settings = self.settings
        span = settings.number("range")
        origin = settings.number("position") - _REFERENCES[settings.word("reference")] * span
        verticals = {channel: self._vertical(channel, self._bits) for channel in range(1, CHANNELS + 1)}
        channel = int(self._source[-1]) if self._source in SOURCES else 0
        slope: Slope = {"POS": "POS", "NEG": "NEG"}.get(settings.word("slope"), "EITH")  # type: ignore[assignment]
        source = verticals.get(channel)
        factor = 3.0 if settings.flag("noise_reject") else 1.0
        hysteresis = factor * _HYSTERESIS_DIVISIONS * (source.scale if source else 0.0)
        return Setup(
            origin,
            span,
            self._available(),
            verticals,
            source,
            channel,
            Edge(self._levels.get(channel, 0.0), slope, hysteresis),
            settings.word("sweep") == "AUTO",
            self._averages(),
            settings.number("holdoff"),
            self._trigger_path(),
        )

    def _trigger_path(self) -> ChannelPath:
        settings = self.settings
        corner = _TRIGGER_CORNERS[settings.word("trigger_coupling")]
        pole = _REJECTION if settings.flag("hf_reject") else math.inf
        return ChannelPath(coupling_corner=corner, pole=pole)

    def _rearm(self, _: int = 1) -> None:
        """Have a running acquisition go on with the new setting."""
        state = self.acquisition.state
        if state == "RUN":
            self.acquisition.run(self._setup())
        elif state == "SING":
            self.acquisition.single(self._setup())

    # root

    def _add_root(self) -> None:
        add = self.tree.add
        # As the default setup, preferences apart, which this one has none of.
        add("SYSTem:PRESet", command=bare(self.reset))
        add("RUN", command=bare(lambda: self.acquisition.run(self._setup())))
        add("STOP", command=bare(lambda: self.acquisition.stop()))
        add("SINGle", command=bare(lambda: self.acquisition.single(self._setup())))
        add("DIGitize", command=self._digitize)
        add("TER", query=bare(lambda: self._polled(lambda: f"{int(self.acquisition.take_trigger_event()):+d}")))
        add("RSTate", query=bare(lambda: self._polled(lambda: self.acquisition.state)))
        add("VIEW", command=lambda call: self._show(call, True))
        add("BLANk", command=lambda call: self._show(call, False))
        self.settings.add_string("message", "SYSTem:DSP", "")
        self.settings.add_flag("locked", "SYSTem:LOCK", False)
        add("DISPlay:CLEar", command=bare(lambda: None))
        operation = StatusRegister(self._operation)
        self._registers.append((0x80, operation))
        add("OPERegister:CONDition", query=bare(lambda: self._polled(lambda: f"{operation.condition():+d}")))
        add("OPERegister[:EVENt]", query=bare(lambda: f"{operation.read_event():+d}"))

        def enable(call: Call) -> None:
            exactly(call.arguments, 1)
            operation.enable = round(number(call.arguments[0], 0, 32767))

        add("OPEE", command=enable, query=bare(lambda: f"{operation.enable:+d}"))

    def _polled(self, reply: Callable[[], str]) -> str | Handling:
        """Have a poll of a running acquisition take the time of a query, so that polling alone lets it end."""
        if self.acquisition.state == "STOP":
            return reply()

        def later() -> Handling:
            yield self.clock.now() + _POLL_TIME
            return reply()

        return later()

    def _operation(self) -> int:
        bits = _RUN_BIT if self.acquisition.state != "STOP" else 0
        return bits | (_WAIT_BIT if self.acquisition.waiting() else 0)

    def _show(self, call: Call, shown: bool) -> None:
        exactly(call.arguments, 0 if not shown else 1, 1)
        channels = [int(choice(argument, SOURCES)[-1]) for argument in call.arguments]
        for channel in channels or range(1, CHANNELS + 1):
            self.settings.put("display", shown, channel)
        self._rearm()

    def _screen(self, call: Call) -> bytes:
        return screen_block(call, self.acquisition.record(), self._shown())

    def _digitize(self, call: Call) -> Handling:
        channels = [int(choice(argument, SOURCES)[-1]) for argument in call.arguments]
        self.acquisition.stop()
        if channels:
            for channel in range(1, CHANNELS + 1):
                self.settings.put("display", channel in channels, channel)
        self.acquisition.single(self._setup())
        while (wake := self.pending()) is not None:
            yield wake
        return None
