"""Strokes of an inverter's current, the voltages at the motor's terminals recorded by an oscilloscope at the same time."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

from drivers.interfaces import AcquisitionType, ChannelSettings, DqSample, MeasurementError, SetpointError, Trigger
from drivers.interfaces.text import text
from procedures.core.bench import Bench, ProcedureError
from procedures.estimation.fitting.fit import EstimationError, FloatArray
from procedures.estimation.flux.stroke_train import StrokeTrain, stroke_train
from procedures.techniques.acquisition import record

#: Samples of a stroke: each jump of the voltage is known to one of them.
_SAMPLES = 3000
#: The oscilloscope waits for this share of the largest voltage, which may come with any of the strokes: the record has all of their time
#: before its trigger, and so many strokes' time beyond them.
_LEVEL, _BEYOND = 0.1, 1.5
_ATTEMPTS, _PATIENCE = 12, 1.0
#: The voltages fill this share of the screen; below the second the range is narrowed once.
_FILL, _NARROW = 0.75, 0.3
_PHASES = np.exp(2j * np.pi / 3.0 * np.arange(3)) * (2.0 / 3.0)


@dataclass(frozen=True)
class StrokePlan:
    """Strokes to take: between `current` and `other` (A, d + j·q), each `duration` (s), an odd number of `strokes`."""

    current: complex
    other: complex
    duration: float
    strokes: int


@dataclass
class StrokeRecorder:
    """Takes trains of strokes; `channels` are on A, B, C against a star point, the rotor is `locked` or free.

    `voltage` (V, peak) is the largest that they may show. Of the last record, `accuracy` (relative) is the limit of the channels' gain, and
    `channel_gains` what each channel's samples were divided by.
    """

    bench: Bench
    channels: Sequence[int]
    voltage: float
    locked: bool = False
    accuracy: float = 0.0
    channel_gains: Mapping[str, float] = field(default_factory=dict)
    _for_step: float = 0.0
    _trigger: int = 0

    def take(self, plan: StrokePlan) -> StrokeTrain:
        """Take one train; what leaves the screen, or is small on it, is taken again with another range.

        Raises ProcedureError where no record shows the strokes.
        """
        change = abs(plan.other - plan.current)
        peak = min(self._for_step * change or self.voltage, self.voltage)
        narrowed = bool(self._for_step)
        why: Exception | None = None
        missed = 0
        for _ in range(_ATTEMPTS):
            try:
                waves, samples, step = self._record(plan, peak)
            except MeasurementError as error:
                # Across this phase there is too little of the voltage, or across all of them.
                why, self._trigger, missed = error, (self._trigger + 1) % len(self.channels), missed + 1
                peak *= _LEVEL if missed % len(self.channels) == 0 else 1.0
                continue
            size = float(np.max(np.abs(waves)))
            if step < 0.0:
                if peak >= 4.0 * self.voltage:
                    break
                peak = 2.0 * peak
                continue
            if size < _NARROW * peak and not narrowed:
                narrowed, peak = True, 1.2 * size
                continue
            try:
                train = train_of(self._times, waves, samples, step, locked=self.locked)
            except EstimationError as error:
                why = error
                continue
            self._for_step = size / change
            return train
        raise ProcedureError(
            text(
                "no record shows the strokes ({why}); check the probes on A, B, C and the star point",
                why=why or text("the voltage leaves the screen"),
            )
        )

    def _record(self, plan: StrokePlan, peak: float) -> tuple[FloatArray, Sequence[DqSample], float]:
        """Return voltages (3, n) in V, what the drive said, and the converter's step (V), −1 where a trace left the screen."""
        scope = self.bench.oscilloscope
        top = min(self._ranged(channel, 2.0 * peak / _FILL) for channel in self.channels)
        before = float(plan.strokes)
        lasting = before + plan.strokes - 1.0 + _BEYOND
        time = plan.duration * lasting
        scope.configure_acquisition(
            time, math.ceil(lasting * _SAMPLES), before / lasting, acquisition=AcquisitionType.HIGH_RESOLUTION
        )
        taken: list[DqSample] = []

        @contextmanager
        def strokes() -> Iterator[None]:
            # The record has to hold what there was before.
            self.bench.clock.sleep(before * plan.duration)
            first, second = plan.current, plan.other
            taken.extend(
                self.bench.inverter.alternate_dq_current(
                    first.real, first.imag, second.real, second.imag, plan.duration, plan.strokes
                )
            )
            yield

        trigger = Trigger(self.channels[self._trigger], _LEVEL * peak)
        waves = record(self.bench, self.channels, trigger, 2.0 * time + _PATIENCE, strokes)
        found = [waves[channel] for channel in self.channels]
        # A share of full scale is a large gain of a phase across which there is little; of the vector it is that of the largest phase.
        spans = [float(np.ptp(wave.values)) for wave in found]
        limits = [wave.accuracy.gain * span for wave, span in zip(found, spans, strict=True)]
        self.accuracy = max(limits) / max(max(spans), 1e-12)
        self._times = found[0].time
        verified, bare = self.bench.state.verified_channels, self.bench.bare_oscilloscope
        self.channel_gains = {str(wave.channel): verified.gain_of(wave, bare) for wave in found}
        count = min(wave.values.size for wave in found)
        clipped = any(wave.clipped for wave in found)
        if clipped and top < 2.0 * peak / _FILL:
            raise ProcedureError(
                text(
                    "the strokes' voltage leaves the largest range of the probes, {range:.4g} V; fit probes of a higher ratio, or lower "
                    "the bandwidth of the drive's current loop",
                    range=top,
                )
            )
        step = -1.0 if clipped else max(wave.resolution for wave in found)
        return np.array([wave.values[:count] for wave in found]), taken, step

    def _ranged(self, channel: int, wanted: float) -> float:
        """Set a channel's full scale (V), or the nearest that it has; return what was set."""
        try:
            self.bench.oscilloscope.configure_channel(channel, ChannelSettings(wanted))
        except SetpointError as refused:
            wanted = min(max(wanted, refused.low), refused.high)
            self.bench.oscilloscope.configure_channel(channel, ChannelSettings(wanted))
        return wanted


def train_of(
    time: FloatArray, waves: FloatArray, samples: Sequence[DqSample], step: float, *, locked: bool
) -> StrokeTrain:
    """Return the train of strokes in a record: voltages `waves` (3, n) in V of A, B, C, and what the drive said of it; `step` (V) is the
    oscilloscope's.

    Raises EstimationError where the record does not show all of them.
    """
    return stroke_train(
        time[: waves.shape[1]],
        np.asarray(_PHASES @ waves),
        [one.time for one in samples],
        [complex(one.d_current, one.q_current) for one in samples],
        [one.electrical_angle for one in samples],
        [one.electrical_speed for one in samples],
        resolution=step,
        locked=locked,
    )
