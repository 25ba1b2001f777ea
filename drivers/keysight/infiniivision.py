"""Keysight InfiniiVision 3000 and 4000 X-Series oscilloscopes (Programmer's Guide 3000T X-Series)."""

import math
from collections.abc import Sequence

from drivers.bases.scpi_driver import ScpiDriver
from drivers.bases.set_points import SLOPES, check_setpoint, probe_on
from drivers.interfaces import (
    Accuracy,
    AcquisitionType,
    ChannelSettings,
    Clock,
    CommunicationError,
    MeasurementError,
    Oscilloscope,
    OverloadError,
    ProbeKind,
    Reading,
    Trigger,
    Waveform,
)
from drivers.interfaces.text import Text, text
from drivers.keysight import infiniivision_data as data
from drivers.keysight.infiniivision_accuracy import trace_accuracy
from drivers.keysight.infiniivision_settings import found_settings
from drivers.keysight.options import INFINIIVISION_IDENTITY, InfiniiVisionOptions, Probe
from drivers.keysight.waveform import Preamble, codes_from_block, parse_preamble, to_time, to_values
from drivers.transport.visa.opening import identify
from drivers.transport.visa.replies import is_overrange
from drivers.transport.visa.session import ScpiSession

#: Bits of the operation status condition register: running, and armed for the trigger.
RUNNING, ARMED = 1 << 3, 1 << 5
#: How long (s) arming may take once the part of the record before the trigger is filled.
ARMING_TIME = 1.0
UNIT = {ProbeKind.VOLTAGE: "VOLT", ProbeKind.CURRENT: "AMP"}


