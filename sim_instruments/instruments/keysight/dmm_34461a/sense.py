"""Measuring settings of each function of the 34461A: range, integration, autozero, bandwidth, gate (Truevolt guide, SENSe
subsystem).
"""

import math
from collections.abc import Callable
from functools import partial

from sim_instruments.instruments.keysight.dmm_34461a import conversion
from sim_instruments.instruments.keysight.dmm_34461a.functions import CURR_AC, CURR_DC, FRES, PER, Function
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.lexer import Argument
from sim_instruments.scpi.parameters import boolean, exactly, number
from sim_instruments.scpi.tree import Call, CommandTree

#: The window (s) over which a signal's RMS is taken, by the lowest frequency (Hz) that the filter lets through.
_WINDOWS = {3.0: 2.5, 20.0: 0.625, 200.0: 0.025}
_GATES = (0.01, 0.1, 1.0)
#: What a gate resolves, as a share of what is counted, and what can be counted (Hz, or s of a period).
_RESOLVED = ((0.01, 1.0e-4), (0.1, 1.0e-5))
_COUNTED = (1.0 / 3.0e5, 3.0e5)
#: The highest current (A) on the common current terminals; the range above has its own.
_COMMON_CURRENT = 3.0
_FASTEST, _SLOWEST = min(conversion.RESOLUTIONS), max(conversion.RESOLUTIONS)
_AUTOMATIC = ("AUTO", "DEF", "DEFAULT")


