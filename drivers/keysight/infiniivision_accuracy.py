"""Limits of error of an InfiniiVision's trace: as the data sheet, the station file or a calibration states them."""

from drivers.interfaces import Accuracy, ChannelSettings
from drivers.interfaces.full_scale import FULL_SCALE_READING, gain_of_full_scale
from drivers.keysight import infiniivision_data as data
from drivers.keysight.options import InfiniiVisionOptions

_PROBE_SOURCE = "probe"
_STATED_SOURCE = "probe: as stated"
_UNSTATED_SOURCE = "probe: error not stated, taken as none"


def trace_accuracy(
    options: InfiniiVisionOptions, channel: int, settings: ChannelSettings, low: float, high: float
) -> Accuracy:
    """Return the limits of error of a trace between `low` and `high` (V or A at the tip) in the range that is set."""
    if channel in options.calibration:
        return options.calibration[channel]
    probe = options.probes[channel]
    offset = (
        data.OFFSET_DIVISIONS * settings.range / data.DIVISIONS
        + data.OFFSET_FIXED * probe.attenuation
        + data.OFFSET_SHARE * abs(settings.offset)
    )
    stated = _STATED_SOURCE if probe.gain or probe.offset else _UNSTATED_SOURCE
    own = f"{_PROBE_SOURCE}; {probe.source}" if probe.source else stated
    return Accuracy(
        gain=_gain(options, settings.range, low, high) + probe.gain,
        offset=offset + probe.offset,
        resolution=settings.range / data.CODES_ON_SCREEN,
        source=f"{_source(options)}; {own}",
    )


def _gain(options: InfiniiVisionOptions, full_scale: float, low: float, high: float) -> float:
    """Return the oscilloscope's own limit of gain for a trace between two values (V or A)."""
    if options.gain is not None:
        return options.gain
    share = data.GAIN if options.full_scale_gain is None else options.full_scale_gain
    # A trace within one step of the converter spans that step.
    half, middle = 0.5 * full_scale / data.CODES_ON_SCREEN, 0.5 * (low + high)
    return gain_of_full_scale(share, full_scale, min(low, middle - half), max(high, middle + half))


def _source(options: InfiniiVisionOptions) -> str:
    stated = options.gain_source or "station file"
    if options.gain is not None:
        return f"gain {100 * options.gain:g} % of the reading, {stated}; {data.OFFSET_SOURCE}"
    if options.full_scale_gain is not None:
        message = f"gain {100 * options.full_scale_gain:g} % of full scale, {stated}"
        return f"{message}; {FULL_SCALE_READING}; {data.OFFSET_SOURCE}"
    return data.SOURCE
