"""Taking a waveform: ranges that fit the signal, and a record at the right moment."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext

import numpy as np

from drivers.interfaces import ChannelSettings, Oscilloscope, SetpointError, Trigger, Waveform
from drivers.interfaces.text import text
from procedures.core.bench import Bench, ProcedureError

#: The signal fills this share of the screen, so that noise and overshoot do not clip.
FILL = 0.8
#: A signal whose ends were seen, noise and overshoot with them, fills this share.
_FILL_SEEN = 0.9
_ATTEMPTS = 8
#: A range this much too wide is narrowed: a scope's gain is stated of full scale, not of what is shown.
_TOO_WIDE = 1.25


def record(
    bench: Bench,
    channels: Sequence[int],
    trigger: Trigger,
    timeout: float,
    event: Callable[[], AbstractContextManager[object]] = nullcontext,
) -> dict[int, Waveform]:
    """Arm the scope, let `event` happen (a context manager that holds until the record is in), and return the record."""
    scope = bench.oscilloscope
    scope.configure_trigger(trigger)
    scope.initiate()
    with event():
        return scope.fetch(channels, timeout)


def ranged_record(bench: Bench, start_ranges: Mapping[int, float], timeout: float) -> dict[int, Waveform]:
    """Return a free-running record of steady alternating signals, each channel's range fitted to its own signal.

    `start_ranges` gives each channel's first full-scale range (V or A), or one beyond those that channel and probe have. Raises
    ProcedureError where a signal cannot be fitted.
    """
    scope = bench.oscilloscope
    ranges = {channel: set_range(scope, channel, full_scale) for channel, full_scale in start_ranges.items()}
    for _ in range(_ATTEMPTS):
        waves = record(bench, list(ranges), Trigger(None), timeout)
        if scope.read_by_hand:
            # Whoever sets the ranges has fitted them; what clips all the same stands in the record.
            return waves
        before = dict(ranges)
        better = {channel: _better(waves[channel], full_scale) for channel, full_scale in ranges.items()}
        if all(full_scale is None for full_scale in better.values()):
            return waves
        for channel, fitted in better.items():
            if fitted is not None:
                ranges[channel] = set_range(scope, channel, fitted)
        if ranges == before:
            # What is wanted is beyond what there is: as the record is, it is the best there can be.
            return waves
        bench.state.verified_channels.not_used(waves.values())
    raise ProcedureError(
        text(
            "no range of the oscilloscope fits the signal on channels {channels}; check the probes",
            channels=str(list(ranges)),
        )
    )


def configure(scope: Oscilloscope, channel: int, low: float, high: float, fill: float = FILL) -> float:
    """Set a channel's range and offset for a signal between `low` and `high` (V or A); return the range that was set.

    The signal takes the share `fill` of it. A small one is given the smallest range: it is coarser there, which its fit
    states, and measured all the same.
    """
    wanted, offset = (high - low) / fill, 0.5 * (low + high)
    try:
        scope.configure_channel(channel, ChannelSettings(wanted, offset))
    except SetpointError as refused:
        if not 0.0 < wanted < refused.low:
            raise
        scope.configure_channel(channel, ChannelSettings(refused.low, offset))
        return refused.low
    return wanted


def fill_screen(scope: Oscilloscope, seen: Waveform) -> None:
    """Narrow a channel's range to a trace that will come again as it was `seen`: an error of full scale is the less of it.

    A trace that left the screen changes nothing.
    """
    low, high = float(np.min(seen.values)), float(np.max(seen.values))
    if not seen.clipped and low < high:
        configure(scope, seen.channel, low, high, _FILL_SEEN)


def set_range(scope: Oscilloscope, channel: int, full_scale: float) -> float:
    """Set a channel's full scale (V or A), or the nearest that channel and probe have; return what was set."""
    try:
        scope.configure_channel(channel, ChannelSettings(full_scale))
    except SetpointError as refused:
        full_scale = min(max(full_scale, refused.low), refused.high)
        scope.configure_channel(channel, ChannelSettings(full_scale))
    return full_scale


def _better(wave: Waveform, full_scale: float) -> float | None:
    if wave.clipped:
        return 4.0 * full_scale
    needed = 2.0 * float(np.max(np.abs(wave.values))) / FILL
    if 0.0 < needed < full_scale / _TOO_WIDE and needed > 8.0 * wave.resolution:
        return needed
    return None
