"""The :MEASure subsystem of the InfiniiVision, as far as a motor bench asks for it."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sim_instruments.instruments.keysight.infiniivision_acquisition import Acquisition
from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.parameters import choice, choices, exactly
from sim_instruments.scpi.tree import Call, CommandTree, Handling, bare

_SOURCES = {name: f"CHAN{n}" for n in range(1, 5) for name in (f"CHAN{n}", f"CHANNEL{n}")}
_INTERVALS, _TYPES = choices(("CYCLe", "DISPlay")), choices(("AC", "DC"))
_POINTS = 62_500
_NOT_MEASURABLE = 9.9e37

FloatArray = NDArray[np.float64]


@dataclass(frozen=True)
class _Function:
    """A measurement of a signal at an interval (s); the words that it takes before its source."""

    value: Callable[[FloatArray, float], float]
    words: tuple[str, ...] = ()


@dataclass(frozen=True)
class _Asked:
    channel: int
    cycles: bool = False
    without_mean: bool = False


class MeasureSubsystem:
    """Adds its headers to a tree and answers them from the last record of an acquisition."""

    def __init__(self, tree: CommandTree, acquisition: Acquisition) -> None:
        self._acquisition = acquisition
        self._source = 1
        tree.add("MEASure:SOURce", command=self._set_source, query=bare(lambda: f"CHAN{self._source}"))
        functions = {
            "FREQuency": _Function(_frequency),
            "PERiod": _Function(lambda signal, interval: _inverse(_frequency(signal, interval))),
            "VPP": _Function(lambda signal, _: float(np.ptp(signal))),
            "VMAX": _Function(lambda signal, _: float(signal.max())),
            "VMIN": _Function(lambda signal, _: float(signal.min())),
            "VAVerage": _Function(lambda signal, _: float(signal.mean()), ("interval",)),
            "VRMS": _Function(lambda signal, _: float(np.sqrt(np.mean(signal**2))), ("interval", "type")),
        }
        for name, function in functions.items():
            tree.add(f"MEASure:{name}", command=self._install(function), query=self._answer(function))

    def _set_source(self, call: Call) -> None:
        exactly(call.arguments, 1, 2)
        sources = [choice(argument, _SOURCES) for argument in call.arguments]
        self._source = int(sources[0][-1])

    def _asked(self, call: Call, function: _Function) -> _Asked:
        """Return what a measurement is asked of. Raises ScpiError for a word that is none of its own, or out of its order."""
        exactly(call.arguments, 0, len(function.words) + 1)
        tables = [{"interval": _INTERVALS, "type": _TYPES}[word] for word in function.words] + [_SOURCES]
        found: dict[str, str] = {}
        names = [*function.words, "source"]
        place = 0
        for argument in call.arguments:
            while place < len(tables) and argument.text not in tables[place]:
                place += 1
            if place == len(tables):
                raise ScpiError(-141 if argument.kind == "word" else -104)
            found[names[place]] = choice(argument, tables[place])
            place += 1
        source = found.get("source", f"CHAN{self._source}")
        return _Asked(int(source[-1]), found.get("interval") == "CYCL", found.get("type") == "AC")

    def _install(self, function: _Function) -> Callable[[Call], None]:
        def install(call: Call) -> None:
            self._asked(call, function)

        return install

    def _answer(self, function: _Function) -> Callable[[Call], Handling]:
        def answer(call: Call) -> Handling:
            asked = self._asked(call, function)
            record = self._acquisition.record()
            if record is None:
                return f"{_NOT_MEASURABLE:+.5E}"
            points = record.points(_POINTS)
            vertical = record.verticals[asked.channel]
            sampling = record.sampling(asked.channel, points)
            while not sampling.done:
                sampling.go_on()
                yield 0.0
            codes = sampling.words.astype(np.float64) / 256.0 - 128.0
            signal = codes * vertical.step + vertical.offset
            if asked.cycles:
                rising = _rising(signal)
                if len(rising) < 2:
                    return f"{_NOT_MEASURABLE:+.5E}"
                signal = signal[rising[0] : rising[-1]]
            if asked.without_mean:
                signal = signal - signal.mean()
            return f"{function.value(signal, record.span / points):+.5E}"

        return answer


def _inverse(value: float) -> float:
    return _NOT_MEASURABLE if value == _NOT_MEASURABLE else 1.0 / value


def _rising(signal: FloatArray) -> NDArray[np.intp]:
    """Return where a signal rises through its middle, with a tenth of its height as hysteresis."""
    low, high = float(signal.min()), float(signal.max())
    if high <= low:
        return np.zeros(0, dtype=np.intp)
    middle, band = 0.5 * (low + high), 0.1 * (high - low)
    sides = np.where(signal > middle + band, 1, np.where(signal < middle - band, -1, 0))
    known = sides[np.maximum.accumulate(np.where(sides != 0, np.arange(len(sides)), 0))]
    return np.flatnonzero((known[1:] > 0) & (known[:-1] < 0))


def _frequency(signal: FloatArray, interval: float) -> float:
    rising = _rising(signal)
    if len(rising) < 2:
        return _NOT_MEASURABLE
    return float((len(rising) - 1) / ((rising[-1] - rising[0]) * interval))
