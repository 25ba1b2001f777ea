"""Probes whose limit of error nobody has stated: asked for before their channel is used."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

from drivers.interfaces import Accuracy, ChannelSettings, Oscilloscope, Reading, Waveform
from drivers.interfaces.text import text
from procedures.core.actions import EnterReading

#: What the reading is called by who has no person to ask.
KEY = "probe_limit"
_LARGEST = 50.0


class StatedProbes:
    """Limits of gain of probes (relative) by channel, and the channels of which they are still to be asked for."""

    def __init__(self, unstated: Collection[int] = (), given: Mapping[int, float] | None = None) -> None:
        self._unstated = frozenset(unstated)
        self._given = dict(given or {})

    def on(self, scope: Oscilloscope, ask: Callable[[EnterReading], float]) -> Oscilloscope:
        """Return the oscilloscope with these limits in its accuracies; `ask` has one entered."""
        return cast("Oscilloscope", _ProbedOscilloscope(scope, self, ask)) if self._unstated else scope

    def ensure(self, channel: int, ask: Callable[[EnterReading], float]) -> None:
        """Ask for the limit of a channel's probe where nobody has stated it."""
        if channel in self._unstated and channel not in self._given:
            asked = text(
                "limit of error of the probe on channel {channel}, of the reading, from its data sheet or calibration (0 where it is "
                "negligible; to state it beforehand: --probe CH{channel}=2%, or gain and source in the station file)",
                channel=channel,
            )
            self._given[channel] = ask(EnterReading(KEY, asked, "%", 0.0, _LARGEST)) / 100.0

    def put_on(self, channel: int, accuracy: Accuracy) -> Accuracy:
        """Return an accuracy with the probe's limit in it."""
        limit = self._given.get(channel)
        if limit is None:
            return accuracy
        # The same words for all channels: what they have in common stays one input of the budget.
        before = accuracy.source.partition("; probe")[0]
        return replace(accuracy, gain=accuracy.gain + limit, source=f"{before}; probe: limit as entered")


class _ProbedOscilloscope:
    """An oscilloscope whose accuracies hold what was entered of its probes; in all else the one behind it."""

    def __init__(self, scope: Oscilloscope, probes: StatedProbes, ask: Callable[[EnterReading], float]) -> None:
        self._scope = scope
        self._probes = probes
        self._ask = ask

    def __getattr__(self, name: str) -> Any:
        return getattr(self._scope, name)

    def configure_channel(self, channel: int, settings: ChannelSettings) -> None:
        """Ensure that the probe's limit is stated, then set the channel."""
        self._probes.ensure(channel, self._ask)
        self._scope.configure_channel(channel, settings)

    def fetch(self, channels: Sequence[int], timeout: float) -> dict[int, Waveform]:
        """Return the record, its accuracies with the probes' limits."""
        waves = self._scope.fetch(channels, timeout)
        return {c: replace(wave, accuracy=self._probes.put_on(c, wave.accuracy)) for c, wave in waves.items()}

    def measure_amplitude(self, channel: int) -> Reading:
        """Return the reading, its accuracy with the probe's limit."""
        reading = self._scope.measure_amplitude(channel)
        return replace(reading, accuracy=self._probes.put_on(channel, reading.accuracy))
