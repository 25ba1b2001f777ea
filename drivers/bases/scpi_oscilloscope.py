"""An oscilloscope that speaks SCPI: set points checked, one record armed, waited for and scaled, with its limits of error."""

from collections.abc import Sequence

from drivers.bases.oscilloscope_accuracy import trace_accuracy
from drivers.bases.oscilloscope_data import OscilloscopeData as OscilloscopeData
from drivers.bases.oscilloscope_data import OscilloscopeOptions as OscilloscopeOptions
from drivers.bases.oscilloscope_data import Probe as Probe
from drivers.bases.oscilloscope_dialogue import Acquiring as Acquiring
from drivers.bases.oscilloscope_dialogue import OscilloscopeDialogue
from drivers.bases.oscilloscope_dialogue import channel_rows as channel_rows
from drivers.bases.oscilloscope_dialogue import hidden_row as hidden_row
from drivers.bases.oscilloscope_dialogue import trigger_row as trigger_row
from drivers.bases.set_points import SLOPES, check_setpoint, probe_on
from drivers.bases.waveform import Codes as Codes
from drivers.bases.waveform import Preamble as Preamble
from drivers.bases.waveform import to_time, to_values
from drivers.catalogue import Driver
from drivers.interfaces import (
    Accuracy,
    AcquisitionType,
    ChannelSettings,
    Clock,
    MeasurementError,
    Oscilloscope,
    OverloadError,
    ProbeKind,
    Reading,
    Role,
    Trigger,
    Waveform,
)
from drivers.interfaces.text import Text, text
from drivers.transport.visa.opening import identify
from drivers.transport.visa.replies import is_overrange
from drivers.transport.visa.session import ScpiSession

#: How long (s) arming may take once the part of the record before the trigger is filled.
ARMING_TIME = 1.0


