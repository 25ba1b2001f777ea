"""Keysight InfiniiVision DSOX3024T (3000T X-Series programmer's guide): channels, time base, trigger, acquisition."""

import math
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.catalogue import BenchPlace
from sim_instruments.instruments.errors import ScopeErrors
from sim_instruments.instruments.keysight.infiniivision.channels import InfiniiVisionChannels
from sim_instruments.instruments.keysight.infiniivision.measure import MeasureSubsystem
from sim_instruments.instruments.keysight.infiniivision.screen import screen_block
from sim_instruments.instruments.keysight.infiniivision.setup import SetupSubsystem
from sim_instruments.instruments.keysight.infiniivision.trigger import WORDS, InfiniiVisionTrigger
from sim_instruments.instruments.keysight.infiniivision.waveform import WaveformSubsystem
from sim_instruments.instruments.oscilloscope.channels import CHANNELS, SOURCES, ChannelWords
from sim_instruments.instruments.scpi_oscilloscope import SimulatedScpiOscilloscope
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import choice, exactly, number
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, Handling, bare

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_RUN_BIT, _WAIT_BIT = 0x08, 0x20
_MEMORY = 4_000_000
_RATE = 5.0e9
_REFERENCES = {"LEFT": 0.1, "CENT": 0.5, "RIGH": 0.9}


