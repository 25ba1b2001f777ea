"""The :MEASure subsystem of the InfiniiVision, as far as a motor bench asks for it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from sim_instruments.instruments.oscilloscope import pulse
from sim_instruments.instruments.oscilloscope.acquisition import Acquisition
from sim_instruments.instruments.oscilloscope.channels import SOURCES
from sim_instruments.instruments.oscilloscope.pulse import NOT_MEASURABLE
from sim_instruments.instruments.oscilloscope.record import trace
from sim_instruments.instruments.scpi_oscilloscope import LEAST_HEIGHT
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import choice, choices, exactly
from sim_instruments.scpi.tree import Call, CommandTree, Handling, bare

_INTERVALS, _TYPES = choices(("CYCLe", "DISPlay")), choices(("AC", "DC"))
_TABLES = {"interval": _INTERVALS, "type": _TYPES, "source": SOURCES, "second": SOURCES}
_POINTS = 62_500

#: What is made of the traces (V or A) of one source or two, in samples where it is a time.
Value = Callable[..., float]


@dataclass(frozen=True)
class _Function:
    """A measurement and the words that it takes; a `time` comes in samples, `edges` need a signal that stands out of the noise."""

    value: Value
    words: tuple[str, ...] = ("source",)
    time: bool = False
    edges: bool = False


@dataclass(frozen=True)
class _Asked:
    channels: tuple[int, ...]
    cycles: bool = False
    without_mean: bool = False


_PAIR = ("source", "second")
_FUNCTIONS = {
    "PERiod": _Function(pulse.period, time=True, edges=True),
    "VPP": _Function(lambda signal: float(np.ptp(signal))),
    "VMAX": _Function(lambda signal: float(signal.max())),
    "VMIN": _Function(lambda signal: float(signal.min())),
    "VAVerage": _Function(lambda signal: float(signal.mean()), ("interval", "source")),
    "VRMS": _Function(lambda signal: float(np.sqrt(np.mean(signal**2))), ("interval", "type", "source")),
    "VTOP": _Function(lambda signal: pulse.base_and_top(signal)[1]),
    "VBASe": _Function(lambda signal: pulse.base_and_top(signal)[0]),
    "VAMPlitude": _Function(lambda signal: float(np.diff(pulse.base_and_top(signal))[0])),
    "RISetime": _Function(lambda signal: pulse.edge_time(signal, rising=True), time=True, edges=True),
    "FALLtime": _Function(lambda signal: pulse.edge_time(signal, rising=False), time=True, edges=True),
    "PWIDth": _Function(lambda signal: pulse.width(signal, positive=True), time=True, edges=True),
    "NWIDth": _Function(lambda signal: pulse.width(signal, positive=False), time=True, edges=True),
    "DUTYcycle": _Function(pulse.duty_cycle, edges=True),
    "OVERshoot": _Function(pulse.overshoot, edges=True),
    "PREShoot": _Function(pulse.preshoot, edges=True),
    "DELay": _Function(pulse.delay, _PAIR, time=True, edges=True),
    "PHASe": _Function(pulse.phase, _PAIR, edges=True),
}


class MeasureSubsystem:
    """Adds its headers to a tree and answers them from the last record of an acquisition."""

    def __init__(self, tree: CommandTree, acquisition: Acquisition) -> None:
        self._acquisition = acquisition
        self.reset()
        tree.add("MEASure:SOURce", command=self._set_source, query=bare(lambda: f"CHAN{self._sources[0]}"))
        tree.add("MEASure:CLEar", command=bare(lambda: None))
        for name, function in _FUNCTIONS.items():
            tree.add(f"MEASure:{name}", command=self._install(function), query=self._answer(function))
        period = self._answer(_FUNCTIONS["PERiod"])

        def frequency(call: Call) -> Handling:
            return _inverse(str((yield from period(call))))

        for name in ("FREQuency", "COUNter"):
            command = self._install(_FUNCTIONS["PERiod"])
            tree.add(f"MEASure:{name}", command=command, query=frequency)

    def reset(self) -> None:
        """Return to channels 1 and 2."""
        self._sources = (1, 2)

    def _set_source(self, call: Call) -> None:
        exactly(call.arguments, 1, 2)
        sources = [int(choice(argument, SOURCES)[-1]) for argument in call.arguments]
        self._sources = (sources[0], sources[1] if len(sources) == 2 else self._sources[1])

    def _asked(self, call: Call, function: _Function) -> _Asked:
        """Return what a measurement is asked of. Raises ScpiError for a word that is none of its own, or out of its order."""
        exactly(call.arguments, 0, len(function.words))
        tables = [_TABLES[word] for word in function.words]
        found: dict[str, str] = {}
        place = 0
        for argument in call.arguments:
            while place < len(tables) and argument.text not in tables[place]:
                place += 1
            if place == len(tables):
                raise ScpiError(-141 if argument.kind == "word" else -104)
            found[function.words[place]] = choice(argument, tables[place])
            place += 1
        places = [word for word in function.words if word in ("source", "second")]
        set_ = dict(zip(("source", "second"), self._sources, strict=True))
        channels = tuple(int(found[word][-1]) if word in found else set_[word] for word in places)
        return _Asked(channels, found.get("interval") == "CYCL", found.get("type") == "AC")

    def _install(self, function: _Function) -> Callable[[Call], None]:
        def install(call: Call) -> None:
            self._asked(call, function)

        return install

    def _answer(self, function: _Function) -> Callable[[Call], Handling]:
        def answer(call: Call) -> Handling:
            asked = self._asked(call, function)
            record = self._acquisition.record()
            if record is None:
                return f"{NOT_MEASURABLE:+.5E}"
            points = record.points(_POINTS)
            signals = []
            for channel in asked.channels:
                signals.append((yield from trace(record, channel, points)))
            if asked.cycles:
                rising = pulse.crossings(signals[0])
                if len(rising) < 2:
                    return f"{NOT_MEASURABLE:+.5E}"
                signals[0] = signals[0][round(rising[0]) : round(rising[-1])]
            if asked.without_mean:
                signals[0] = signals[0] - signals[0].mean()
            least = [LEAST_HEIGHT * record.verticals[channel].scale for channel in asked.channels]
            seen = all(float(np.ptp(signal)) >= height for signal, height in zip(signals, least, strict=True))
            value = function.value(*signals) if seen or not function.edges else NOT_MEASURABLE
            if function.time and value != NOT_MEASURABLE:
                value *= record.span / points
            return f"{value:+.5E}"

        return answer


def _inverse(told: str) -> str:
    value = float(told)
    return told if value == NOT_MEASURABLE else f"{1.0 / value:+.5E}"
