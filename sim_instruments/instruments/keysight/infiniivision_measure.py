"""The :MEASure subsystem of the InfiniiVision, as far as a motor bench asks for it."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from sim_instruments.instruments.keysight.infiniivision_acquisition import Acquisition
from sim_instruments.scpi.parameters import choice, exactly
from sim_instruments.scpi.tree import Call, CommandTree

_SOURCES = {name: n for n in range(1, 5) for name in (f"CHAN{n}", f"CHANNEL{n}")}
_POINTS = 62_500
_NOT_MEASURABLE = 9.9e37

FloatArray = NDArray[np.float64]


class MeasureSubsystem:
    """Adds its headers to a tree and answers them from the last record of an acquisition."""

    def __init__(self, tree: CommandTree, acquisition: Acquisition) -> None:
        self._acquisition = acquisition
        self._source = 1
        tree.add("MEASure:SOURce", command=self._set_source, query=lambda _: f"CHAN{self._source}")
        functions: dict[str, Callable[[FloatArray, float], float]] = {
            "FREQuency": _frequency,
            "PERiod": lambda signal, interval: _inverse(_frequency(signal, interval)),
            "VPP": lambda signal, _: float(np.ptp(signal)),
            "VMAX": lambda signal, _: float(signal.max()),
            "VMIN": lambda signal, _: float(signal.min()),
            "VAVerage": lambda signal, _: float(signal.mean()),
            "VRMS": lambda signal, _: float(np.sqrt(np.mean(signal**2))),
        }
        for name, function in functions.items():
            tree.add(f"MEASure:{name}", command=lambda _: None, query=self._answer(function))

    def _set_source(self, call: Call) -> None:
        exactly(call.arguments, 1, 2)
        choice(call.arguments[0], {name: name for name in _SOURCES})
        self._source = _SOURCES[call.arguments[0].text]

    def _answer(self, function: Callable[[FloatArray, float], float]) -> Callable[[Call], str]:
        def answer(call: Call) -> str:
            words = [argument for argument in call.arguments if argument.text in _SOURCES]
            channel = _SOURCES[words[-1].text] if words else self._source
            record = self._acquisition.record()
            if record is None:
                return f"{_NOT_MEASURABLE:+.5E}"
            points = record.points(_POINTS)
            vertical = record.verticals[channel]
            codes = record.words(channel, points).astype(np.float64) / 256.0 - 128.0
            return f"{function(codes * vertical.step + vertical.offset, record.span / points):+.5E}"

        return answer


def _inverse(value: float) -> float:
    return _NOT_MEASURABLE if value == _NOT_MEASURABLE else 1.0 / value


def _frequency(signal: FloatArray, interval: float) -> float:
    low, high = float(signal.min()), float(signal.max())
    middle, band = 0.5 * (low + high), 0.1 * (high - low)
    sides = np.where(signal > middle + band, 1, np.where(signal < middle - band, -1, 0))
    known = sides[np.maximum.accumulate(np.where(sides != 0, np.arange(len(sides)), 0))]
    rising = np.flatnonzero((known[1:] > 0) & (known[:-1] < 0))
    if len(rising) < 2 or high <= low:
        return _NOT_MEASURABLE
    return float((len(rising) - 1) / ((rising[-1] - rising[0]) * interval))