class KeysightInfiniiVision(SimulatedScpiOscilloscope):
    """Simulated side of the oscilloscope; `bits` is its converter's resolution outside the high-resolution mode."""

    channel_kind, channel_words = InfiniiVisionChannels, ChannelWords(steps=199)
    trigger_kind, trigger_words = InfiniiVisionTrigger, WORDS
    averages = ("ACQuire:COUNt", 65536)
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
    ) -> None:
        if not 8 <= bits <= 12:
            raise ValueError(f"a converter of {bits} bits is not known here; allowed are 8 … 12")
        identity = "KEYSIGHT TECHNOLOGIES,DSO-X 3024T,MY60101234,07.40.2021031200"
        super().__init__(BenchPlace(world, generator, errors, {}), identity, bits=bits)

    def add_commands(self) -> None:
        """Add what is its own."""
        self._add_time_base()
        self._add_acquire()
        self._add_root()
        self._waveform = WaveformSubsystem(self.tree, self.settings, self.acquisition, self.available)
        self._measure = MeasureSubsystem(self.tree, self.acquisition)
        SetupSubsystem(self.tree, self.settings, self.reset)
        self.tree.add("DISPlay:DATA", query=self._screen)

    def reset(self) -> None:
        """Return to the default setup: channel 1, 5 V/div, 100 µs/div, running with automatic trigger."""
        self._waveform.reset()
        self._measure.reset()
        super().reset()

    # time base

    def _add_time_base(self) -> None:
        put = self.settings
        put.add_choice("mode", "TIMebase:MODE", ("MAIN", "WINDow", "XY", "ROLL"), "MAIN")
        put.add_choice("reference", "TIMebase:REFerence", ("LEFT", "CENTer", "RIGHt"), "CENT", changed=self.rearm)
        put.add_number("range", "TIMebase:RANGe", 2.0e-8, 500.0, 1.0e-3, unit="S", changed=self.rearm)
        put.add_number("position", "TIMebase:POSition", -500.0, 500.0, 0.0, unit="S", changed=self.rearm)
        self.tree.add("TIMebase:SCALe", command=self._set_time_scale, query=self._get_time_scale)

    def _set_time_scale(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self.settings.put("range", 10.0 * number(call.arguments[0], 2.0e-9, 50.0, unit="S"))
        self.rearm()

    def _get_time_scale(self, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{self.settings.number('range') / 10.0:+.8E}"

    # acquisition

    def _add_acquire(self) -> None:
        put = self.settings
        put.add_choice("acquire_mode", "ACQuire:MODE", ("RTIMe", "SEGMented"), "RTIM", changed=self._refuse_segments)
        put.add_integer("complete", "ACQuire:COMPlete", 100, 100, 100)
        self.tree.add("ACQuire:SRATe[:ANALog]", query=bare(lambda: f"{self._rate():+.8E}"))
        self.tree.add("ACQuire:POINts[:ANALog]", query=bare(lambda: f"{self.available():+d}"))

    def _refuse_segments(self, _: int) -> None:
        if self.settings.word("acquire_mode") == "SEGM":
            self.settings.put("acquire_mode", "RTIM")
            raise ScpiError(-241)

    def _rate(self) -> float:
        """Return the sample rate (1/s): both halves of an interleaved pair share converter and memory."""
        shown = set(self._channels.shown())
        share = 2 if {1, 2} <= shown or {3, 4} <= shown else 1
        limit = min(_RATE / share, _MEMORY / share / self.settings.number("range"))
        decade = 10.0 ** math.floor(math.log10(limit) + 1.0e-9)
        return max(step * decade for step in (1.0, 2.0, 2.5, 5.0) if step * decade <= limit * (1.0 + 1.0e-9))

    def available(self) -> int:
        """Return how many samples the next record has."""
        return max(1, round(self._rate() * self.span()))

    def span(self) -> float:
        """Return the length of a record (s)."""
        return self.settings.number("range")

    def origin(self) -> float:
        """Return the time from the trigger to the beginning of a record (s)."""
        return self.settings.number("position") - _REFERENCES[self.settings.word("reference")] * self.span()

    # root

    def _add_root(self) -> None:
        add = self.tree.add
        # As the default setup, preferences apart, which this one has none of.
        add("SYSTem:PRESet", command=bare(self.reset))
        add("TRIGger:FORCe", command=bare(lambda: self.acquisition.force()))
        add("DIGitize", command=self._digitize)
        add("TER", query=bare(lambda: self.polled(lambda: f"{int(self.acquisition.take_trigger_event()):+d}")))
        add("RSTate", query=bare(lambda: self.polled(lambda: self.acquisition.state)))
        add("VIEW", command=lambda call: self._show(call, True))
        add("BLANk", command=lambda call: self._show(call, False))
        self.settings.add_string("message", "SYSTem:DSP")
        self.settings.add_flag("locked", "SYSTem:LOCK", False)
        add("DISPlay:CLEar", command=bare(lambda: None))
        operation = StatusRegister(self._operation)
        self._registers.append((0x80, operation))
        add("OPERegister:CONDition", query=bare(lambda: self.polled(lambda: f"{operation.condition():+d}")))
        add("OPERegister[:EVENt]", query=bare(lambda: f"{operation.read_event():+d}"))

        def enable(call: Call) -> None:
            exactly(call.arguments, 1)
            operation.enable = round(number(call.arguments[0], 0, 32767))

        add("OPEE", command=enable, query=bare(lambda: f"{operation.enable:+d}"))

    def _operation(self) -> int:
        bits = _RUN_BIT if self.acquisition.state != "STOP" else 0
        return bits | (_WAIT_BIT if self.acquisition.waiting() else 0)

    def _show(self, call: Call, shown: bool) -> None:
        exactly(call.arguments, 0 if not shown else 1, 1)
        channels = [int(choice(argument, SOURCES)[-1]) for argument in call.arguments]
        for channel in channels or range(1, CHANNELS + 1):
            self.settings.put("display", shown, channel)
        self.rearm()

    def _screen(self, call: Call) -> bytes:
        return screen_block(call, self.acquisition.record(), self._channels.shown())

    def _digitize(self, call: Call) -> Handling:
        channels = [int(choice(argument, SOURCES)[-1]) for argument in call.arguments]
        self.acquisition.stop()
        if channels:
            for channel in range(1, CHANNELS + 1):
                self.settings.put("display", channel in channels, channel)
        self.single()
        while (wake := self.pending()) is not None:
            yield wake
        return None
