"""Keysight InfiniiVision DSOX3024T (3000T X-Series programmer's guide): channels, time base, trigger, acquisition."""

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.errors import ScopeErrors
from sim_instruments.instruments.keysight.infiniivision.acquisition import Acquisition
from sim_instruments.instruments.keysight.infiniivision.arming import Setup
from sim_instruments.instruments.keysight.infiniivision.channels import CHANNELS, SOURCES, ChannelSubsystem
from sim_instruments.instruments.keysight.infiniivision.measure import MeasureSubsystem
from sim_instruments.instruments.keysight.infiniivision.screen import screen_block
from sim_instruments.instruments.keysight.infiniivision.setup import SetupSubsystem
from sim_instruments.instruments.keysight.infiniivision.trigger import TriggerSubsystem
from sim_instruments.instruments.keysight.infiniivision.waveform import WaveformSubsystem
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.parameters import choice, exactly, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, Handling, bare

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_RUN_BIT, _WAIT_BIT = 0x08, 0x20
_MEMORY = 4_000_000
_RATE = 5.0e9
_POLL_TIME = 1.0e-3
_REFERENCES = {"LEFT": 0.1, "CENT": 0.5, "RIGH": 0.9}
_HYSTERESIS_DIVISIONS = 0.1


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
        self._channels = ChannelSubsystem(
            self.tree,
            self.settings,
            self._errors,
            self._rearm,
            lambda channel, factor: self._trigger.rescale(channel, factor),
        )
        self._add_time_base()
        self._trigger = TriggerSubsystem(
            self.tree, self.settings, self._channels, self._rearm, lambda: self.acquisition.force()
        )
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
        self._channels.reset()
        self._trigger.reset()
        for channel in range(2, CHANNELS + 1):
            self.settings.put("display", False, channel)
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

    def _rate(self) -> float:
        """Return the sample rate (1/s): both halves of an interleaved pair share converter and memory."""
        shown = set(self._channels.shown())
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
        kind, averages = settings.word("type"), self._averages()
        verticals = {
            channel: self._channels.vertical(channel, kind, averages, self._bits) for channel in range(1, CHANNELS + 1)
        }
        source = verticals.get(self._trigger.channel)
        return Setup(
            origin,
            span,
            self._available(),
            verticals,
            source,
            self._trigger.channel,
            self._trigger.edge(_HYSTERESIS_DIVISIONS * (source.scale if source else 0.0)),
            settings.word("sweep") == "AUTO",
            averages,
            settings.number("holdoff"),
            self._trigger.path(),
        )

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
        return screen_block(call, self.acquisition.record(), self._channels.shown())

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
