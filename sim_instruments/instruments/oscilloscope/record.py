"""A record of the oscilloscope: what its converter made of the true signals."""

import math
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]
WordArray = NDArray[np.uint16]
Signal = Callable[[int, FloatArray], FloatArray]

DIVISIONS = 8
CLIPPED_LOW, CLIPPED_HIGH = 0x0001, 0xFFFF
_NOISE_DIVISIONS = 0.02
_NOISE_FLOOR = 1.5e-4
#: Samples taken at a time; where a sample depends on those before it, longer pieces have fewer seams.
_PIECE, _LONG_PIECE = 1 << 14, 1 << 16
#: Samples that a record keeps at most, the longest transfer of each of four channels; older ones are taken anew.
_MOST_KEPT = 16_000_000


@dataclass(frozen=True)
class Vertical:
    """Vertical setting of a channel and this unit's errors.

    `scale` and `offset` in V or A, `probe` attenuation, `gain_error` relative, `offset_error` of the full scale;
    `bits` of the converter, `noise_factor` for bandwidth limit, averaging or high resolution; `skew` (s) by which the trace is
    shown late. The screen is `steps` of the converter's 256 high, so it sees a little beyond; its middle is at `middle`.
    """

    scale: float
    offset: float
    probe: float
    inverted: bool = False
    ac_coupled: bool = False
    gain_error: float = 0.0
    offset_error: float = 0.0
    bits: int = 8
    noise_factor: float = 1.0
    skew: float = 0.0
    steps: int = 200
    middle: int = 128

    @property
    def step(self) -> float:
        """One of the 256 steps (V or A)."""
        return DIVISIONS * self.scale / self.steps

    @property
    def noise(self) -> float:
        """Standard deviation of the noise (V or A)."""
        return math.hypot(_NOISE_DIVISIONS * self.scale, _NOISE_FLOOR * self.probe) * self.noise_factor

    def displayed(self, true: FloatArray) -> FloatArray:
        """Return the signal as the unit's errors and its polarity show it, without noise."""
        signal = true * ((-1.0 if self.inverted else 1.0) * (1.0 + self.gain_error))
        signal += self.offset_error * DIVISIONS * self.scale
        return signal

    def words(self, displayed: FloatArray, generator: np.random.Generator) -> WordArray:
        """Return what the converter gives, 16 bits left-aligned, clipped ends marked."""
        fine = float(1 << (self.bits - 8))
        codes = generator.standard_normal(len(displayed), dtype=np.float32).astype(np.float64)
        codes *= self.noise / self.step * fine
        codes += (displayed - self.offset) * (fine / self.step) + self.middle * fine
        np.rint(codes, out=codes)
        codes *= 256.0 / fine
        # The lowest code of the converter stands for a hole in the data and never for a sample.
        np.clip(codes, CLIPPED_LOW, CLIPPED_HIGH, out=codes)
        return codes.astype(np.uint16)


@dataclass
class Record:
    """One acquisition: trigger times (s, several when averaged), the span around them, and each channel's setting."""

    triggers: tuple[float, ...]
    origin: float
    span: float
    available: int
    verticals: dict[int, Vertical]
    seed: tuple[int, ...]
    time_base_error: float
    signal: Signal
    #: Whether samples depend on others before them.
    filtered: bool = False
    _samplings: "dict[tuple[int, int], Sampling]" = field(default_factory=dict)

    @property
    def end(self) -> float:
        """Time (s) at which the last sample was taken."""
        return max(self.triggers) + max(self.origin + self.span, 0.0)

    def points(self, wanted: int) -> int:
        """Return how many points a transfer of at most `wanted` gives."""
        return max(1, min(wanted, self.available))

    def sampling(self, channel: int, points: int) -> "Sampling":
        """Return the samples of a channel at `points` evenly spaced times on their way, or as they were taken before."""
        sampling = self._samplings.get((channel, points))
        if sampling is None:
            kept = self._samplings
            while kept and sum(count for _, count in kept) + points > _MOST_KEPT:
                del kept[next(iter(kept))]
            sampling = kept[channel, points] = Sampling(self, channel, points)
        return sampling

    def words(self, channel: int, points: int) -> WordArray:
        """Return the samples of a channel at `points` evenly spaced times at once."""
        sampling = self.sampling(channel, points)
        while not sampling.done:
            sampling.go_on()
        return sampling.words


class Sampling:
    """Samples of a channel, 16 bits left-aligned, taken piece by piece; `words` holds them once it is `done`."""

    def __init__(self, record: Record, channel: int, points: int) -> None:
        self.words: WordArray = np.zeros(points, dtype=np.uint16)
        self._record, self._channel = record, channel
        self._generator = np.random.default_rng((*record.seed, channel, points))
        self._pieces = self._sample()
        self.done = False

    def go_on(self) -> None:
        """Do a piece of the work."""
        self.done = next(self._pieces, True)

    def _sample(self) -> Iterator[bool]:
        record, points = self._record, len(self.words)
        vertical, interval = record.verticals[self._channel], record.span / points
        piece = _LONG_PIECE if record.filtered else _PIECE
        for start in range(0, points, piece):
            index = np.arange(start, min(start + piece, points), dtype=np.float64)
            offsets = (record.origin + index * interval) * (1.0 + record.time_base_error)
            signal = np.zeros(len(index))
            for trigger in record.triggers:
                signal += record.signal(self._channel, trigger + offsets)
                yield False
            signal /= len(record.triggers)
            self.words[start : start + len(index)] = vertical.words(vertical.displayed(signal), self._generator)


def trace(record: Record, channel: int, points: int) -> Generator[float, None, FloatArray]:
    """Return what a channel shows (V or A), made in pieces, others served in between."""
    vertical = record.verticals[channel]
    sampling = record.sampling(channel, points)
    while not sampling.done:
        sampling.go_on()
        yield 0.0
    codes = sampling.words.astype(np.float64) / 256.0 - vertical.middle
    return codes * vertical.step + vertical.offset
