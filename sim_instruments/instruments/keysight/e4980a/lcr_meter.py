"""Keysight E4980A / E4980AL bridge (E4980A user's guide, E4980-90230, chapter "SCPI command reference")."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from sim_instruments.instruments.errors import LcrErrors
from sim_instruments.instruments.keysight.e4980a.accuracy import Aperture
from sim_instruments.instruments.keysight.e4980a.cycle import MeasuringCycle
from sim_instruments.instruments.keysight.e4980a.leftovers import CableLength, DeviationMode, add_bias
from sim_instruments.instruments.keysight.e4980a.list import SweepList
from sim_instruments.instruments.keysight.e4980a.measurement import (
    SOURCE_RESISTANCE,
    BridgeMeasurement,
    BridgeResult,
    Conditions,
)
from sim_instruments.instruments.keysight.e4980a.parameters import NEED_DC, OVERFLOW, TOKENS, pair
from sim_instruments.instruments.keysight.e4980a.replies import Figures, Replies
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.parameters import choice, choices, exactly, integer, number
from sim_instruments.scpi.settings import ScpiSettings
from sim_instruments.scpi.states import State, StateMemory, answered, queries_of
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, Handling, bare

if TYPE_CHECKING:
    from sim_instruments.world.world import World

_HIGHEST = {"032": 300.0e3, "052": 500.0e3, "102": 1.0e6}
_APERTURES = choices(("SHORt", "MEDium", "LONG"))
_LOWEST_FREQUENCY = 20.0
_CORRECTION_TIME = 8.0
_FUNCTIONS = choices(TOKENS)


class KeysightE4980A(ScpiInstrument):
    """Simulated side of the bridge. `options`: 032, 052 or 102 give the highest frequency, 001 measures with direct current."""

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: LcrErrors | None = None,
        *,
        options: tuple[str, ...] = ("102",),
        serial: str = "MY54101234",
    ) -> None:
        highest = [_HIGHEST[option] for option in options if option in _HIGHEST]
        if len(highest) != 1 or not set(options) <= {*_HIGHEST, "001"}:
            raise ValueError(f"options {options} of an E4980AL must hold one of 032, 052, 102 and may hold 001")
        super().__init__(world.clock, generator, f"Keysight Technologies,E4980AL,{serial},B.07.03", version="1996.0")
        self._world = world
        self._options = options
        self._highest = highest[0]
        self._measurement = BridgeMeasurement(world, generator, errors or LcrErrors())
        self._function = "CPD"
        self._current_mode = False
        self._voltage, self._current = 1.0, 0.01
        self._frequency = 1000.0
        self._aperture: Aperture = "MED"
        self._range = 100.0
        self._averages = 1
        #: By what a load correction that somebody left alters readings while CORRection:LOAD is on.
        self.load_factor = 1.0 + 0.0j
        self.settings = ScpiSettings(self.tree, "+.5E")
        self._list = SweepList(self.tree, self.settings, _LOWEST_FREQUENCY, self._highest)
        self._cycle = MeasuringCycle(self.tree, self.clock, self.settings, self._list, self._conditions, self._read)
        self._add_settings()
        self._replies = Replies(self.tree, self.settings)
        self._deviation = DeviationMode(self.settings)
        self._cable = CableLength(self.tree)
        add_bias(self.settings, "001" in options)
        self._add_commands()
        memory = StateMemory(self.tree, self.state, self.reset, range(10), ScpiError(-230))
        memory.add("MMEMory:STORe:STATe[:REGister]", "MMEMory:LOAD:STATe[:REGister]")
        memory.add_learn(";".join)
        self.reset()

    leftovers = (
        ("", "INIT:CONT OFF"),
        ("", "TRIG:SOUR HOLD", "TRIG:SOUR BUS", "TRIG:SOUR EXT"),
        ("", "DISP:PAGE LIST;:LIST:FREQ 1E3,1E4", "DISP:PAGE MSET", "DISP:PAGE SYST", "DISP:PAGE BNUM"),
        ("", "FUNC:DEV1:MODE PERC;REF 1E-3", "FUNC:DEV2:MODE ABS;REF 10"),
        ("", "AMPL:ALC ON"),
        ("", "CORR:LENG 4", "CORR:LENG 1"),
        ("", "CORR:OPEN:STAT ON"),
        ("", "CORR:SHOR:STAT ON"),
        ("", "CORR:LOAD:STAT ON"),
        ("", "COMP ON"),
        ("", "FORM REAL", "FORM:ASC:LONG ON"),
        ("", "TRIG:DEL 0.5"),
        ("", "CURR 5E-3", "VOLT 0.02"),
        ("", "APER SHOR,1", "APER LONG,4"),
    )

    def leave(self, generator: np.random.Generator) -> tuple[str, ...]:
        """Leave a state, with a load and a short that somebody has learnt on other leads."""
        self.load_factor = complex(1.0 + generator.uniform(-0.05, 0.05), generator.uniform(-0.02, 0.02))
        self._measurement.learnt(generator.uniform(0.0, 0.02), generator.uniform(0.0, 1.0e-6))
        return super().leave(generator)

    def reset(self) -> None:
        """Return to 1 kHz, 1 V, Cp-D, medium aperture, internal trigger; corrections are kept but switched off."""
        self.settings.reset()
        self._function, self._current_mode = "CPD", False
        self._voltage, self._current, self._frequency = 1.0, 0.01, 1000.0
        self._aperture, self._averages = "MED", 1
        self._cycle.abort()
        self._list.reset()
        self._replies.reset()
        self._cable.reset()
        self._cycle.forget()

    def options(self) -> str:
        """Return the options, in the order of their numbers."""
        return ",".join(sorted(self._options))

    def state(self) -> State:
        """Return what brings the bridge, reset, to its present settings."""
        own = (":FUNC:IMP?", ":FREQ?", ":VOLT?", ":CURR?", ":APER?", ":FUNC:IMP:RANG?", ":CORR:LENG?", ":FORM?")
        return tuple(answered(self.tree, (*own, *self._list.queries(), *queries_of(self.settings))))

    def _add_settings(self) -> None:
        put = self.settings
        put.add_flag("auto", "FUNCtion:IMPedance:RANGe:AUTO", True)
        put.add_flag("regulated", "AMPLitude:ALC", False, changed=self._cycle.forget)
        put.add_flag("short", "CORRection:SHORt:STATe", False, changed=self._cycle.forget)
        put.add_flag("open", "CORRection:OPEN:STATe", False, changed=self._cycle.forget)
        put.add_flag("load", "CORRection:LOAD:STATe", False, changed=self._cycle.forget)
        for monitored in ("VAC", "IAC"):
            # Both are monitored all the time here.
            put.add_flag(f"monitor {monitored}", f"FUNCtion:SMONitor:{monitored}[:STATe]", True)
        put.add_choice("page", "DISPlay:PAGE", _PAGES, "MEAS", changed=self._cycle.turn_page)
        put.add_string("line", "DISPlay:LINE")
        put.add_flag("display", "DISPlay:ENABle", True)
        put.add_flag("beeper", "SYSTem:BEEPer:STATe", True)

    def _add_commands(self) -> None:
        add = self.tree.add
        add("FREQuency[:CW]", command=self._set_frequency, query=self._get_frequency)
        add("VOLTage[:LEVel]", command=self._set_voltage, query=self._get_voltage)
        add("CURRent[:LEVel]", command=self._set_current, query=self._get_current)
        add("APERture", command=self._set_aperture, query=bare(lambda: f"{self._aperture},{self._averages:d}"))
        add("FUNCtion:IMPedance[:TYPE]", command=self._set_function, query=bare(lambda: self._function))
        add("FUNCtion:IMPedance:RANGe[:VALue]", command=self._set_range, query=bare(lambda: f"{self._range:+.5E}"))
        add("FETCh[:IMPedance][:FORMatted]", query=bare(lambda: self._fetch()))
        add("FETCh[:IMPedance]:CORRected", query=bare(lambda: self._fetch_corrected()))
        add("FETCh:SMONitor:VAC", query=bare(lambda: self._monitor("voltage")))
        add("FETCh:SMONitor:IAC", query=bare(lambda: self._monitor("current")))
        add("CORRection:SHORt[:EXECute]", command=bare(lambda: self._correct_short()))
        add("CORRection:OPEN[:EXECute]", command=bare(lambda: self._correct_open()))
        add("DISPlay:CCLear", command=bare(lambda: None))
        add("SYSTem:BEEPer[:IMMediate]", command=bare(lambda: None))
        self.add_register("STATus:OPERation", StatusRegister(self._operation), 0x80)
        self.add_register("STATus:QUEStionable", StatusRegister(), 0x08)

    # set points

    def _set_frequency(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._frequency = number(call.arguments[0], _LOWEST_FREQUENCY, self._highest, default=1000.0, unit="HZ")
        self._cycle.forget()

    def _get_frequency(self, call: Call) -> str:
        return self._level(call, self._frequency, _LOWEST_FREQUENCY, self._highest)

    def _set_voltage(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._voltage = number(call.arguments[0], 0.0, 2.0, default=1.0, unit="V")
        self._current_mode = False
        self._cycle.forget()

    def _set_current(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._current = number(call.arguments[0], 0.0, 0.02, default=0.01, unit="A")
        self._current_mode = True
        self._cycle.forget()

    def _get_voltage(self, call: Call) -> str:
        if self._current_mode:
            raise ScpiError(-230)
        return self._level(call, self._voltage, 0.0, 2.0)

    def _get_current(self, call: Call) -> str:
        if not self._current_mode:
            raise ScpiError(-230)
        return self._level(call, self._current, 0.0, 0.02)

    @staticmethod
    def _level(call: Call, value: float, low: float, high: float) -> str:
        exactly(call.arguments, 0, 1)
        return f"{number(call.arguments[0], low, high) if call.arguments else value:+.5E}"

    def _set_aperture(self, call: Call) -> None:
        exactly(call.arguments, 1, 2)
        word = choice(call.arguments[0], _APERTURES)
        averages = integer(call.arguments[1], 1, 256, default=1) if len(call.arguments) == 2 else self._averages
        self._aperture = "SHOR" if word == "SHOR" else "LONG" if word == "LONG" else "MED"
        self._averages = averages
        self._cycle.forget()

    def _set_function(self, call: Call) -> None:
        exactly(call.arguments, 1)
        token = choice(call.arguments[0], _FUNCTIONS)
        if token in NEED_DC and "001" not in self._options:
            raise ScpiError(-241)
        self._function = token
        self._cycle.forget()

    def _set_range(self, call: Call) -> None:
        exactly(call.arguments, 1)
        wanted = number(call.arguments[0], 0.0, 1.0e9, unit="OHM")
        self._range = next((entry for entry in _RANGES if entry >= wanted), _RANGES[-1])
        self.settings.put("auto", False)

    # measuring

    def _conditions(self) -> Conditions:
        level = SOURCE_RESISTANCE * self._current if self._current_mode else self._voltage
        return Conditions(
            self._frequency,
            level,
            self._aperture,
            self._averages,
            self.settings.number("delay"),
            self.settings.flag("short"),
            self.settings.flag("regulated"),
            self._function in NEED_DC,
        )

    def _read(self, conditions: Conditions, time: float) -> BridgeResult:
        result = self._measurement.read(conditions, time)
        if result.impedance is None:
            return result
        seen = self._cable.turned(result.impedance, conditions.frequency)
        return replace(result, impedance=seen * self.load_factor if self.settings.flag("load") else seen)

    def trigger(self) -> Handling:
        """Measure and reply with the result, as *TRG does. Raises ScpiError -211 where no trigger is awaited."""
        self._cycle.bus_trigger()
        return self._fetch()

    def pending(self) -> float | None:
        """Return when the measurement that has been triggered is done."""
        return self._cycle.due if self._cycle.measuring else None

    def _operation(self) -> int:
        # Bit 4: measuring (user's guide, operation status register).
        return 0x10 if self._cycle.measuring else 0

    def _fetch(self) -> Handling:
        reading = yield from self._cycle.result()
        if self._cycle.page == "LIST":
            return self._swept()
        return self._replies.reading(self._shown(reading, self._frequency))

    def _shown(self, reading: BridgeResult | None, frequency: float) -> Figures:
        if reading is None or reading.impedance is None:
            return OVERFLOW, OVERFLOW, -1 if reading is None else reading.status
        if self._function == "VDID":
            volts = self.settings.number("bias_voltage") if self.settings.flag("bias") else 0.0
            current = volts / (SOURCE_RESISTANCE + reading.dc_resistance)
            return current * reading.dc_resistance, current, reading.status
        first, second = pair(self._function, reading.impedance, frequency, reading.dc_resistance)
        return *self._deviation.shown((first, second)), reading.status

    def _swept(self) -> str | bytes:
        shown = [self._shown(reading, at.frequency) for at, reading in self._cycle.swept()]
        return self._replies.sweep(shown)

    def _fetch_corrected(self) -> Handling:
        reading = yield from self._cycle.result()
        if reading is None or reading.impedance is None:
            return self._replies.values((OVERFLOW, OVERFLOW))
        return self._replies.values((reading.impedance.real, reading.impedance.imag))

    def _monitor(self, quantity: str) -> Handling:
        reading = yield from self._cycle.result()
        if reading is None:
            return self._replies.values((OVERFLOW,))
        return self._replies.values((reading.voltage if quantity == "voltage" else reading.current,))

    # corrections

    def _correct_short(self) -> Handling:
        yield self.clock.now() + _CORRECTION_TIME
        if not self._measurement.learn_short():
            raise ScpiError(-200, "Execution error;Correction measurement aborted")
        self._cycle.forget()
        return None

    def _correct_open(self) -> Handling:
        yield self.clock.now() + _CORRECTION_TIME
        if not self._measurement.learn_open():
            raise ScpiError(-200, "Execution error;Correction measurement aborted")
        self._cycle.forget()
        return None


_PAGES = (
    "MEASurement", "BNUMber", "BCOunt", "LIST", "MSETup", "CSETup", "LTABle", "LSETup", "CATalog", "SYSTem",
    "SELF", "MLARge", "SCONfig", "SERVice",
)  # fmt: skip
_RANGES = (0.1, 1.0, 10.0, 100.0, 300.0, 1.0e3, 3.0e3, 10.0e3, 30.0e3, 100.0e3)
