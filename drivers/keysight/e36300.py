"""Keysight E36300 series DC supplies (Programming Guide E36311-90008), one output."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING

from drivers.bases.always import always
from drivers.bases.set_points import check_setpoint, lesser
from drivers.interfaces import (
    UNWATCHED,
    Accuracy,
    Calls,
    Clock,
    CommunicationError,
    Identity,
    IdentityError,
    MeasurementError,
    OutputMode,
    Reading,
    Regulated,
    ReportedError,
    Traffic,
)
from drivers.keysight.e36300_channel import Channel
from drivers.keysight.e36300_data import OUTPUTS
from drivers.keysight.e36300_protection import Protection
from drivers.keysight.options import E36300Options
from drivers.transport.visa.opening import KEYSIGHT, identify, open_driver, open_session
from drivers.transport.visa.replies import is_overrange
from drivers.transport.visa.session import WAY_DOWN_TIME, ScpiSession

if TYPE_CHECKING:
    from pyvisa import ResourceManager

#: Condition register of an output (ISUMmary): two low bits say what regulates; higher ones concern lists and logs.
REGULATION_MASK = 0b11
REGULATION = {0: None, 1: OutputMode.CONSTANT_CURRENT, 2: OutputMode.CONSTANT_VOLTAGE, 3: OutputMode.UNREGULATED}


def decode_regulation(condition: int) -> OutputMode | None:
    """Return what the ISUMmary condition register says of the regulation, `None` where the output is off or lost.

    Source: the same query in the E364xA User's and Service Guide (1 CC, 2 CV, 0 off or unregulated, 3 failure), whose
    status system the series continues.
    """
    return REGULATION[condition & REGULATION_MASK]


class KeysightE36300:
    """One output of a Keysight E36311A, E36312A or E36313A; the instrument is identified when this is made.

    With `guarding`, errors that wait in the queue are left to the process that made them.
    Raises IdentityError where another instrument, or one without this output, answers.
    """

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: E36300Options,
        *,
        name: str = "supply",
        guarding: bool = False,
    ) -> None:
        self._session = session
        self._clock = clock
        self._options = options
        self._name = name
        self._identity = identify(session, KEYSIGHT, tuple(OUTPUTS), options.serial_number)
        outputs = next(outputs for model, outputs in OUTPUTS.items() if self._identity.model.startswith(model))
        if options.channel not in outputs:
            raise IdentityError(
                name,
                f"{self._identity.model} has outputs {', '.join(map(str, outputs))}, not {options.channel}",
                remedy="Correct the channel in the station file",
            )
        self._output = outputs[options.channel]
        self._channel = Channel(session, options.channel, name)
        self._voltage_accuracy = options.voltage_accuracy or self._output.voltage
        self._current_accuracy = options.current_accuracy or self._output.current
        self._maximum_voltage, self._voltage_owner = lesser(self._output.maximum_voltage, options.maximum_voltage)
        self._maximum_current, self._current_owner = lesser(self._output.maximum_current, options.maximum_current)
        self._protection = Protection(self._channel, options.over_current_delay, name)
        if not guarding:
            session.check_errors()

    @property
    def identity(self) -> Identity:
        """Who answered *IDN? when this was opened."""
        return self._identity

    @property
    def maximum_voltage(self) -> float:
        """Largest voltage (V) that may be set: the lesser of the model's and the station's."""
        return self._maximum_voltage

    @property
    def maximum_current(self) -> float:
        """Largest current limit (A) that may be set: the lesser of the model's and the station's."""
        return self._maximum_current

    @property
    def read_by_hand(self) -> bool:
        """Never: it answers by itself."""
        return False

    def configure(self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE) -> None:
        """Set voltage (V), current limit (A), over-voltage and over-current protection, and read each of them back.

        Over-current protection switches off an output that goes over to constant current, so it stays off where that is
        what is `regulated`, unless the station wants a trip at any current limit. Raises SetpointError before anything is
        sent, ReportedError where the instrument refuses, CommunicationError where it reads back another value.
        """
        self._check_levels(voltage, current_limit)
        protection = self._protection_for(voltage)
        channel = self._channel
        # The protection must stay above the level at every moment, upwards and downwards.
        if voltage >= channel.number("VOLT"):
            steps = (("VOLT:PROT", protection), ("VOLT", voltage))
        else:
            steps = (("VOLT", voltage), ("VOLT:PROT", protection))
        trips = regulated is Regulated.VOLTAGE or self._options.trip_at_current_limit
        self._protection.set_over_current(trips=trips)
        for header, value in (("CURR", current_limit), *steps):
            channel.write(header, f"{value:.6g}")
        for header, value in (("CURR", current_limit), *steps):
            channel.confirm(header, value)
        self._protection.confirm_over_current(trips=trips)

    @contextmanager
    def energised(
        self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE
    ) -> Iterator[None]:
        """Set voltage (V) and current limit (A), switch on for the length of the block, then off, and confirm it.

        The output is switched off on errors and Ctrl-C too. Raises what `configure` and `output_off` raise, and
        ReportedError where a protection has tripped, before the block or in it.
        """
        self._check_levels(voltage, current_limit)
        self._protection.refuse_latched()
        self.configure(voltage, current_limit, regulated)
        with always(self._end, self._session.calls):
            self._channel.write("OUTP", "ON")
            if not self._channel.flag("OUTP"):
                on = self._channel.command("OUTP", "ON")
                raise ReportedError(self._name, "the output did not switch on", command=on)
            yield

    def output_off(self) -> None:
        """Switch the output off and confirm that it is.

        Raises ReportedError where it stays on, CommunicationError where the instrument does not answer.
        """
        session = self._session
        with session.within(WAY_DOWN_TIME):
            try:
                still_on = self._switch_off()
            except (CommunicationError, ReportedError):
                # Off may be sent twice without harm, and must not depend on one lost message or an older error.
                still_on = session.insist(self._switch_off)
        if still_on:
            raise ReportedError(
                self._name,
                "the output is still on",
                command=self._channel.command("OUTP", "OFF"),
                remedy="Switch it off at the front panel",
            )

    def output_mode(self) -> OutputMode:
        """Say what regulates the output now; raises CommunicationError on an unusable reply."""
        condition = int(self._session.query_number(f"STAT:QUES:INST:ISUM{self._options.channel}:COND?"))
        regulation = decode_regulation(condition)
        if regulation in (OutputMode.CONSTANT_VOLTAGE, OutputMode.CONSTANT_CURRENT):
            return regulation
        if self._protection.tripped():
            return OutputMode.TRIPPED
        return OutputMode.UNREGULATED if self._channel.flag("OUTP") else OutputMode.OFF

    def clear_protection(self) -> None:
        """Release a tripped protection; the output stays off until it is switched on anew."""
        # Clearing restores the output to what it was before the trip: off must be what it is told last.
        self.output_off()
        self._channel.write("OUTP:PROT:CLE")
        self.output_off()

    def measure_voltage(self) -> Reading:
        """Return the output voltage (V) by the supply's own meter; raises MeasurementError where it has none."""
        return self._measure("MEAS:VOLT", "V", self._voltage_accuracy)

    def measure_current(self) -> Reading:
        """Return the output current (A) by the supply's own meter; raises MeasurementError where it has none."""
        return self._measure("MEAS:CURR", "A", self._current_accuracy)

    def make_safe(self) -> None:
        """Switch the output off and confirm it."""
        self.output_off()

    def close(self) -> None:
        """Close the connection."""
        self._session.close()

    def _check_levels(self, voltage: float, current_limit: float) -> None:
        check_setpoint(self._name, "voltage", voltage, "V", 0.0, self._maximum_voltage, self._voltage_owner)
        check_setpoint(self._name, "current limit", current_limit, "A", 0.0, self._maximum_current, self._current_owner)

    def _end(self) -> None:
        """Switch off, then say whether a protection had done so already; its latch is released."""
        self.output_off()
        tripped = self._protection.tripped()
        if tripped:
            self.clear_protection()
            raise ReportedError(
                self._name,
                f"{tripped} protection switched the output off",
                remedy="Check the leads, the motor's connection and the settings",
            )

    def _measure(self, header: str, unit: str, accuracy: Accuracy) -> Reading:
        value = self._channel.number(header)
        if is_overrange(value):
            raise MeasurementError(self._name, "the meter gives no value (9.9E37)", command=f"{header}?")
        return Reading(value, unit, accuracy, self._clock.now())

    def _protection_for(self, voltage: float) -> float:
        above = voltage * (1 + self._options.over_voltage_margin) + self._options.over_voltage_headroom
        return min(above, self._output.maximum_over_voltage)

    def _switch_off(self) -> bool:
        """Send off and return whether the output is on nevertheless."""
        self._channel.write("OUTP", "OFF")
        return self._channel.flag("OUTP")


def open_keysight_e36300(
    address: str,
    manager: "ResourceManager",
    clock: Clock,
    options: E36300Options,
    *,
    name: str = "supply",
    traffic: Traffic | None = None,
    calls: Calls = UNWATCHED,
    guarding: bool = False,
) -> KeysightE36300:
    """Open one output of an E36300 series supply at a VISA address.

    Raises CommunicationError where nothing answers, IdentityError where something else does.
    """
    session = open_session(address, manager, name, traffic=traffic, calls=calls)
    return open_driver(session, lambda session: KeysightE36300(session, clock, options, name=name, guarding=guarding))
