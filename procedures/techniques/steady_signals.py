"""A steady voltage or current as an oscilloscope's channels show it, direct or alternating."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager

import numpy as np

from drivers.interfaces import Trigger, Waveform
from procedures.core.bench import Bench
from procedures.estimation.fitting.intervals import Interval, around
from procedures.techniques.acquisition import FILL, configure, record, set_range

#: A record (s) holds whole periods of mains hum, which falls out of its mean.
_RECORD_TIME, _POINTS = 0.1, 500
#: An oscilloscope that triggers by itself takes about so long (s) besides the record.
_BY_ITSELF = 0.06
#: A mean over a record is known within so much of a step of the converter.
_STEP = 0.5
#: An alternating signal is recorded with so many points; its range is fitted in so many attempts, until it fills this share.
_ALTERNATING_POINTS, _ATTEMPTS, _FILLED = 2000, 5, 0.3
#: A channel shows so much more than the largest value seen.
_ROOM = 1.3


def direct(bench: Bench, spans: Mapping[int, float]) -> dict[int, Waveform]:
    """Return a short record of each channel; `spans` is the most expected (V or A), either way."""
    for channel, span in spans.items():
        configure(bench.oscilloscope, channel, -span, span)
    bench.oscilloscope.configure_acquisition(_RECORD_TIME, _POINTS)
    return again(bench, list(spans))


def again(bench: Bench, channels: Sequence[int]) -> dict[int, Waveform]:
    """Return one more record, everything being set as before."""
    return _taken(bench, channels, _RECORD_TIME)


def risen(zero: Waveform, shown: Waveform) -> Interval:
    """Return by how much the mean of a channel lies above its zero, within its error: the channel's offset falls out."""
    rise = float(np.mean(shown.values) - np.mean(zero.values))
    return around(rise, gain=shown.accuracy.gain, offset=_STEP * shown.resolution)


def alternating(bench: Bench, channels: Sequence[int], span: float, record_time: float) -> dict[int, Waveform]:
    """Return a record (s) of channels in one range that fits the largest signal; `span` (V or A) is a first guess of it.

    All channels have one range, so that what one does not show is small beside the others.
    """
    bench.oscilloscope.configure_acquisition(record_time, _ALTERNATING_POINTS)
    waves: dict[int, Waveform] = {}
    before: list[float] = []
    for _ in range(_ATTEMPTS):
        ranges = [set_range(bench.oscilloscope, channel, 2.0 * span / FILL) for channel in channels]
        if ranges == before:
            # Channels and probes have no range that is nearer to the one wanted.
            break
        before = ranges
        waves = _taken(bench, channels, record_time)
        largest = max(float(np.max(np.abs(wave.values))) for wave in waves.values())
        resolution = max(wave.resolution for wave in waves.values())
        if any(wave.clipped for wave in waves.values()):
            span *= 4.0
        elif largest < _FILLED * span and largest > _ROOM * resolution:
            span = _ROOM * max(largest, 8.0 * resolution)
        else:
            break
    return waves


def _taken(bench: Bench, channels: Sequence[int], record_time: float) -> dict[int, Waveform]:
    """Return a record (s) that needs no trigger, asked for when it should be there."""

    @contextmanager
    def waiting() -> Iterator[None]:
        bench.clock.sleep(record_time + _BY_ITSELF)
        yield

    return record(bench, channels, Trigger(None), 10.0 + record_time, waiting)