class ScpiOscilloscope(OscilloscopeDialogue, Oscilloscope):
    """An oscilloscope with the probes that its options name; the instrument is identified when this is made.

    Raises IdentityError where another instrument answers, SetpointError for a probe that cannot be.
    """

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: OscilloscopeOptions,
        *,
        name: str = "oscilloscope",
        guarding: bool = False,
    ) -> None:
        super().__init__(session, clock, name)
        self._options = options
        for channel, probe in options.probes.items():
            of = text("attenuation of channel {channel}", channel=channel)
            check_setpoint(name, of, probe.attenuation, "", *self.data.attenuations, "the model")
        self._identity = identify(session, self.answers, options.serial_number)
        self._ranges: dict[int, ChannelSettings] = {}
        self._record_time, self._points, self._pre_trigger = 0.0, 0, 0.0
        self._acquisition = AcquisitionType.NORMAL
        self._trigger = Trigger(None)
        #: When (s) the record that was armed last can be complete: triggered as soon as it may be.
        self._earliest = 0.0
        session.check_left_errors()
        if not guarding:
            self._take_over(self._wanted())

    @classmethod
    def driver(cls, name: str, *, simulated: str = "") -> Driver:
        """Return the driver of this oscilloscope; `simulated` names the simulated instrument that stands for it."""
        return Driver(
            name, Role.OSCILLOSCOPE, OscilloscopeOptions, cls.open, simulated=simulated, recognised_by=(cls.answers,)
        )

    @property
    def gives_waveforms(self) -> bool:
        """Samples can be fetched."""
        return True

    def channels(self, kind: ProbeKind) -> Sequence[int]:
        """Return the numbers of the channels with a probe of this kind, in order."""
        return tuple(sorted(channel for channel, probe in self._options.probes.items() if probe.kind is kind))

    def maximum_voltage(self, channel: int) -> float | None:
        """Return what the station file states of the channel's probe (V, peak), None where it states nothing."""
        return self._probe(channel).maximum_voltage

    def attenuation(self, channel: int) -> float | None:
        """Return what the probe that the station file names senses (V or A) per volt at the input."""
        probe = self._options.probes.get(channel)
        return probe.attenuation if probe else None

    def configure_channel(self, channel: int, settings: ChannelSettings) -> None:
        """Set probe, range and offset (V or A at the probe's tip) of a channel and switch it on.

        Raises SetpointError before anything is sent, ReportedError where the instrument refuses.
        """
        probe = self._probe(channel)
        low, high = (limit * probe.attenuation for limit in self.data.ranges)
        for what, value, least in (
            (text("range of channel {channel}", channel=channel), settings.range, low),
            (text("offset of channel {channel}", channel=channel), settings.offset, -high),
        ):
            check_setpoint(self._name, what, value, probe.kind.value, least, high, "the probe")
        self._send(self._channel_commands(channel, probe, settings))
        # The instrument rounds to its own steps; accuracy follows from what it has set.
        self._ranges[channel] = ChannelSettings(self._full_scale(channel), settings.offset)

    def configure_acquisition(
        self,
        record_time: float,
        points: int,
        pre_trigger: float = 0.0,
        acquisition: AcquisitionType = AcquisitionType.NORMAL,
    ) -> None:
        """Set the record's length (s), its least number of points, the share of it (0…1) before the trigger, and the kind of its samples.

        Raises SetpointError before anything is sent, ReportedError where the instrument refuses.
        """
        data = self.data
        check_setpoint(self._name, "record time", record_time, "s", *data.records, "the model")
        most = min(data.maximum_points, int(record_time * data.maximum_sample_rate * (1 + 1e-9)))
        check_setpoint(self._name, "points", points, "", 1, most, "the model at this record time")
        check_setpoint(self._name, "pre-trigger", pre_trigger, "", 0.0, 1.0, "a record")
        self._send(self._acquisition_commands(record_time, points, pre_trigger, acquisition))
        self._record_time, self._points, self._pre_trigger = record_time, points, pre_trigger
        self._acquisition = acquisition

    def configure_trigger(self, trigger: Trigger) -> None:
        """Set the edge trigger; without a channel the record starts by itself.

        Raises SetpointError for a channel without a probe, ReportedError where the instrument refuses.
        """
        if trigger.channel is not None:
            self._probe(trigger.channel)
        self._send(self._trigger_commands(trigger))
        self._trigger = trigger

    def initiate(self) -> None:
        """Arm for one record; returns once the instrument waits for its trigger.

        Raises MeasurementError where it does not arm, or no record was set up.
        """
        if not self._points:
            raise MeasurementError(
                self._name, text("no record is set up"), remedy=text("Call configure_acquisition() first")
            )
        self._session.write(self._single)
        # An event before this part of the record is filled does not trigger.
        if self._pre_trigger > 0:
            self._clock.sleep(self._pre_trigger * self._record_time)
        armed = self._clock.now()
        self._earliest = armed + (1.0 - self._pre_trigger) * self._record_time
        while self._state() is Acquiring.FILLING:
            if self._clock.now() >= armed + ARMING_TIME:
                raise MeasurementError(self._name, text("does not arm for its trigger"), command=self._single)
            self._pause(armed)
        if self._force and self._trigger.channel is None:
            self._session.write(self._force)

    def fetch(self, channels: Sequence[int], timeout: float) -> dict[int, Waveform]:
        """Wait for the record (at most `timeout` s of bench time) and return the waveforms of the channels.

        Raises MeasurementError where no trigger came, SetpointError for a channel without a probe,
        CommunicationError where a record does not arrive whole.
        """
        for channel in channels:
            self._probe(channel)
        started = self._clock.now()
        if started < self._earliest:
            self._clock.sleep(min(self._earliest - started, timeout))
        while self._state() is not Acquiring.DONE:
            if self._clock.now() >= started + timeout:
                self._session.write(self._stop)
                raise MeasurementError(
                    self._name, text("{awaited} within {timeout:g} s", awaited=self._awaited(), timeout=timeout)
                )
            self._pause(started)
        self._send(self._transfer)
        return {channel: self._waveform(channel, *self._record(channel, self._points)) for channel in channels}

    def measure_frequency(self, channel: int) -> Reading:
        """Return the frequency (Hz) of a channel's trace by the instrument's own measurement.

        Raises MeasurementError where the screen shows no full period.
        """
        missing = text("the screen shows no full period of channel {channel}", channel=channel)
        value = self._screen(channel, "FREQ", missing)
        return Reading(value, "Hz", self.data.time_base, self._clock.now())

    def measure_amplitude(self, channel: int) -> Reading:
        """Return half the peak-to-peak value (V or A) of a channel's trace by the instrument's own measurement.

        Raises OverloadError where the trace leaves the screen, MeasurementError where there is none.
        """
        missing = text("the screen shows no trace, or a clipped one, of channel {channel}", channel=channel)
        value = self._screen(channel, "VPP", missing) / 2
        accuracy, full_scale = self._accuracy(channel, -value, value), self._range(channel).range
        # A difference of two points: the offset falls out, the converter's step stays.
        accuracy = Accuracy(gain=accuracy.gain, resolution=full_scale / self.data.steps, source=accuracy.source)
        if value >= full_scale / 2:
            said = text("the trace of channel {channel} leaves the screen", channel=channel)
            raise OverloadError(self._name, said, remedy=text("Widen it"))
        return Reading(value, self._probe(channel).kind.value, accuracy, self._clock.now())

    def make_safe(self) -> None:
        """Stop a pending acquisition."""
        self._session.write(self._stop)

    def _probe(self, channel: int) -> Probe:
        return probe_on(self._name, channel, self._options.probes)

    def _range(self, channel: int) -> ChannelSettings:
        self._probe(channel)
        if channel not in self._ranges:
            self._ranges[channel] = ChannelSettings(self._full_scale(channel), self._mid_screen(channel))
        return self._ranges[channel]

    def _pause(self, since: float) -> None:
        """Wait before the next look at the state: of a record, or of what has been waited for it, a twentieth."""
        longest = max(self._record_time, self._clock.now() - since)
        self._clock.sleep(min(self._options.poll_interval, max(longest / 20, 1e-3)))

    def _awaited(self) -> Text:
        if self._trigger.channel is None:
            return text("no record")
        return text(
            "no trigger: channel {channel} did not cross {level:g} {unit} ({slope})",
            channel=self._trigger.channel,
            level=self._trigger.level,
            unit=self._probe(self._trigger.channel).kind.value,
            slope=SLOPES[self._trigger.slope],
        )

    def _waveform(self, channel: int, codes: Codes, preamble: Preamble) -> Waveform:
        if codes.size < self._points:
            raise MeasurementError(
                self._name,
                text(
                    "the record of channel {channel} has {size} points, {points} are needed",
                    channel=channel,
                    size=codes.size,
                    points=self._points,
                ),
                remedy=text("Lengthen the record or ask for fewer points"),
            )
        data, lowest, highest = self.data, int(codes.min()), int(codes.max())
        finer = data.fine_steps if self._acquisition is AcquisitionType.HIGH_RESOLUTION else 1
        return Waveform(
            channel,
            to_time(codes.size, preamble),
            to_values(codes, preamble),
            self._probe(channel).kind.value,
            preamble.y_increment * data.codes_per_step / finer,
            self._accuracy(channel, preamble.value(lowest), preamble.value(highest)),
            lowest <= data.clipped[0] or highest >= data.clipped[1],
            self._range(channel).range,
        )

    def _accuracy(self, channel: int, low: float, high: float) -> Accuracy:
        """Return the limits of error of a trace between two values (V or A)."""
        return trace_accuracy(self.data, self._options, channel, self._range(channel), low, high)

    def _screen(self, channel: int, what: str, missing: Text) -> float:
        self._probe(channel)
        query = self._measurement(what, channel)
        value = self._session.query_number(query)
        if is_overrange(value):
            raise MeasurementError(self._name, missing, command=query)
        return value
