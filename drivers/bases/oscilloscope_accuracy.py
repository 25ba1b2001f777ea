"""Limits of error of an oscilloscope's trace: as the data sheet, the station file or a calibration states them."""

from drivers.bases.oscilloscope_data import OscilloscopeData, OscilloscopeOptions
from drivers.interfaces import Accuracy, ChannelSettings
from drivers.interfaces.full_scale import FULL_SCALE_READING, gain_of_full_scale

_PROBE_SOURCE = "probe"
_STATED_SOURCE = "probe: as stated"
_UNSTATED_SOURCE = "probe: error not stated, taken as none"


def trace_accuracy(
    data: OscilloscopeData,
    options: OscilloscopeOptions,
    channel: int,
    settings: ChannelSettings,
    low: float,
    high: float,
) -> Accuracy:
    """Return the limits of error of a trace between `low` and `high` (V or A at the tip) in the range that is set."""
    if channel in options.calibration:
        return options.calibration[channel]
    probe = options.probes[channel]
    divisions, fixed, share = data.offset
    offset = divisions * settings.range / data.divisions + fixed * probe.attenuation + share * abs(settings.offset)
    stated = _STATED_SOURCE if probe.gain or probe.offset else _UNSTATED_SOURCE
    own = f"{_PROBE_SOURCE}; {probe.source}" if probe.source else stated
    return Accuracy(
        gain=_gain(data, options, settings.range, low, high) + probe.gain,
        offset=offset + probe.offset,
        resolution=settings.range / data.steps,
        source=f"{_source(data, options)}; {own}",
    )


def _gain(data: OscilloscopeData, options: OscilloscopeOptions, full_scale: float, low: float, high: float) -> float:
    """Return the oscilloscope's own limit of gain for a trace between two values (V or A)."""
    if options.gain is not None:
        return options.gain
    share = data.gain if options.full_scale_gain is None else options.full_scale_gain
    # A trace within one step of the converter spans that step.
    half, middle = 0.5 * full_scale / data.steps, 0.5 * (low + high)
    return gain_of_full_scale(share, full_scale, min(low, middle - half), max(high, middle + half))


def _source(data: OscilloscopeData, options: OscilloscopeOptions) -> str:
    stated = options.gain_source or "station file"
    if options.gain is not None:
        return f"gain {100 * options.gain:g} % of the reading, {stated}; {data.offset_source}"
    if options.full_scale_gain is not None:
        message = f"gain {100 * options.full_scale_gain:g} % of full scale, {stated}"
        return f"{message}; {FULL_SCALE_READING}; {data.offset_source}"
    return data.source
