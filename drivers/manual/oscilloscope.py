"""An oscilloscope that a person reads: what its screen shows, no waveform."""

from collections.abc import Sequence

from drivers.bases.set_points import SLOPES, check_setpoint, probe_on
from drivers.interfaces import (
    AcquisitionType,
    ChannelSettings,
    Clock,
    MeasurementError,
    Oscilloscope,
    ProbeKind,
    Reading,
    Trigger,
    Waveform,
)
from drivers.interfaces.text import text
from drivers.manual.by_hand import InstrumentByHand
from drivers.manual.options import ManualOscilloscopeOptions
from drivers.manual.prompt import Prompt


class ManualOscilloscope(InstrumentByHand[ManualOscilloscopeOptions], Oscilloscope):
    """An oscilloscope read by hand: frequency and amplitude off the screen."""

    def __init__(
        self, prompt: Prompt, clock: Clock, options: ManualOscilloscopeOptions, *, name: str = "oscilloscope"
    ) -> None:
        super().__init__(prompt, clock, options, name)

    @property
    def gives_waveforms(self) -> bool:
        """A person reads the screen; there are no samples."""
        return False

    def channels(self, kind: ProbeKind) -> Sequence[int]:
        """Return the numbers of the channels with a probe of this kind, in order."""
        return tuple(sorted(channel for channel, probe in self._options.probes.items() if probe is kind))

    def maximum_voltage(self, channel: int) -> float | None:
        """Say that the station file states nothing of the probes but what they sense."""
        return None

    def attenuation(self, channel: int) -> float | None:
        """Return that the probes' factors are not stated: a person reads values from the screen."""
        return None

    def configure_channel(self, channel: int, settings: ChannelSettings) -> None:
        """Let the person set the range and offset (V or A) of a channel; raises SetpointError for one without a probe."""
        unit = self._unit(channel)
        low, high = 0.0, 2 * self._options.maximum_amplitude
        check_setpoint(
            self._name,
            text("range of channel {channel}", channel=channel),
            settings.range,
            unit,
            low,
            high,
            "the station",
        )
        self._questions.confirm(
            text(
                "Switch channel {channel} on: full screen {range:g} {unit}, mid-screen {offset:g} {unit}.",
                channel=channel,
                range=settings.range,
                unit=unit,
                offset=settings.offset,
            )
        )

    def configure_acquisition(
        self,
        record_time: float,
        points: int,
        pre_trigger: float = 0.0,
        acquisition: AcquisitionType = AcquisitionType.NORMAL,
    ) -> None:
        """Let the person set the screen's width (s) and the trigger's place on it; number and kind of the points are the instrument's.

        Raises SetpointError for a width, number or share that cannot be.
        """
        check_setpoint(self._name, "record time", record_time, "s", 1e-9, 1e3, "any oscilloscope")
        check_setpoint(self._name, "points", points, "", 1, 1e9, "any oscilloscope")
        check_setpoint(self._name, "pre-trigger", pre_trigger, "", 0.0, 1.0, "a record")
        self._questions.confirm(
            text(
                "Set the screen's width to {record_time:g} s, the trigger at {pre_trigger:.0f} % from the left.",
                record_time=record_time,
                pre_trigger=100 * pre_trigger,
            )
        )
        if acquisition is AcquisitionType.HIGH_RESOLUTION:
            self._questions.confirm(text("Set its acquisition to high resolution: each point a mean."))

    def configure_trigger(self, trigger: Trigger) -> None:
        """Let the person set the trigger; raises SetpointError for a channel without a probe."""
        if trigger.channel is None:
            self._questions.confirm(text("Set the trigger to automatic."))
            return
        unit = self._unit(trigger.channel)
        self._questions.confirm(
            text(
                "Set the edge trigger to channel {channel}, {level:g} {unit}, {slope}.",
                channel=trigger.channel,
                level=trigger.level,
                unit=unit,
                slope=SLOPES[trigger.slope],
            )
        )

    def initiate(self) -> None:
        """Let the person arm the instrument for one record."""
        self._questions.confirm(text("Press Single."))

    def fetch(self, channels: Sequence[int], timeout: float) -> dict[int, Waveform]:
        """Raise MeasurementError: a waveform cannot be typed in."""
        raise MeasurementError(
            self._name,
            text(
                "an oscilloscope read by hand gives no waveform of channels {channels} within {timeout:g} s",
                channels=list(channels),
                timeout=timeout,
            ),
            remedy=text("Use measure_frequency() and measure_amplitude(), or analyse a stored capture"),
        )

    def measure_frequency(self, channel: int) -> Reading:
        """Ask for the frequency (Hz) the screen shows; raises MeasurementError where no accuracy is stated."""
        self._unit(channel)
        highest, context = self._options.maximum_frequency, text("of the trace of channel {channel}", channel=channel)
        return self._reading(text("frequency"), "Hz", 0.0, highest, self._options.frequency_accuracy, context=context)

    def measure_amplitude(self, channel: int) -> Reading:
        """Ask for the peak-to-peak value (V or A) the screen shows and return half of it.

        Raises MeasurementError where no accuracy is stated.
        """
        unit = self._unit(channel)
        accuracy = self._questions.stated(
            self._options.amplitude_accuracy.get(channel), text("amplitude on channel {channel}", channel=channel)
        )
        highest = 2 * self._options.maximum_amplitude
        value = self._questions.ask(
            text("peak-to-peak value"), unit, 0.0, highest, text("of the trace of channel {channel}", channel=channel)
        )
        return Reading(value / 2, unit, accuracy, self._clock.now())

    def make_safe(self) -> None:
        """Do nothing: an oscilloscope only listens."""

    def _unit(self, channel: int) -> str:
        return probe_on(self._name, channel, self._options.probes).value
