"""Use of an oscilloscope: the voltage between two terminals of a turned shaft, and a current in a wire."""

import math
from typing import Any

import numpy as np

from bench.i18n.errors import InputError
from bench.testing.conformance.report import Checks
from bench.testing.conformance.session import CheckSession
from bench.testing.conformance.stand import OneInstrumentBench
from drivers.interfaces import ChannelSettings, MeasurementError, OverloadError, ProbeKind, Slope, Trigger, Waveform
from drivers.interfaces.text import text

_SPEED = 120.0
#: Length (s) of a record, and its least number of points.
_RECORD, _POINTS = 0.05, 400
#: Length (s) of one whose parts are waited for.
_LONG = 4.0
_OF_SPAN = "A share of full scale is a larger one of what the trace spans"
#: How probes are stated where there are none.
_EXAMPLE = '{"probes": {1: Probe(ProbeKind.VOLTAGE, attenuation=10.0), 2: Probe(ProbeKind.VOLTAGE, attenuation=10.0)}}'


def _prepare(stand: OneInstrumentBench) -> None:
    _turn(stand, _SPEED)


def _turn(stand: OneInstrumentBench, speed: float) -> None:
    stand.world.turn_shaft(speed)
    stand.wait(1.0)


def _amplitude(stand: OneInstrumentBench, channel: int) -> float:
    """Return half the peak-to-peak value (V or A) of what a channel's probe senses."""
    now = stand.bench.clock.now()
    signal = stand.world.probe_signal(channel, np.linspace(now - 0.05, now, 501))
    return float(np.ptp(signal)) / 2.0


def _frequency(stand: OneInstrumentBench) -> float:
    """Return the electrical frequency (Hz) of the turned shaft."""
    return float(abs(stand.world.shaft_velocity()) * stand.world.motor.pole_pairs / (2.0 * math.pi))


def _voltage_channels(stand: OneInstrumentBench, scope: Any) -> list[int]:
    channels = list(scope.channels(ProbeKind.VOLTAGE))
    if not channels:
        raise InputError(
            text(
                "the oscilloscope under test has no voltage probe in its options, and nothing to measure with: state them, "
                "options={example}",
                example=_EXAMPLE,
            )
        )
    for number, channel in enumerate(channels):
        stand.world.attach_voltage_probe(channel, *(("A", "B") if number == 0 else ("B", "C")))
    return channels


def _record(
    stand: OneInstrumentBench, scope: Any, channels: list[int], trigger: Trigger, share: float, points: int = _POINTS
) -> dict[int, Waveform]:
    scope.configure_acquisition(_RECORD, points, share)
    scope.configure_trigger(trigger)
    scope.initiate()
    result: dict[int, Waveform] = scope.fetch(channels, 2.0)
    return result


