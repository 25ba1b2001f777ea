"""Keysight 34461A multimeter as a DC voltmeter (Truevolt series operating and service guide, 34460-90901)."""

import math
from collections import deque
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.errors import VoltmeterErrors
from sim_instruments.instruments.keysight import dmm_34461a_conversion as conversion
from sim_instruments.instruments.keysight.dmm_34461a_math import ReadingMath
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.lexer import Argument
from sim_instruments.scpi.parameters import boolean, exactly, number, string
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, Handling, bare

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_FUNCTIONS = ("VOLT", "VOLT:DC", "VOLTAGE", "VOLTAGE:DC")
_OTHERS = (
    "VOLTage:AC", "VOLTage[:DC]:RATio", "CURRent[:DC]", "CURRent:AC", "RESistance", "FRESistance", "FREQuency", "PERiod",
    "CONTinuity", "DIODe", "TEMPerature", "CAPacitance",
)  # fmt: skip
_MEMORY = 10_000
_VOLTAGE_OVERLOAD, _MEASURING, _WAITING = 0x01, 0x10, 0x20
_HIGHEST = conversion.RANGES[-1]
_FASTEST, _SLOWEST = min(conversion.RESOLUTIONS), max(conversion.RESOLUTIONS)


class Keysight34461A(ScpiInstrument):
    """Simulated side of the voltmeter. It measures DC volts only; its sense terminals and other functions feed nothing.

    One of its other functions is refused, and then it reads nothing until it is told to measure DC volts again, or reset.
    A reading integrates the input over the power-line cycles set, at 50 Hz, and with autozero on spends as long again
    on its own zero. Neither the burden of its input nor the settling of ranges is modelled: a winding does not feel them.
    """

    unknown_word = -224
    leftovers = (
        ("", "CONF:VOLT:DC 0.1", "CONF:VOLT:DC 1000"),
        ("", "VOLT:NPLC 0.02", "VOLT:NPLC 100"),
        ("", "VOLT:ZERO:AUTO OFF"),
        ("", "TRIG:SOUR BUS", "TRIG:SOUR EXT"),
        ("", "TRIG:COUN 3", "TRIG:DEL 0.5"),
        ("", "SAMP:COUN 5"),
        ("", "VOLT:IMP:AUTO ON"),
        ("", "VOLT:NULL:VAL 0.01;STAT ON", "VOLT:NULL:VAL:AUTO ON;:VOLT:NULL:STAT ON"),
        ("", "CALC:SCAL:GAIN 2;OFFS 0.5;STAT ON", "CALC:SCAL:FUNC PCT;REF 5;STAT ON"),
    )

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: VoltmeterErrors | None = None,
        *,
        serial: str = "MY57201234",
    ) -> None:
        identity = f"Keysight Technologies,34461A,{serial},A.03.00-02.40-03.00-00.52-04-02"
        super().__init__(world.clock, generator, identity, queue_depth=20, queue_bit=0x04, version="1994.0")
        self._world = world
        self._random = generator
        self._unit = errors or VoltmeterErrors()
        self._range, self._cycles = 10.0, 10.0
        self._auto = self._zero = self._measures = True
        # The memory keeps the latest readings.
        self._readings: deque[float] = deque(maxlen=_MEMORY)
        self._triggers = self._left = 0
        self._cycle = self._next_end = 0.0
        self._busy_until = -math.inf
        self._questionable = StatusRegister()
        self.settings = ScpiSettings(self.tree, "+.8E")
        self._add_settings()
        self._math = ReadingMath(self.settings, self._idle)
        self._add_commands()
        self.reset()

    def reset(self) -> None:
        """Return to autoranging DC volts, 10 power-line cycles, one reading at an immediate trigger, and no reading."""
        self.settings.reset()
        self._measures = True
        self._range, self._cycles = 10.0, 10.0
        self._auto = self._zero = True
        self._idle()

    def give_up(self, busy: bool) -> None:
        """Give up what is being measured, too."""
        super().give_up(busy)
        self._abort()

    def _add_settings(self) -> None:
        put = self.settings
        put.add_flag("impedance", "[SENSe]:VOLTage[:DC]:IMPedance:AUTO", False, changed=self._idle)
        put.add_choice("source", "TRIGger:SOURce", ("IMMediate", "BUS", "EXTernal"), "IMM", changed=self._idle)
        put.add_integer("triggers", "TRIGger:COUNt", 1, 1_000_000, 1, changed=self._idle)
        put.add_number("delay", "TRIGger:DELay", 0.0, 3600.0, 0.0, unit="S", changed=self._idle)
        put.add_integer("samples", "SAMPle:COUNt", 1, 1_000_000, 1, changed=self._idle)
        put.add_flag("display", "DISPlay[:STATe]", True)
        put.add_flag("beeper", "SYSTem:BEEPer:STATe", True)

    def _add_commands(self) -> None:
        add, impedance = self.tree.add, self.settings["impedance"]
        # The older models' header, which this one still takes.
        add("INPut:IMPedance:AUTO", command=impedance.set, query=impedance.get)
        add("CONFigure[:VOLTage]:DC", command=self._configure)
        add("CONFigure", query=bare(lambda: f'"VOLT {self._range:+.6E},{self._resolution():+.6E}"'))
        add("MEASure[:VOLTage]:DC", query=self._measure)
        add("[SENSe]:FUNCtion[:ON]", command=self._set_function, query=bare(lambda: '"VOLT"'))
        add("[SENSe]:VOLTage[:DC]:NPLCycles", command=self._set_cycles, query=self._get_cycles)
        add("[SENSe]:VOLTage[:DC]:RESolution", command=self._set_resolution, query=self._get_resolution)
        add("[SENSe]:VOLTage[:DC]:RANGe[:UPPer]", command=self._set_range, query=self._get_range)
        add("[SENSe]:VOLTage[:DC]:RANGe:AUTO", command=self._set_auto, query=bare(lambda: str(int(self._auto))))
        add("[SENSe]:VOLTage[:DC]:ZERO:AUTO", command=self._set_zero, query=bare(lambda: str(int(self._zero))))
        for function in _OTHERS:
            add(f"CONFigure:{function}", command=self._refuse)
            add(f"MEASure:{function}", query=self._refuse)
        add("INITiate[:IMMediate]", command=bare(lambda: self._initiate()))
        add("ABORt", command=bare(lambda: self._abort()))
        add("READ", query=bare(lambda: self._read()))
        add("FETCh", query=bare(lambda: self._fetch()))
        add("DATA:POINts", query=self._points)
        add("SYSTem:BEEPer[:IMMediate]", command=bare(lambda: None))
        add("SYSTem:LOCal", command=bare(lambda: None))
        self.add_register("STATus:QUEStionable", self._questionable, 0x08)
        self.add_register("STATus:OPERation", StatusRegister(self._operation), 0x80)

    # settings

    def _set_range(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._range, self._auto = self._parse_range(call.arguments[0]), False
        self._idle()

    def _get_range(self, call: Call) -> str:
        exactly(call.arguments, 0, 1)
        return f"{self._parse_range(call.arguments[0]) if call.arguments else self._range:+.8E}"

    def _set_cycles(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._cycles = self._parse_cycles(call.arguments[0])
        self._idle()

    def _get_cycles(self, call: Call) -> str:
        exactly(call.arguments, 0, 1)
        return f"{self._parse_cycles(call.arguments[0]) if call.arguments else self._cycles:+.8E}"

    def _set_resolution(self, call: Call) -> None:
        exactly(call.arguments, 1)
        if self._auto:
            raise ScpiError(-221)
        self._cycles = self._parse_resolution(call.arguments[0], self._range)
        self._idle()

    def _get_resolution(self, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{self._resolution():+.8E}"

    def _set_function(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._measures = string(call.arguments[0]).upper() in _FUNCTIONS
        self._idle()
        if not self._measures:
            raise ScpiError(-224)

    def _refuse(self, _: Call) -> None:
        self._measures = False
        self._idle()
        raise ScpiError(-113)

    def _resolution(self) -> float:
        return conversion.RESOLUTIONS[self._cycles] * self._range

    def _set_auto(self, call: Call) -> None:
        exactly(call.arguments, 1)
        once = _once(call.arguments[0])
        if once:
            self._range = conversion.ranged(self._range, self._world.voltmeter_voltage(0.0))
        self._auto = not once and boolean(call.arguments[0])
        self._idle()

    def _set_zero(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._zero = not _once(call.arguments[0]) and boolean(call.arguments[0])
        self._idle()

    @staticmethod
    def _parse_range(argument: Argument) -> float:
        return conversion.range_for(number(argument, 0.0, _HIGHEST, default=10.0, unit="V"))

    @staticmethod
    def _parse_cycles(argument: Argument) -> float:
        return conversion.cycles_for(number(argument, _FASTEST, _SLOWEST, default=10.0))

    @staticmethod
    def _parse_resolution(argument: Argument, full_scale: float) -> float:
        if argument.kind == "word":
            finest, coarsest = min(conversion.RESOLUTIONS.values()), max(conversion.RESOLUTIONS.values())
            relative = number(argument, finest, coarsest, default=conversion.RESOLUTIONS[10.0])
        else:
            relative = number(argument, 0.0, math.inf, unit="V") / full_scale
        cycles = conversion.cycles_for_resolution(relative)
        if cycles is None:
            raise ScpiError(-222)
        return cycles

    def _configure(self, call: Call) -> None:
        exactly(call.arguments, 0, 2)
        wanted = call.arguments
        auto = not wanted or (wanted[0].kind == "word" and wanted[0].text in ("AUTO", "DEF", "DEFAULT"))
        if auto and len(wanted) == 2 and wanted[1].text not in ("DEF", "DEFAULT"):
            # Without a range there is nothing that a resolution could be a share of.
            raise ScpiError(-221)
        full_scale = self._range if auto else self._parse_range(wanted[0])
        cycles = self._parse_resolution(wanted[1], full_scale) if len(wanted) == 2 else 10.0
        self._range, self._cycles, self._measures = full_scale, cycles, True
        for name in ("source", "triggers", "delay", "samples"):
            self.settings[name].reset()
        self._math.disable()
        self._auto, self._zero = auto, cycles >= 1.0
        self._idle()

    # triggering

    def _idle(self, _: int = 1) -> None:
        """Leave whatever is being measured, and forget the readings: a new setting makes them stale."""
        self._abort()
        self._readings.clear()

    def _abort(self) -> None:
        self._triggers = self._left = 0
        self._busy_until = -math.inf

    def _initiate(self) -> None:
        if not self._measures:
            raise ScpiError(-221)
        if self._triggers or self._measuring():
            raise ScpiError(-213)
        self._idle()
        self._triggers = round(self.settings.number("triggers"))
        if self.settings.word("source") == "IMM":
            self._start(self._triggers)

    def trigger(self) -> None:
        """Take the samples of one trigger, as *TRG does. Raises ScpiError -211 where no trigger is awaited."""
        if self.settings.word("source") != "BUS" or not self._triggers or self._measuring():
            raise ScpiError(-211)
        self._collect()
        self._start(1)

    def _start(self, triggers: int) -> None:
        self._triggers -= triggers
        self._left = triggers * round(self.settings.number("samples"))
        integration, delay = self._cycles * conversion.LINE_CYCLE, self.settings.number("delay")
        self._cycle = delay + integration * (2.0 if self._zero else 1.0)
        # Input first, then the unit's own zero.
        self._next_end = self.clock.now() + delay + integration
        self._busy_until = self.clock.now() + self._left * self._cycle

    def _measuring(self) -> bool:
        return self.clock.now() < self._busy_until

    def _operation(self) -> int:
        return _MEASURING if self._measuring() else _WAITING if self._triggers else 0

    def pending(self) -> float | None:
        """Return when the readings that have been triggered are done; None where none are on their way."""
        return self._busy_until if self._measuring() else None

    # readings

    def _read(self) -> Handling:
        if self.settings.word("source") == "BUS":
            # The trigger could not come while the query waits for its readings.
            raise ScpiError(-214)
        self._initiate()
        return self._fetch()

    def _measure(self, call: Call) -> Handling:
        self._configure(call)
        return self._read()

    def _fetch(self) -> Handling:
        while self._left:
            yield self._next_end
            self._collect()
        if self._measuring():
            yield self._busy_until
        if self._triggers:
            yield math.inf
        if not self._readings:
            raise ScpiError(-230)
        return ",".join(f"{reading:+.8E}" for reading in self._readings)

    def _points(self, call: Call) -> str:
        exactly(call.arguments, 0)
        self._collect()
        return f"{len(self._readings):+d}"

    def _collect(self) -> None:
        """Convert what has been integrated by now."""
        while self._left and self._next_end <= self.clock.now():
            end = self._next_end
            self._left -= 1
            self._next_end += self._cycle
            self._readings.append(self._converted(end))

    def _converted(self, end: float) -> float:
        try:
            voltage = self._world.voltmeter_voltage(self._cycles * conversion.LINE_CYCLE, end)
        except ValueError:
            # The bench's past does not reach back to readings that nobody fetched for minutes.
            raise ScpiError(-230) from None
        if self._auto:
            self._range = conversion.ranged(self._range, voltage)
        reading = conversion.convert(voltage, self._range, self._cycles, self._unit, self._random)
        if abs(reading) == conversion.OVERLOAD:
            self._questionable.latch(_VOLTAGE_OVERLOAD)
            return reading
        return self._math.told(reading)


def _once(argument: Argument) -> bool:
    return argument.kind == "word" and argument.text == "ONCE"
