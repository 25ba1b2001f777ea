"""Keysight E36313A triple-output supply (E36300 series programming guide, E36311-90008).

Protections as Keysight's guides describe them for its supplies (E3632A, E3633A, N6700, N6900, E36731A): over-voltage trips at its level;
over-current trips once the output is in constant current, after a delay that starts at the transition (CCTRans) or at the end of a
settings change (SCHange). A trip is latched. Clearing it restores the output to the state that it had before.
"""

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from sim_instruments.instruments.errors import SupplyErrors
from sim_instruments.instruments.keysight.e36300.coupling import Coupling
from sim_instruments.instruments.keysight.e36300.output import RATINGS, ProgrammedOutput, Rating
from sim_instruments.instruments.keysight.e36300.summary import OutputSummaries
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.lexer import Argument
from sim_instruments.scpi.parameters import boolean, channel_list, choice, choices, exactly, number, string
from sim_instruments.scpi.states import State, StateMemory, answered
from sim_instruments.scpi.status import StatusRegister
from sim_instruments.scpi.tree import Call, Handling, bare

if TYPE_CHECKING:
    from sim_instruments.world.world import World

T = TypeVar("T")

_OUTPUTS = choices(("CH1", "CH2", "CH3", "P6V", "P25V", "N25V"))
_DELAY_STARTS = choices(("SCHange", "CCTRans"))
_NUMBERS = {"CH1": 1, "P6V": 1, "CH2": 2, "P25V": 2, "CH3": 3, "N25V": 3}
_CONSTANT_CURRENT, _CONSTANT_VOLTAGE, _FAULT = 1, 2, 3
_OVER_VOLTAGE_BIT, _OVER_CURRENT_BIT = 0x200, 0x400
_INSTRUMENT_SUMMARY = 0x2000
_MEASURING_TIME = 0.02  # one power-line cycle
_KEPT = ("VOLT", "CURR", "VOLT:PROT", "CURR:PROT:STAT", "CURR:PROT:DEL", "CURR:PROT:DEL:STAR", "VOLT:SENS")
_KEPT_COMMON = (":OUTP:PAIR?", ":OUTP:TRAC?", ":INST:NSEL?", ":DISP:TEXT?")
_KEPT_AFTER = ("VOLT:MODE", "CURR:MODE")
_EMPTY = "Not able to recall state: it is empty"


