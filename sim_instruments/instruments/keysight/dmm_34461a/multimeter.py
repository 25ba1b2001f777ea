"""Keysight 34461A multimeter (Truevolt series operating and service guide, 34460-90901)."""

import math
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.errors import VoltmeterErrors
from sim_instruments.instruments.keysight.dmm_34461a import conversion
from sim_instruments.instruments.keysight.dmm_34461a.functions import (
    CURR_AC,
    CURR_DC,
    DIOD,
    FREQ,
    FRES,
    FUNCTIONS,
    PER,
    REFUSED,
    RES,
    TEMP,
    VOLT_AC,
    VOLT_DC,
    Function,
)
from sim_instruments.instruments.keysight.dmm_34461a.input import SATURATION, InputTerminals
from sim_instruments.instruments.keysight.dmm_34461a.math import ReadingMath
from sim_instruments.instruments.keysight.dmm_34461a.sense import FunctionSettings, settings_by_function
from sim_instruments.instruments.keysight.dmm_34461a.sensor import TemperatureSensor
from sim_instruments.instruments.keysight.dmm_34461a.trigger import ReadingTrigger
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.parameters import exactly, string
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.states import State, StateMemory, answered, queries_of
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, Handler, Handling, bare

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_NAMES = {name: function for function in FUNCTIONS for name in function.names()}
#: Below CONFigure and MEASure, where SENSe's header is another.
_HEADERS = {"VOLT": "[:VOLTage]:DC", "VOLT:AC": "[:VOLTage]:AC"}
_VOLTAGE_OVERLOAD, _CURRENT_OVERLOAD, _RESISTANCE_OVERLOAD = 0x01, 0x02, 0x200
_OVERLOADS = {"V": _VOLTAGE_OVERLOAD, "A": _CURRENT_OVERLOAD, "OHM": _RESISTANCE_OVERLOAD}
#: Test current (A) of the diode test, and what it tells of an open input.
_DIODE_CURRENT, _NO_DIODE = 1.0e-3, 9.8e37
_TEXT_LENGTH = 40
_EMPTY = "Not able to recall state: it is empty"


