"""A current step recorded by an oscilloscope: its ranges, its trigger and a record as long as the current takes (§3.3.1)."""

from dataclasses import dataclass

import numpy as np

from drivers.interfaces import Slope, Trigger, Waveform
from procedures.core.bench import Bench
from procedures.estimation.winding.current_step.first_look import look_at_step
from procedures.estimation.winding.current_step.repeats import StepReading
from procedures.techniques.acquisition import configure, fill_screen, record
from procedures.techniques.winding.plots import step_plot
from procedures.techniques.winding.step_probes import StepSource

_POINTS = 10_000
_PRE_TRIGGER = 0.3
#: The record is long enough when it holds this many time constants, and not more than twice as many.
TIME_CONSTANTS = 9.0
#: The voltage may begin to rise this share of the record before the trigger; before that lies the baseline.
_LEAD = 0.2
_ATTEMPTS = 12
#: The ranges leave this many times as much room as the supply's zero may be off.
_ZERO_ROOM = 1.5


@dataclass(frozen=True)
class DrivenStep:
    """A step to be taken: the supply's voltage (V) and limit (A), the current at its end (A), its sign at the probe, and the channels."""

    voltage: float
    limit: float
    current: float
    forward: bool
    voltage_channel: int
    current_channel: int


@dataclass(frozen=True)
class RecordedStep:
    """Voltage and current of one step, and what drove it."""

    voltage: Waveform
    current: Waveform
    source: StepSource

    def reading(self, other_axis: float) -> StepReading:
        """Return it as the estimator takes it, with its `other_axis`."""
        v, i = self.voltage, self.current
        return StepReading(i.time, v.values, i.values, v.resolution, i.resolution, _ends(v), _ends(i), other_axis)


def record_steps(bench: Bench, step: DrivenStep, source: StepSource, guess: float, repeats: int) -> list[RecordedStep]:
    """Step until the record's length fits the time constant, then `repeats` times; `guess` (s) is its first length."""
    scope = bench.oscilloscope
    trigger = _set_ranges(bench, step, source)

    def once(record_time: float) -> RecordedStep:
        # The current of the step before must have died away: the loop is as slow to fall as to rise.
        bench.clock.sleep(record_time)
        scope.configure_acquisition(record_time, _POINTS, _PRE_TRIGGER)
        waves = record(
            bench,
            (step.voltage_channel, step.current_channel),
            trigger,
            timeout=10.0 + 2.0 * record_time,
            event=lambda: bench.supply.energised(step.voltage, step.limit),
        )
        voltage, current = waves[step.voltage_channel], waves[step.current_channel]
        bench.show(lambda: step_plot(current.time, voltage.values, current.values))
        return RecordedStep(voltage, current, source)

    record_time = guess
    for _ in range(_ATTEMPTS):
        seen = once(record_time)
        wanted = _wanted(seen)
        if scope.read_by_hand and wanted <= float(np.ptp(seen.current.time)):
            # A person sets width and ranges, and saves no record twice.
            return [seen, *(once(record_time) for _ in range(repeats - 1))]
        if 0.5 * record_time <= wanted <= record_time:
            # The steps to come are this one again: a scope's gain is stated of full scale, not of what is shown.
            for wave in (seen.voltage, seen.current):
                fill_screen(scope, wave)
            break
        record_time = min(max(1.3 * wanted, 0.05 * record_time), 4.0 * record_time)
    return [once(record_time) for _ in range(repeats)]


def _set_ranges(bench: Bench, step: DrivenStep, source: StepSource) -> Trigger:
    """Set both channels' ranges, and return by what to trigger."""
    sign = 1.0 if step.forward else -1.0
    # The supply gives more or less than it is set to.
    room = 1.3 + _ZERO_ROOM * source.zero / step.voltage
    fills = {}
    for channel, top in ((step.voltage_channel, step.voltage), (step.current_channel, step.current)):
        low, high = sorted((-0.1 * sign * top, room * sign * top))
        fills[channel] = abs(top) / configure(bench.oscilloscope, channel, low, high)
    # Triggered by the channel that the step fills better, for a small signal drowns in its noise.
    by_current = fills[step.current_channel] > 2.0 * fills[step.voltage_channel]
    channel, top = (step.current_channel, step.current) if by_current else (step.voltage_channel, step.voltage)
    return Trigger(channel, 0.3 * sign * top, Slope.RISING if step.forward else Slope.FALLING)


def _ends(wave: Waveform) -> tuple[float, float] | None:
    """Return the ends of a channel's range, where its samples reached them."""
    return (float(wave.values.min()), float(wave.values.max())) if wave.clipped else None


def _wanted(taken: RecordedStep) -> float:
    """Return how long (s) a record must be to hold a step like this one."""
    seen = look_at_step(taken.current.time, taken.voltage.values, taken.current.values)
    lead, ramp = max(-seen.begin, 0.0), seen.end - seen.begin
    return max(TIME_CONSTANTS * seen.time_constant + ramp / (1.0 - _PRE_TRIGGER), lead / _LEAD)