def _compare(
    stand: OneInstrumentBench,
    checks: Checks,
    waveform: Waveform,
    channel: int,
    unit: str,
    trigger: Trigger,
    share: float,
    points: int = _POINTS,
) -> None:
    remedy = "Compare the preamble's increments, origins and references, and the byte order, with the manual"
    time, values = waveform.time, waveform.values
    same, enough = (waveform.channel, waveform.unit) == (channel, unit), len(time) == len(values) >= points
    checks.that("waveform: channel and unit", same, f"{waveform.unit}", remedy)
    checks.that("waveform: number of points", enough, f"{len(values)}", remedy)
    checks.close("waveform: length", float(time[-1] - time[0]), _RECORD, 2e-3, "Compare the time scale: s a division?")
    checks.close("waveform: share before the trigger", float(-time[0]), share * _RECORD, 2e-3, remedy)
    accuracy = waveform.accuracy
    actual = _amplitude(stand, channel)
    found = float(np.ptp(values)) / 2.0
    allowed = accuracy.gain * actual + 4.0 * waveform.resolution + 0.01 * actual
    checks.close("waveform: amplitude", found, actual, allowed, remedy)
    checks.close("waveform: mean", float(values.mean()), 0.0, accuracy.offset + 0.15 * actual, remedy)
    right = 0.0 < accuracy.gain <= 0.1 and 0.0 < accuracy.offset <= 0.5 * actual and bool(accuracy.source)
    advice = "State it as the manual does: of the full scale, a division, or the reading"
    checks.that("waveform: accuracy", right, f"{accuracy}", advice)
    if (stated := checks.manual.full_scale_gain) is not None:
        lowest, highest = float(values.min()), float(values.max())
        span = max(highest - lowest, abs(lowest), abs(highest))
        checks.close("waveform: gain", accuracy.gain * span / waveform.full_scale, stated, 0.01 * stated, _OF_SPAN)
    steps = np.unique(np.abs(np.diff(values)))
    least = float(steps[steps > 1e-9 * actual].min())
    right = 0.2 * least <= waveform.resolution <= 5.0 * least
    message = f"{waveform.resolution:.3g} {unit}, the samples are {least:.3g} {unit} apart"
    checks.that("waveform: resolution", right, message, "It is one step of the converter")
    checks.that("waveform: not clipped", not waveform.clipped, "said to be clipped", remedy)
    if trigger.channel == channel:
        at = int(np.argmin(np.abs(time)))
        advice = "Compare level and time zero"
        checks.close("trigger: level", float(values[at]), trigger.level, 0.05 * actual + accuracy.offset, advice)
        slope = float(values[min(at + len(values) // 50, len(values) - 1)] - values[max(at - len(values) // 50, 0)])
        right = (slope > 0.0) is (trigger.slope is Slope.RISING)
        checks.that("trigger: slope", right, f"{slope:g} {unit}", "Compare the slope")


def _show(stand: OneInstrumentBench, scope: Any, channel: int, offset: float = 0.0, screens: float = 4.0) -> float:
    """Put a channel's trace on the screen; return its amplitude."""
    amplitude = _amplitude(stand, channel)
    scope.configure_channel(channel, ChannelSettings(screens * amplitude, offset * amplitude))
    return amplitude


def _brief(stand: OneInstrumentBench, scope: Any, checks: Checks) -> None:
    channel = _voltage_channels(stand, scope)[0]
    checks.that("gives_waveforms", scope.gives_waveforms, "it says no", "Say so where samples can be fetched")
    amplitude = _show(stand, scope, channel)
    trigger = Trigger(channel, 0.3 * amplitude)
    found = _record(stand, scope, [channel], trigger, 0.25)[channel]
    _compare(stand, checks, found, channel, "V", trigger, 0.25)
    _screen(stand, scope, checks, found)


def _screen(stand: OneInstrumentBench, scope: Any, checks: Checks, waveform: Waveform) -> None:
    """Check the instrument's own measurements of a trace, of which a waveform was just fetched."""
    channel = waveform.channel
    frequency = _frequency(stand)
    checks.reading("measure_frequency", scope.measure_frequency(channel), frequency, "Hz", 0.02 * frequency)
    reading = scope.measure_amplitude(channel)
    checks.reading("measure_amplitude", reading, _amplitude(stand, channel), "V", 0.02 * reading.value)
    if (stated := checks.manual.full_scale_gain) is not None:
        share = reading.accuracy.gain * 2.0 * reading.value / waveform.full_scale
        checks.close("measure_amplitude: gain", share, stated, 0.01 * stated, _OF_SPAN)


def _full(stand: OneInstrumentBench, scope: Any, checks: Checks) -> None:
    channels = _voltage_channels(stand, scope)
    # Points whose first digits are rounded up to each of the steps that instruments have.
    for slope, share, offset, speed, points in (
        (Slope.FALLING, 0.6, 0.3, stand.between(90.0, 110.0), round(stand.between(600.0, 900.0))),
        (Slope.RISING, 0.1, -0.2, stand.between(180.0, 200.0), round(stand.between(1200.0, 1900.0))),
    ):
        _turn(stand, speed)
        for channel in channels:
            amplitude = _show(stand, scope, channel, offset)
        trigger = Trigger(channels[-1], -0.4 * amplitude, slope)
        began = stand.bench.clock.now()
        found = _record(stand, scope, channels, trigger, share, points)
        # Filled before the trigger, triggered within a period, filled after it.
        took, most = stand.bench.clock.now() - began, 1.3 * _RECORD + 1.0 / _frequency(stand)
        remedy = "Wait for no more than it takes"
        checks.that("a record: in time", took <= most, f"{took:.3g} s instead of {most:.3g} s", remedy)
        for channel in channels:
            _compare(stand, checks, found[channel], channel, "V", trigger, share, points)
    _screen(stand, scope, checks, found[channels[0]])
    _filled(stand, scope, checks, channels[0])
    _moved(stand, scope, checks, channels[0])
    _as_set_up(stand, scope, checks, channels[0])
    _refused(stand, scope, checks, channels[0])
    # A trace that nearly fills the screen is on it.
    _show(stand, scope, channels[0], screens=2.4)
    _screen(stand, scope, checks, _record(stand, scope, channels[:1], Trigger(None), 0.0)[channels[0]])
    _current(stand, scope, checks)
    # Of a shaft that stands, with nothing to trigger on.
    _turn(stand, 0.0)
    found = _record(stand, scope, channels[:1], Trigger(None), 0.0)
    advice = "Start at once without a channel"
    checks.that("a record without a trigger", channels[0] in found, f"{sorted(found)}", advice)
    _prepare(stand)


def _filled(stand: OneInstrumentBench, scope: Any, checks: Checks, channel: int) -> None:
    """Check a record of which the part before the trigger takes long to be filled."""
    _show(stand, scope, channel)
    scope.configure_acquisition(_LONG, _POINTS, 0.8)
    scope.configure_trigger(Trigger(channel, 0.0))
    began = stand.bench.clock.now()
    scope.initiate()
    took = stand.bench.clock.now() - began
    remedy = "Wait until the part before the trigger is filled, and no longer"
    checks.close("initiate(): time", took, 0.8 * _LONG, 0.1 * _LONG, remedy)
    scope.fetch([channel], _LONG)
    took = stand.bench.clock.now() - began
    # A time base has steps: what the screen shows may be half as long again.
    right, advice = 0.9 * _LONG <= took <= 1.7 * _LONG, "Wait for the record, and no longer"
    checks.that("fetch(): time", right, f"{took:.3g} s for {_LONG:g} s", advice)


def _moved(stand: OneInstrumentBench, scope: Any, checks: Checks, channel: int) -> None:
    """Check that an offset is what the middle of the screen shows: of a trace round zero at its edge, that half is there."""
    amplitude, trigger = _show(stand, scope, channel, screens=1.6), Trigger(channel, 0.0)
    half = _record(stand, scope, [channel], trigger, 0.5)[channel].full_scale / 2.0 or 0.8 * amplitude
    remedy = "Compare the sign of the offset with the manual: which way does it move the trace?"
    for side, name in ((1.0, "above"), (-1.0, "below")):
        scope.configure_channel(channel, ChannelSettings(2.0 * half, side * half))
        found = _record(stand, scope, [channel], trigger, 0.5)[channel]
        seen, allowed = float((side * found.values).max()), 0.1 * amplitude + found.accuracy.offset
        checks.close(f"an offset {name} zero shows what is there", seen, amplitude, allowed, remedy)
        edge, beyond = float((side * found.values).min()), 0.3 * amplitude + found.accuracy.offset
        advice = "Compare the offset's unit and scale with the manual: its value is the middle of the screen"
        checks.close(f"an offset {name} zero hides what is beyond the screen", edge, 0.0, beyond, advice)


def _as_set_up(stand: OneInstrumentBench, scope: Any, checks: Checks, channel: int) -> None:
    """Check that another opening states the same accuracy, of the range and offset that the channel was left with."""
    _show(stand, scope, channel, 0.3)
    mine = _record(stand, scope, [channel], Trigger(None), 0.0)[channel]
    other = stand.open()
    its = _record(stand, other, [channel], Trigger(None), 0.0)[channel]
    other.close()
    # A gain of full scale hangs on the trace's ends, each a few steps of noise.
    noise = 4.0 * mine.resolution / float(np.ptp(mine.values))
    same = all(
        math.isclose(getattr(its.accuracy, part), getattr(mine.accuracy, part), rel_tol=allowed, abs_tol=1e-12)
        for part, allowed in (("gain", 1e-3 + noise), ("offset", 1e-3), ("resolution", 1e-3))
    )
    wrong = f"{its.accuracy} instead of {mine.accuracy}"
    checks.that("a channel that was set up before: accuracy", same, wrong, "Ask for its range and offset")


def _refused(stand: OneInstrumentBench, scope: Any, checks: Checks, channel: int) -> None:
    amplitude = _show(stand, scope, channel, screens=1.0)
    found = _record(stand, scope, [channel], Trigger(channel, 0.0), 0.5)
    checks.that("clipped is told", found[channel].clipped, "it is not", "Look at the converter's ends")
    with checks.refuses("amplitude off the screen", OverloadError, MeasurementError, remedy="Refuse a clipped trace"):
        scope.measure_amplitude(channel)
    _show(stand, scope, channel)
    began = stand.bench.clock.now()
    with checks.refuses("no trigger", MeasurementError, remedy="Wait for the time-out at most, and raise"):
        _record(stand, scope, [channel], Trigger(channel, 1.8 * amplitude), 0.5)
    took = stand.bench.clock.now() - began
    checks.that("time-out of fetch", 1.9 <= took <= 4.0, f"{took:.3g} s instead of 2 s", "Count from the call of fetch")
    # Less than a period, at the zero: near a crest noise alone would make edges.
    scope.configure_acquisition(1e-3, 20, 0.5)
    scope.configure_trigger(Trigger(channel, 0.0))
    scope.initiate()
    few = scope.fetch([channel], 1.0)[channel]
    checks.that("a record of few points", len(few.values) >= 20, f"{len(few.values)} instead of 20", "Round up")
    with checks.refuses("frequency of less than a period", MeasurementError, remedy="Refuse 9.9E37"):
        scope.measure_frequency(channel)
    wrong_channels = ((97, ChannelSettings(1.0)), *((channel, ChannelSettings(one)) for one in (math.nan, 1e9, 1e-9)))
    for act, wrong in (
        (scope.configure_channel, (*wrong_channels, (channel, ChannelSettings(10.0, math.nan)))),
        (scope.configure_trigger, ((Trigger(97),),)),
        (
            scope.configure_acquisition,
            ((math.nan, 1000), (0.0, 1000), (0.05, 10**12), (0.05, 1000, 1.5), (0.05, 1000, -0.5)),
        ),
        (scope.measure_frequency, ((97,),)),
        (scope.measure_amplitude, ((97,),)),
        (scope.fetch, (([97], 1.0),)),
    ):
        checks.rejects(f"{act.__name__}: what cannot be", act, *wrong)


def _current(stand: OneInstrumentBench, scope: Any, checks: Checks) -> None:
    """Compare a direct current, by a current probe."""
    world = stand.world
    for channel in scope.channels(ProbeKind.CURRENT)[:1]:
        world.attach_current_probe(channel, "A")
        world.connect({"A": "supply+", "B": "supply-"})
        world.lock_rotor()
        world.supply.set_voltage(4.0)
        world.supply.set_current_limit(world.supply.stage.maximum_current)
        world.supply.switch(True)
        stand.wait(0.5)
        scope.configure_channel(channel, ChannelSettings(8.0, 1.0))
        found = _record(stand, scope, [channel], Trigger(None), 0.0)[channel]
        checks.that("current: unit", found.unit == "A", found.unit, "A current probe's channel is in A")
        actual = world.truth()["terminal_currents"]["A"]
        checks.accuracy("current", found.accuracy, float(found.values.mean()), "A", actual, found.resolution)
        world.supply.switch(False)
        world.connect({})
        world.release_rotor()
        world.detach_probe(channel)


SESSION = CheckSession(_prepare, _brief, _full)