class Keysight34461A(ScpiInstrument):
    """Simulated side of the multimeter; its current terminals are on nothing, the others on the bench's Kelvin leads.

    Told to measure what it does not serve, it reads nothing until it is told to measure something else, or reset.
    A reading integrates the input over the power-line cycles set, at 50 Hz, and with autozero on spends as long again
    on its own zero. Neither the burden of its input nor the settling of ranges is modelled: a winding does not feel them.
    """

    unknown_word = -224
    power_on_clears = True
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
        ("", "FUNC 'RES'", "FUNC 'VOLT:AC'"),
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
        self._input = InputTerminals(world)
        self._random = generator
        self._unit = errors or VoltmeterErrors()
        self._function = VOLT_DC
        self._measures = True
        self._display_text = ""
        self._questionable = StatusRegister()
        self.settings = ScpiSettings(self.tree, "+.8E")
        self._trigger = ReadingTrigger(
            world.clock, self.settings, self._timing, self._converted, lambda: self._measures
        )
        self._senses = settings_by_function(
            FUNCTIONS, lambda function: self._value(function, 0.0, None), self._trigger.idle
        )
        self._math = ReadingMath(self.settings, self._trigger.idle)
        self._sensor = TemperatureSensor(self.settings)
        self._add_settings()
        self._add_functions()
        self._add_commands()
        memory = StateMemory(self.tree, self.state, self.reset, range(5), ScpiError(291, _EMPTY))
        memory.add("*SAV", "*RCL")
        memory.add_learn(";".join)
        self.reset()

    def reset(self) -> None:
        """Return to autoranging DC volts, 10 power-line cycles, one reading at an immediate trigger, and no reading."""
        self.settings.reset()
        self._function, self._measures, self._display_text = VOLT_DC, True, ""
        for sense in self._senses.values():
            sense.reset()
        self._trigger.reset()

    def state(self) -> State:
        """Return what brings the instrument, reset, to its present settings."""
        senses = [message for function in FUNCTIONS for message in self._senses[function.word].messages(function)]
        return (*senses, *answered(self.tree, queries_of(self.settings)), f':FUNC "{self._function.word}"')

    def give_up(self, busy: bool) -> None:
        """Give up what is being measured, too."""
        super().give_up(busy)
        self._trigger.abort()

    def trigger(self) -> None:
        """Take the samples of one trigger, as *TRG does. Raises ScpiError -211 where no trigger is awaited."""
        self._trigger.trigger()

    def pending(self) -> float | None:
        """Return when the readings that have been triggered are done; None where none are on their way."""
        return self._trigger.pending()

    def _add_settings(self) -> None:
        put = self.settings
        put.add_flag("impedance", "[SENSe]:VOLTage[:DC]:IMPedance:AUTO", False, changed=self._trigger.idle)
        put.add_flag("display", "DISPlay[:STATe]", True)
        put.add_flag("beeper", "SYSTem:BEEPer:STATe", True)

    def _add_functions(self) -> None:
        add = self.tree.add
        for function in FUNCTIONS:
            self._senses[function.word].add_headers(self.tree, function)
            header = _HEADERS.get(function.word, f":{function.header}")
            add(f"CONFigure{header}", command=self._configuring(function))
            add(f"MEASure{header}", query=self._measuring(function))
        for refused in REFUSED:
            add(f"CONFigure:{refused}", command=self._refuse)
            add(f"MEASure:{refused}", query=self._refuse)
        add("CONFigure", query=bare(self._configuration))
        add("[SENSe]:FUNCtion[:ON]", command=self._set_function, query=bare(lambda: f'"{self._function.word}"'))

    def _add_commands(self) -> None:
        add, impedance = self.tree.add, self.settings["impedance"]
        # The older models' header, which this one still takes.
        add("INPut:IMPedance:AUTO", command=impedance.set, query=impedance.get)
        self._trigger.add_headers(self.tree)
        add("DISPlay:TEXT[:DATA]", command=self._show, query=bare(lambda: f'"{self._display_text}"'))
        add("DISPlay:TEXT:CLEar", command=bare(self._clear_text))
        add("ROUTe:TERMinals", query=bare(lambda: "FRON"))
        add("SYSTem:LFRequency", query=bare(lambda: "+50"))
        add("SYSTem:PRESet", command=bare(self.reset))
        add("SYSTem:BEEPer[:IMMediate]", command=bare(lambda: None))
        add("SYSTem:LOCal", command=bare(lambda: None))
        self.add_register("STATus:QUEStionable", self._questionable, 0x08)
        self.add_register("STATus:OPERation", StatusRegister(self._trigger.condition), 0x80)

    # functions

    @property
    def _sense(self) -> FunctionSettings:
        return self._senses[self._function.word]

    def _configuring(self, function: Function) -> Handler:
        def configure(call: Call) -> None:
            if function is TEMP:
                self._sensor.configure(call.arguments)
                self._senses[TEMP.word].configure(())
            else:
                self._senses[function.word].configure(call.arguments)
            self._function, self._measures = function, True
            self._math.disable(function)
            self._trigger.reset()

        return configure

    def _measuring(self, function: Function) -> Handler:
        configure = self._configuring(function)

        def measure(call: Call) -> Handling:
            configure(call)
            return self._trigger.read()

        return measure

    def _configuration(self) -> str:
        sense, word = self._sense, self._function.word
        if self._function in (TEMP, FREQ, PER):
            # How it puts a sensor, or what it expects to count, is not known here.
            raise ScpiError(-221)
        if self._function.fixed:
            return f'"{word}"'
        return f'"{word} {sense.range:+.6E},{sense.resolution * sense.range:+.6E}"'

    def _set_function(self, call: Call) -> None:
        exactly(call.arguments, 1)
        function = _NAMES.get(string(call.arguments[0]).upper())
        self._measures = function is not None
        self._trigger.idle()
        if function is None:
            raise ScpiError(-224)
        self._function = function

    def _refuse(self, _: Call) -> None:
        self._measures = False
        self._trigger.idle()
        raise ScpiError(-113)

    def _show(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._display_text = string(call.arguments[0])[:_TEXT_LENGTH]

    def _clear_text(self) -> None:
        self._display_text = ""

    # readings

    def _timing(self) -> tuple[float, float]:
        return self._sense.aperture, self._sense.duration(self._function)

    def _value(self, function: Function, aperture: float, end: float | None) -> float:
        """Return the quantity that a function measures over the `aperture` s before `end` (s; now)."""
        full_scale, terminals = self._senses[function.word].range, self._input
        if function in (CURR_DC, CURR_AC):
            return 0.0
        if function is VOLT_DC:
            return terminals.voltage(aperture, end)
        if function in (VOLT_AC, FREQ, PER):
            return terminals.rms(aperture, end)
        if function is DIOD:
            return _DIODE_CURRENT * terminals.resistance(function, full_scale, aperture, end)
        wires = self._sensor.wires if function is TEMP else function
        return terminals.resistance(wires, full_scale, aperture, end)

    def _ranged(self, extreme: float, value: float, end: float) -> float:
        """Have autoranging find the range for the extreme of a quantity, and return the quantity there.

        What an ohmmeter sees depends on its test current, and so on the range.
        """
        function, sense = self._function, self._sense
        for _ in function.ranges:
            found = conversion.ranged(sense.range, extreme, function.ranges)
            if found == sense.range:
                return value
            sense.range = found
            if function not in (RES, FRES, TEMP):
                return value
            extreme = value = self._value(function, sense.aperture, end)
        return math.inf

    def _converted(self, end: float) -> float:
        function, sense = self._function, self._sense
        try:
            value = self._value(function, sense.aperture, end)
            peak = self._input.peak(sense.aperture, end) / SATURATION if function is VOLT_DC else 0.0
            if sense.auto and len(function.ranges) > 1:
                value = self._ranged(value if peak <= abs(value) else math.copysign(peak, value), value, end)
            if peak > sense.range:
                # What goes to and fro beyond the range has a mean that the converter does not see.
                value = math.copysign(math.inf, value)
            if function in (FREQ, PER):
                value = self._input.frequency(sense.aperture, end, sense.range)
        except ValueError:
            # The bench's past does not reach back to readings that nobody fetched for minutes.
            raise ScpiError(-230) from None
        if function is PER:
            value = 1.0 / value if value else 0.0
        reading = conversion.convert(value, function, sense.range, sense.resolution, self._unit, self._random)
        if function is DIOD and abs(reading) == conversion.OVERLOAD:
            return math.copysign(_NO_DIODE, reading)
        if function is TEMP:
            reading = self._sensor.temperature(reading)
        if abs(reading) == conversion.OVERLOAD:
            self._questionable.latch(_OVERLOADS.get(function.unit, _RESISTANCE_OVERLOAD))
            return reading
        return self._math.told(function, reading)
