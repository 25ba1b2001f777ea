"""A steady voltage or current as an oscilloscope's channels show it."""

from collections.abc import Mapping, Sequence

import numpy as np

from drivers.interfaces import Trigger, Waveform
from procedures.bench import Bench
from procedures.estimation.intervals import Interval, around
from procedures.recording import configure, record

_RECORD_TIME, _POINTS = 5e-3, 500
#: A mean over a record is known within so much of a step of the converter.
_STEP = 0.5


def direct(bench: Bench, spans: Mapping[int, float]) -> dict[int, Waveform]:
    """Return a short record of each channel; `spans` is the most expected (V or A), either way."""
    for channel, span in spans.items():
        configure(bench.oscilloscope, channel, -span, span)
    bench.oscilloscope.configure_acquisition(_RECORD_TIME, _POINTS)
    return again(bench, list(spans))


def again(bench: Bench, channels: Sequence[int]) -> dict[int, Waveform]:
    """Return one more record, everything being set as before."""
    return record(bench, channels, Trigger(None), 10.0 + _RECORD_TIME)


def risen(zero: Waveform, shown: Waveform) -> Interval:
    """Return by how much the mean of a channel lies above its zero, within its error: the channel's offset falls out."""
    rise = float(np.mean(shown.values) - np.mean(zero.values))
    return around(rise, gain=shown.accuracy.gain, offset=_STEP * shown.resolution)