class KeysightInfiniiVision(ScpiDriver, Oscilloscope):
    """A Keysight InfiniiVision; the instrument is identified when this is made.

    Raises IdentityError where another instrument answers, SetpointError for a probe that cannot be.
    """

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: InfiniiVisionOptions,
        *,
        name: str = "oscilloscope",
        guarding: bool = False,
    ) -> None:
        super().__init__(session, clock, name)
        self._options = options
        for channel, probe in options.probes.items():
            whose = "the model"
            check_setpoint(
                name, text("attenuation of channel {channel}", channel=channel), probe.attenuation, "", 1e-3, 1e4, whose
            )
        self._identity = identify(session, INFINIIVISION_IDENTITY, options.serial_number)
        self._ranges: dict[int, ChannelSettings] = {}
        self._record_time, self._points, self._pre_trigger = 1e-3, 1000, 0.0
        self._steps = 1
        self._trigger = Trigger(None)
        #: When (s) the record that was armed last can be complete: triggered as soon as it may be.
        self._earliest = -math.inf
        session.check_left_errors()
        if not guarding:
            self._take_over(found_settings(self._identity.model, options.probes))

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
        low, high = data.MINIMUM_RANGE * probe.attenuation, data.MAXIMUM_RANGE * probe.attenuation
        check_setpoint(
            self._name,
            text("range of channel {channel}", channel=channel),
            settings.range,
            probe.kind.value,
            low,
            high,
            "the probe",
        )
        check_setpoint(
            self._name,
            text("offset of channel {channel}", channel=channel),
            settings.offset,
            probe.kind.value,
            -high,
            high,
            "the probe",
        )
        for command in (
            f":CHAN{channel}:DISP ON",
            f":CHAN{channel}:COUP DC",
            f":CHAN{channel}:UNIT {UNIT[probe.kind]}",
            f":CHAN{channel}:PROB {probe.attenuation:.6g}",
            f":CHAN{channel}:RANG {settings.range:.6g}",
            f":CHAN{channel}:OFFS {settings.offset:.6g}",
        ):
            self._session.write(command)
        # The instrument rounds to its own steps; accuracy follows from what it has set.
        actual = self._scale(f":CHAN{channel}:RANG?")
        self._ranges[channel] = ChannelSettings(actual, settings.offset)

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
        check_setpoint(
            self._name, "record time", record_time, "s", data.MINIMUM_RECORD, data.MAXIMUM_RECORD, "the model"
        )
        most = min(data.MAXIMUM_POINTS, int(record_time * data.MAXIMUM_SAMPLE_RATE * (1 + 1e-9)))
        check_setpoint(self._name, "points", points, "", 1, most, "the model at this record time")
        check_setpoint(self._name, "pre-trigger", pre_trigger, "", 0.0, 1.0, "a record")
        for command in (
            f":ACQ:TYPE {acquisition.value}",
            ":TIM:MODE MAIN",
            ":TIM:REF CENT",
            f":TIM:RANG {record_time:.9g}",
            # The position is the time from the trigger to the screen's centre.
            f":TIM:POS {(0.5 - pre_trigger) * record_time:.9g}",
        ):
            self._session.write(command)
        self._record_time, self._points, self._pre_trigger = record_time, points, pre_trigger
        self._steps = data.FINE_STEPS if acquisition is AcquisitionType.HIGH_RESOLUTION else 1

    def configure_trigger(self, trigger: Trigger) -> None:
        """Set the edge trigger; without a channel the record starts by itself.

        Raises SetpointError for a channel without a probe, ReportedError where the instrument refuses.
        """
        if trigger.channel is None:
            self._session.write(":TRIG:SWE AUTO")
        else:
            self._probe(trigger.channel)
            for command in (
                ":TRIG:MODE EDGE",
                f":TRIG:EDGE:SOUR CHAN{trigger.channel}",
                f":TRIG:EDGE:LEV {trigger.level:.6g}",
                f":TRIG:EDGE:SLOP {trigger.slope.value}",
                ":TRIG:SWE NORM",
            ):
                self._session.write(command)
        self._trigger = trigger

    def initiate(self) -> None:
        """Arm for one record; returns once the instrument waits for its trigger.

        Raises MeasurementError where it does not arm.
        """
        self._session.write(":SING")
        # An event before this part of the record is filled does not trigger.
        if self._pre_trigger > 0:
            self._clock.sleep(self._pre_trigger * self._record_time)
        armed = self._clock.now()
        self._earliest = armed + (1.0 - self._pre_trigger) * self._record_time
        deadline = armed + ARMING_TIME
        while True:
            state = self._state()
            if state & ARMED or not state & RUNNING:
                return
            if self._clock.now() >= deadline:
                raise MeasurementError(self._name, text("does not arm for its trigger"), command=":SING")
            self._pause()

    def fetch(self, channels: Sequence[int], timeout: float) -> dict[int, Waveform]:
        """Wait for the record (at most `timeout` s of bench time) and return the waveforms of the channels.

        Raises MeasurementError where no trigger came, SetpointError for a channel without a probe,
        CommunicationError where a record does not arrive whole.
        """
        for channel in channels:
            self._probe(channel)
        started = self._clock.now()
        deadline = started + timeout
        if started < self._earliest:
            self._clock.sleep(min(self._earliest - started, timeout))
        while self._state() & RUNNING:
            if self._clock.now() >= deadline:
                self._session.write(":STOP")
                raise MeasurementError(
                    self._name, text("{awaited} within {timeout:g} s", awaited=self._awaited(), timeout=timeout)
                )
            self._pause()
        for command in (":WAV:FORM WORD", ":WAV:UNS ON", ":WAV:BYT LSBF", ":WAV:POIN:MODE RAW"):
            self._session.write(command)
        return {channel: self._waveform(channel) for channel in channels}

    def measure_frequency(self, channel: int) -> Reading:
        """Return the frequency (Hz) of a channel's trace by the instrument's own measurement.

        Raises MeasurementError where the screen shows no full period.
        """
        missing = text("the screen shows no full period of channel {channel}", channel=channel)
        value = self._screen(channel, "FREQ", missing)
        return Reading(value, "Hz", Accuracy(gain=data.TIME_BASE, source=data.TIME_BASE_SOURCE), self._clock.now())

    def measure_amplitude(self, channel: int) -> Reading:
        """Return half the peak-to-peak value (V or A) of a channel's trace by the instrument's own measurement.

        Raises OverloadError where the trace leaves the screen, MeasurementError where there is none.
        """
        missing = text("the screen shows no trace, or a clipped one, of channel {channel}", channel=channel)
        value = self._screen(channel, "VPP", missing) / 2
        accuracy = self._accuracy(channel, -value, value)
        # A difference of two points: the offset falls out, the converter's step stays.
        step = self._range(channel).range / data.CODES_ON_SCREEN
        accuracy = Accuracy(gain=accuracy.gain, resolution=step, source=accuracy.source)
        if value >= self._range(channel).range / 2:
            raise OverloadError(
                self._name,
                text("the trace of channel {channel} leaves the screen", channel=channel),
                remedy=text("Widen it"),
            )
        return Reading(value, self._probe(channel).kind.value, accuracy, self._clock.now())

    def make_safe(self) -> None:
        """Stop a pending acquisition."""
        self._session.write(":STOP")

    def _probe(self, channel: int) -> Probe:
        return probe_on(self._name, channel, self._options.probes)

    def _range(self, channel: int) -> ChannelSettings:
        self._probe(channel)
        if channel not in self._ranges:
            actual = self._scale(f":CHAN{channel}:RANG?")
            offset = self._scale(f":CHAN{channel}:OFFS?")
            self._ranges[channel] = ChannelSettings(actual, offset)
        return self._ranges[channel]

    def _scale(self, query: str) -> float:
        value = self._session.query_number(query)
        if is_overrange(value):
            raise CommunicationError(self._name, text("no value (9.9E37)"), command=query)
        return value

    def _state(self) -> int:
        return int(self._session.query_number(":OPER:COND?"))

    def _pause(self) -> None:
        self._clock.sleep(min(self._options.poll_interval, max(self._record_time / 20, 1e-3)))

    def _awaited(self) -> Text:
        if self._trigger.channel is None:
            return text("no record")
        probe = self._probe(self._trigger.channel)
        return text(
            "no trigger: channel {channel} did not cross {level:g} {unit} ({slope})",
            channel=self._trigger.channel,
            level=self._trigger.level,
            unit=probe.kind.value,
            slope=SLOPES[self._trigger.slope],
        )

    def _waveform(self, channel: int) -> Waveform:
        for command in (f":WAV:SOUR CHAN{channel}", f":WAV:POIN {_offered_points(self._points)}"):
            self._session.write(command)
        reply = self._session.query(":WAV:PRE?")
        try:
            preamble = parse_preamble(reply)
            codes = codes_from_block(self._session.query_block(":WAV:DATA?"))
        except ValueError as error:
            raise CommunicationError(
                self._name, text("unusable record ({error})", error=error), command=":WAV:PRE?"
            ) from error
        if codes.size != preamble.points:
            raise CommunicationError(
                self._name,
                text("{size} samples instead of {points} announced", size=codes.size, points=preamble.points),
                command=":WAV:DATA?",
            )
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
        lowest, highest = int(codes.min()), int(codes.max())
        return Waveform(
            channel,
            to_time(codes.size, preamble),
            to_values(codes, preamble),
            self._probe(channel).kind.value,
            preamble.y_increment * data.CODES_PER_STEP / self._steps,
            self._accuracy(channel, *_ends(lowest, highest, preamble)),
            highest >= data.HIGHEST_CODE or lowest <= data.LOWEST_CODE,
            self._range(channel).range,
        )

    def _accuracy(self, channel: int, low: float, high: float) -> Accuracy:
        """Return the limits of error of a trace between two values (V or A)."""
        return trace_accuracy(self._options, channel, self._range(channel), low, high)

    def _screen(self, channel: int, what: str, missing: Text) -> float:
        self._probe(channel)
        query = f":MEAS:{what}? CHAN{channel}"
        value = self._session.query_number(query)
        if is_overrange(value):
            raise MeasurementError(
                self._name,
                missing,
                command=query,
            )
        return value


def _ends(lowest: int, highest: int, preamble: Preamble) -> tuple[float, float]:
    """Return the lowest and the highest value of a trace (V or A)."""
    low, high = ((code - preamble.y_reference) * preamble.y_increment + preamble.y_origin for code in (lowest, highest))
    return low, high


def _offered_points(points: int) -> int:
    """Return the smallest record length the instrument offers (1, 2, 5 times a power of ten, from 100) that suffices.

    Source: Programmer's Guide, :WAVeform:POINts in RAW mode.
    """
    decade = 100
    while True:
        for factor in (1, 2, 5):
            if factor * decade >= points:
                return factor * decade
        decade *= 10