class KeysightE36313A(ScpiInstrument):
    """Simulated side of the supply; output `wired` goes to the motor, the others feed nothing."""

    channels = len(RATINGS)
    leftovers = (
        ("", "INST CH2", "INST CH3"),
        ("", "VOLT 3.3,(@1);:CURR 1,(@1)", "VOLT 5,(@1:3);:CURR 0.5,(@1:3)"),
        ("", "VOLT:PROT 2,(@1)", "VOLT:PROT 10,(@2:3)"),
        ("", "CURR:PROT:STAT ON,(@1:3)"),
        ("", "CURR:PROT:DEL 3,(@1:3);DEL:STAR CCTR,(@1:3)"),
        ("", "", "OUTP:PAIR SER", "OUTP:PAIR PAR"),
        ("", "OUTP:TRAC ON"),
        ("", "VOLT:SENS EXT,(@1)", "VOLT:SENS EXT,(@2:3)"),
        ("", "VOLT:MODE LIST,(@1)", "CURR:MODE LIST,(@1:3)"),
    )
    unknown_word = -224
    power_on_clears = True

    def __init__(
        self,
        world: "World",
        generator: np.random.Generator,
        errors: SupplyErrors | None = None,
        *,
        wired: int | None = 1,
    ) -> None:
        identity = "Keysight Technologies,E36313A,MY59001234,2.1.0-1.0.4-1.12"
        super().__init__(world.clock, generator, identity, queue_depth=20, queue_bit=0x04)
        self._world = world
        self._wired = wired
        self._random = generator
        self._unit = errors or SupplyErrors()
        self._outputs = {channel: ProgrammedOutput(rating) for channel, rating in RATINGS.items()}
        self._selected = 1
        self._text = ""
        self._summaries = OutputSummaries(
            self.tree, {channel: partial(self._condition, channel) for channel in RATINGS}
        )
        self._coupling = Coupling(self.tree, tuple(RATINGS), self._channels, self._apply, self._switch_off)
        self._add_commands()
        memory = StateMemory(self.tree, self.state, self.reset, range(10), ScpiError(291, _EMPTY))
        memory.add("*SAV", "*RCL")
        self.reset()

    def reset(self) -> None:
        """Switch off and return to the defaults."""
        self._selected, self._text = 1, ""
        self._coupling.reset()
        for output in self._outputs.values():
            output.reset()
        if self._wired is None:
            return
        with self._world.lock:
            supply = self._world.supply
            supply.switch(False)
            supply.clear_trip()
            supply.set_over_current(False)
        self._apply()

    def state(self) -> State:
        """Return what brings the supply, reset, to its present settings, outputs that are on included."""
        levels = [f":{header}? (@{channel})" for header in _KEPT for channel in self._outputs]
        # Outputs that are coupled take no set points, so that comes after them.
        coupled = [f":{header}? (@{channel})" for header in _KEPT_AFTER for channel in self._outputs]
        switched = [f":OUTP? (@{channel})" for channel, output in self._outputs.items() if output.on]
        return tuple(answered(self.tree, [*levels, *_KEPT_COMMON, *coupled, *switched]))

    def inhibit(self, inhibited: bool) -> None:
        """Take all outputs off by the inhibit input, latched: allowed again, they stay off until they are switched on anew."""
        with self._world.lock:
            if inhibited:
                for output in self._outputs.values():
                    output.on = False
            if self._wired is not None:
                self._world.supply.inhibit(inhibited)

    def _add_commands(self) -> None:
        add = self.tree.add
        level = "[:LEVel][:IMMediate][:AMPLitude]"
        self._add_level(f"[SOURce]:VOLTage{level}", "V", "voltage", lambda rating: rating.voltage, lambda _: 0.0)
        self._add_level(
            f"[SOURce]:CURRent{level}",
            "A",
            "current",
            lambda rating: rating.current,
            lambda rating: rating.default_current,
        )
        self._add_level(
            "[SOURce]:VOLTage:PROTection[:LEVel]",
            "V",
            "over_voltage",
            lambda rating: rating.over_voltage,
            lambda rating: rating.over_voltage,
        )
        over_current = "[SOURce]:CURRent:PROTection"
        self._add_choice(f"{over_current}:STATe", "over_current", boolean, lambda on: str(int(on)))
        self._add_choice(
            f"{over_current}:DELay[:TIME]",
            "over_current_delay",
            lambda argument: number(argument, 0.0, 3.6, default=0.05, unit="S"),
            lambda delay: f"{delay:+.8E}",
        )
        self._add_choice(
            f"{over_current}:DELay:STARt", "over_current_start", lambda word: choice(word, _DELAY_STARTS), str
        )
        add("OUTPut[:STATe]", command=self._switch, query=self._switched)
        add("[SOURce]:VOLTage:PROTection:TRIPped", query=lambda call: self._tripped(call, "voltage"))
        add("[SOURce]:CURRent:PROTection:TRIPped", query=lambda call: self._tripped(call, "current"))
        for header in (
            "OUTPut:PROTection:CLEar",
            "[SOURce]:VOLTage:PROTection:CLEar",
            "[SOURce]:CURRent:PROTection:CLEar",
        ):
            add(header, command=self._clear_protection)
        add("MEASure[:SCALar][:VOLTage][:DC]", query=lambda call: self._measure(call, "voltage"))
        add("MEASure[:SCALar]:CURRent[:DC]", query=lambda call: self._measure(call, "current"))
        add("APPLy", command=self._apply_levels, query=self._applied)
        add("INSTrument[:SELect]", command=self._select, query=bare(lambda: f"CH{self._selected}"))
        add("INSTrument:NSELect", command=self._select_number, query=bare(lambda: f"{self._selected:+d}"))
        add("DISPlay[:WINDow]:TEXT[:DATA]", command=self._show, query=bare(lambda: f'"{self._text}"'))
        add("DISPlay[:WINDow]:TEXT:CLEar", command=self._clear_text)
        for header in ("SYSTem:REMote", "SYSTem:LOCal", "SYSTem:RWLock", "SYSTem:BEEPer[:IMMediate]"):
            add(header, command=bare(lambda: None))
        self.add_register("STATus:QUEStionable", StatusRegister(self._questionable), 0x08)
        self.add_register("STATus:OPERation", StatusRegister(), 0x80)
        self.add_register("STATus:QUEStionable:INSTrument", StatusRegister(self._summaries.condition), 0)

    # set points

    def _add_level(
        self, header: str, unit: str, name: str, maximum: Callable[[Rating], float], default: Callable[[Rating], float]
    ) -> None:
        def parse(argument: Argument, channel: int) -> float:
            rating = RATINGS[channel]
            return number(argument, 0.0, maximum(rating), default=default(rating), unit=unit)

        def set_level(call: Call) -> None:
            exactly(call.arguments, 1, 2)
            channels = self._channels(call.arguments[1:])
            for channel, value in [(channel, parse(call.arguments[0], channel)) for channel in channels]:
                self._coupling.check(channel, name)
                for follower in self._coupling.following(channel, name):
                    setattr(self._outputs[follower], name, value)
            self._apply()

        def get_level(call: Call) -> str:
            exactly(call.arguments, 0, 2)
            word, rest = _leading_word(call.arguments)
            values = []
            for channel in self._channels(rest):
                values.append(getattr(self._outputs[channel], name) if word is None else parse(word, channel))
            return ",".join(f"{value:+.8E}" for value in values)

        self.tree.add(header, command=set_level, query=get_level)

    def _add_choice(self, header: str, name: str, parse: Callable[[Argument], T], shown: Callable[[T], str]) -> None:
        def set_it(call: Call) -> None:
            exactly(call.arguments, 1, 2)
            value = parse(call.arguments[0])
            for channel in self._channels(call.arguments[1:]):
                setattr(self._outputs[channel], name, value)
            self._apply()

        def get_it(call: Call) -> str:
            exactly(call.arguments, 0, 1)
            return ",".join(shown(getattr(self._outputs[channel], name)) for channel in self._channels(call.arguments))

        self.tree.add(header, command=set_it, query=get_it)

    def _switch(self, call: Call) -> None:
        exactly(call.arguments, 1, 2)
        on = boolean(call.arguments[0])
        for channel in self._channels(call.arguments[1:]):
            if on and channel == self._wired and self._world.supply.tripped is not None:
                # A latched protection holds the output off until it is cleared.
                raise ScpiError(-221)
            self._coupling.check(channel, "on")
            self._outputs[channel].on = on
        self._apply()

    def _switched(self, call: Call) -> str:
        exactly(call.arguments, 0, 1)
        return ",".join(str(int(self._is_on(channel))) for channel in self._channels(call.arguments))

    def _switch_off(self, channels: tuple[int, ...]) -> None:
        for channel in channels:
            self._outputs[channel].on = False
        self._apply()

    def _is_on(self, channel: int) -> bool:
        on, supply = self._outputs[channel].on, self._world.supply
        if channel != self._wired:
            return on
        if supply.tripped is not None:
            return False
        return supply.stuck_output.shown(on and not supply.inhibited, supply.is_on)

    def _channels(self, arguments: tuple[Argument, ...]) -> tuple[int, ...]:
        if not arguments:
            return (self._selected,)
        exactly(arguments, 1)
        return channel_list(arguments[0], len(self._outputs))

    def _apply(self) -> None:
        if self._wired is None:
            return
        output, unit = self._outputs[self._wired], self._unit
        with self._world.lock:
            supply = self._world.supply
            stage = supply.stage
            voltage = output.voltage * (1.0 + unit.set_voltage_gain) + unit.set_voltage_offset
            voltage *= self._coupling.voltage_share(self._wired)
            current = output.current * (1.0 + unit.set_current_gain) + unit.set_current_offset
            # The offset of the setting does not drive an output that is set to nothing.
            supply.set_voltage(min(max(voltage, 0.0), stage.maximum_voltage) if output.voltage > 0.0 else 0.0)
            supply.set_current_limit(min(max(current, 0.0), stage.maximum_current))
            supply.set_over_voltage(output.over_voltage)
            supply.set_over_current(
                output.over_current, output.over_current_delay, from_change=output.over_current_start == "SCH"
            )
            if output.on != supply.is_on or output.on != supply.stuck_output.wanted:
                supply.switch(output.on)

    def _apply_levels(self, call: Call) -> None:
        exactly(call.arguments, 1, 3)
        channel, levels = self._selected, call.arguments
        if levels[0].kind == "word" and levels[0].text in _OUTPUTS:
            channel, levels = _NUMBERS[levels[0].text], levels[1:]
        exactly(levels, 0, 2)
        output, rating = self._outputs[channel], RATINGS[channel]
        voltage, current = output.voltage, output.current
        for quantity in ("voltage", "current")[: len(levels)]:
            self._coupling.check(channel, quantity)
        if levels:
            voltage = number(levels[0], 0.0, rating.voltage, default=0.0, unit="V")
        if len(levels) == 2:
            current = number(levels[1], 0.0, rating.current, default=rating.default_current, unit="A")
        output.voltage, output.current = voltage, current
        self._apply()

    def _applied(self, call: Call) -> str:
        exactly(call.arguments, 0, 1)
        channel = _NUMBERS[choice(call.arguments[0], _OUTPUTS)] if call.arguments else self._selected
        output = self._outputs[channel]
        return f'"{output.voltage:.4f},{output.current:.4f}"'

    def _select(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._selected = _NUMBERS[choice(call.arguments[0], _OUTPUTS)]

    def _select_number(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self._selected = round(number(call.arguments[0], 1, len(self._outputs), default=1))

    # readings and status

    def _measure(self, call: Call, quantity: str) -> Handling:
        exactly(call.arguments, 0, 1)
        channels = self._channels(call.arguments)
        yield self.clock.now() + _MEASURING_TIME * len(channels)
        return ",".join(f"{self._reading(channel, quantity):+.8E}" for channel in channels)

    def _reading(self, channel: int, quantity: str) -> float:
        index = 0 if quantity == "voltage" else 1
        rating, unit = RATINGS[channel], self._unit
        if channel == self._wired:
            supply = self._world.supply
            share = self._coupling.voltage_share(channel)
            true = supply.voltage(_MEASURING_TIME) / share if index == 0 else supply.current(_MEASURING_TIME)
        else:
            output = self._outputs[channel]
            true = output.voltage if index == 0 and output.on else 0.0
        gain, offset = (
            (unit.voltage_gain, unit.voltage_offset) if index == 0 else (unit.current_gain, unit.current_offset)
        )
        value = true * (1.0 + gain) + offset + float(self._random.normal(0.0, rating.noise[index]))
        return round(value / rating.resolution[index]) * rating.resolution[index]

    def _condition(self, channel: int) -> int:
        """Return the condition of one output: 0 off or unregulated, 1 CC, 2 CV, 3 fault."""
        if channel != self._wired:
            return _CONSTANT_VOLTAGE if self._outputs[channel].on else 0
        if not self._is_on(channel) and self._world.supply.tripped is None:
            return 0
        return {"cc": _CONSTANT_CURRENT, "cv": _CONSTANT_VOLTAGE, "tripped": _FAULT}.get(self._world.supply.mode(), 0)

    def _questionable(self) -> int:
        tripped = self._world.supply.tripped
        bits = {"voltage": _OVER_VOLTAGE_BIT, "current": _OVER_CURRENT_BIT}.get(tripped or "", 0)
        return bits | (_INSTRUMENT_SUMMARY if self._summaries.condition() else 0)

    def _tripped(self, call: Call, which: str) -> str:
        exactly(call.arguments, 0, 1)
        tripped = self._world.supply.tripped
        return ",".join(
            str(int(channel == self._wired and tripped == which)) for channel in self._channels(call.arguments)
        )

    def _clear_protection(self, call: Call) -> None:
        exactly(call.arguments, 0, 1)
        if self._wired in self._channels(call.arguments):
            self._world.supply.clear_trip()
            self._apply()

    # display

    def _show(self, call: Call) -> None:
        exactly(call.arguments, 1, 2)
        self._text = string(call.arguments[0])

    def _clear_text(self, call: Call) -> None:
        exactly(call.arguments, 0, 1)
        self._text = ""


def _leading_word(arguments: tuple[Argument, ...]) -> tuple[Argument | None, tuple[Argument, ...]]:
    """Take MIN, MAX or DEF off the front of a query's data elements."""
    if arguments and arguments[0].kind == "word":
        return arguments[0], arguments[1:]
    return None, arguments