class FunctionSettings:
    """The settings of one function, or of two that share them.

    `sensed` tells the value that autoranging once would see; `changed` is told of every change.
    """

    def __init__(self, function: Function, sensed: Callable[[], float], changed: Callable[[], None]) -> None:
        self._function = function
        self._sensed = sensed
        self._changed = changed
        self.reset()

    def reset(self) -> None:
        """Return to autoranging, 10 power-line cycles with autozero, a bandwidth from 20 Hz, a gate of 0.1 s."""
        self.range, self.auto = self._function.preset, True
        self.cycles, self.zero = 10.0, True
        self.lowest, self.gate = 20.0, 0.1

    @property
    def resolution(self) -> float:
        """The resolution as a share of the range."""
        integrated = self._function.kind == "integral"
        return conversion.RESOLUTIONS[self.cycles] if integrated else conversion.FIXED_RESOLUTION

    @property
    def aperture(self) -> float:
        """The time (s) over which the input is measured for a reading."""
        kind = self._function.kind
        if kind == "rms":
            return _WINDOWS[self.lowest]
        return self.gate if kind == "count" else self.cycles * conversion.LINE_CYCLE

    def duration(self, function: Function) -> float:
        """Return how long (s) a reading of a function takes: with autozero, which four wires always have, its own zero as long again."""
        zeroed = function.kind == "integral" and (self.zero or function is FRES)
        return self.aperture * (2.0 if zeroed else 1.0)

    def configure(self, arguments: tuple[Argument, ...]) -> None:
        """Set what CONFigure gives, range and resolution, and all else as after a reset. Raises ScpiError."""
        exactly(arguments, 0, 0 if self._function.fixed else 2)
        if self._function.kind == "count":
            gate = _gate_for(arguments)
            self.reset()
            self.gate = gate
            return
        auto = not arguments or (arguments[0].kind == "word" and arguments[0].text in _AUTOMATIC)
        resolved = len(arguments) == 2 and arguments[1].text not in ("DEF", "DEFAULT")
        full_scale = self.range if auto else self._parse_range(arguments[0], self._function.ranges[-1])
        cycles = 10.0
        if resolved and self._function.kind == "integral":
            if auto:
                # Without a range there is nothing that a resolution could be a share of.
                raise ScpiError(-221)
            cycles = self._parse_resolution(arguments[1], full_scale)
        self.reset()
        self.range, self.auto, self.cycles, self.zero = full_scale, auto, cycles, cycles >= 1.0

    def messages(self, function: Function) -> list[str]:
        """Return what sets a function that has been reset to what it is."""
        header = ":" + function.word
        found = []
        if function.kind == "integral" and function.null_limit:
            found.append(f"{header}:NPLC {self.cycles:g}")
        if function.zeroed:
            found.append(f"{header}:ZERO:AUTO {self.zero:d}")
        if function.kind == "rms":
            found.append(f"{header}:BAND {self.lowest:g}")
        if function.kind == "count":
            found += [f"{header}:RANG:LOW {self.lowest:g}", f"{header}:APER {self.gate:g}"]
            header += ":VOLT"
        if function in (CURR_DC, CURR_AC) and self.range > _COMMON_CURRENT:
            return [*found, f"{header}:TERM 10"]
        return (
            found if function.fixed else [*found, f"{header}:RANG {self.range:g}", f"{header}:RANG:AUTO {self.auto:d}"]
        )

    def add_headers(self, tree: CommandTree, function: Function) -> None:
        """Add the headers that a function has below SENSe."""
        add, header = tree.add, f"[SENSe]:{function.header}"
        if function.kind == "integral" and function.null_limit:
            add(f"{header}:NPLCycles", command=self._set_cycles, query=self._get_cycles)
        if function.kind == "integral" and not function.fixed:
            add(f"{header}:RESolution", command=self._set_resolution, query=self._get_resolution)
        if not function.fixed:
            ranged = f"{header}:VOLTage:RANGe" if function.kind == "count" else f"{header}:RANGe"
            add(f"{ranged}[:UPPer]", command=self._set_range, query=self._get_range)
            add(f"{ranged}:AUTO", command=self._set_auto, query=self._flag(lambda: self.auto))
        if function.zeroed:
            add(f"{header}:ZERO:AUTO", command=self._set_zero, query=self._flag(lambda: self.zero))
        if function.kind != "integral":
            lowest = f"{header}:RANGe:LOWer" if function.kind == "count" else f"{header}:BANDwidth"
            add(lowest, command=self._set_lowest, query=self._number(lambda: self.lowest))
        if function.kind == "count":
            add(f"{header}:APERture", command=self._set_gate, query=self._number(lambda: self.gate))
        if function in (CURR_DC, CURR_AC):
            add(f"{header}:TERMinals", command=self._set_terminals, query=self._terminals)

    @staticmethod
    def _flag(read: Callable[[], bool]) -> Callable[[Call], str]:
        def reply(call: Call) -> str:
            exactly(call.arguments, 0)
            return str(int(read()))

        return reply

    @staticmethod
    def _number(read: Callable[[], float]) -> Callable[[Call], str]:
        def reply(call: Call) -> str:
            exactly(call.arguments, 0)
            return f"{read():+.8E}"

        return reply

    def _set_range(self, call: Call) -> None:
        exactly(call.arguments, 1)
        highest = self._function.ranges[-1]
        if self._function in (CURR_DC, CURR_AC):
            highest = _COMMON_CURRENT
        self.range, self.auto = self._parse_range(call.arguments[0], highest), False
        self._changed()

    def _get_range(self, call: Call) -> str:
        exactly(call.arguments, 0, 1)
        asked = self._parse_range(call.arguments[0], self._function.ranges[-1]) if call.arguments else self.range
        return f"{asked:+.8E}"

    def _set_auto(self, call: Call) -> None:
        exactly(call.arguments, 1)
        once = _once(call.arguments[0])
        auto = not once and boolean(call.arguments[0])
        if once:
            self.range = conversion.ranged(self.range, self._sensed(), self._function.ranges)
        self.auto = auto
        self._changed()

    def _set_zero(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self.zero = not _once(call.arguments[0]) and boolean(call.arguments[0])
        self._changed()

    def _set_cycles(self, call: Call) -> None:
        exactly(call.arguments, 1)
        self.cycles = _parse_cycles(call.arguments[0])
        self._changed()

    def _get_cycles(self, call: Call) -> str:
        exactly(call.arguments, 0, 1)
        return f"{_parse_cycles(call.arguments[0]) if call.arguments else self.cycles:+.8E}"

    def _set_resolution(self, call: Call) -> None:
        exactly(call.arguments, 1)
        if self.auto:
            raise ScpiError(-221)
        self.cycles = self._parse_resolution(call.arguments[0], self.range)
        self._changed()

    def _get_resolution(self, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{self.resolution * self.range:+.8E}"

    def _set_lowest(self, call: Call) -> None:
        exactly(call.arguments, 1)
        wanted = number(call.arguments[0], min(_WINDOWS), 3.0e5, default=20.0, unit="HZ")
        # The slowest filter that still lets through what is asked for.
        self.lowest = max(entry for entry in _WINDOWS if entry <= wanted)
        self._changed()

    def _set_gate(self, call: Call) -> None:
        exactly(call.arguments, 1)
        wanted = number(call.arguments[0], _GATES[0], _GATES[-1], default=0.1, unit="S")
        self.gate = next(entry for entry in _GATES if entry >= wanted * (1.0 - 1e-9))
        self._changed()

    def _set_terminals(self, call: Call) -> None:
        exactly(call.arguments, 1)
        wanted = number(call.arguments[0], _COMMON_CURRENT, self._function.ranges[-1], default=_COMMON_CURRENT)
        if wanted not in (_COMMON_CURRENT, self._function.ranges[-1]):
            raise ScpiError(-224)
        self.range, self.auto = (wanted, False) if wanted > _COMMON_CURRENT else (self._function.preset, True)
        self._changed()

    def _terminals(self, call: Call) -> str:
        exactly(call.arguments, 0)
        return f"{10 if self.range > _COMMON_CURRENT else 3:+d}"

    def _parse_range(self, argument: Argument, highest: float) -> float:
        function = self._function
        default, unit = function.preset, "V" if function.kind == "count" else function.unit
        return conversion.range_for(number(argument, 0.0, highest, default=default, unit=unit), function.ranges)

    def _parse_resolution(self, argument: Argument, full_scale: float) -> float:
        if argument.kind == "word":
            finest, coarsest = min(conversion.RESOLUTIONS.values()), max(conversion.RESOLUTIONS.values())
            relative = number(argument, finest, coarsest, default=conversion.RESOLUTIONS[10.0])
        else:
            relative = number(argument, 0.0, math.inf, unit=self._function.unit) / full_scale
        cycles = conversion.cycles_for_resolution(relative)
        if cycles is None:
            raise ScpiError(-222)
        return cycles


def settings_by_function(
    functions: tuple[Function, ...], sensed: Callable[[Function], float], changed: Callable[[], None]
) -> dict[str, FunctionSettings]:
    """Return the settings of every function by its word; two- and four-wire resistance, frequency and period have theirs in common."""
    result: dict[str, FunctionSettings] = {}
    for function in functions:
        common = {FRES.word: "RES", PER.word: "FREQ"}.get(function.word)
        own = FunctionSettings(function, partial(sensed, function), changed)
        result[function.word] = own if common is None else result[common]
    return result


def _parse_cycles(argument: Argument) -> float:
    return conversion.cycles_for(number(argument, _FASTEST, _SLOWEST, default=10.0))


def _gate_for(arguments: tuple[Argument, ...]) -> float:
    """Return the gate (s) for CONFigure's data elements of a counting function: what is expected, in Hz or s, and a resolution of it."""
    words = [one.kind == "word" and one.text in _AUTOMATIC for one in arguments]
    expected = 1.0 if not arguments or words[0] else number(arguments[0], *_COUNTED)
    if len(arguments) < 2 or words[1]:
        return 0.1
    if arguments[1].kind == "word":
        return number(arguments[1], _GATES[-1], _GATES[0])
    relative = number(arguments[1], 0.0, math.inf) / expected
    return next((gate for gate, share in _RESOLVED if relative >= share * (1.0 - 1e-9)), _GATES[-1])


def _once(argument: Argument) -> bool:
    return argument.kind == "word" and argument.text == "ONCE"
