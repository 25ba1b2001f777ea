"""A DC supply that speaks SCPI: one output, every setting read back, off confirmed."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field

from drivers.bases.always import always
from drivers.bases.scpi_driver import ScpiDriver
from drivers.bases.set_points import check_setpoint, lesser
from drivers.bases.supply_data import ScpiSupplyOptions as ScpiSupplyOptions
from drivers.bases.supply_data import SupplyCommands as SupplyCommands
from drivers.bases.supply_data import SupplyData as SupplyData
from drivers.bases.supply_output import ScpiOutput as ScpiOutput
from drivers.bases.supply_output import SupplyProtection as SupplyProtection
from drivers.catalogue import Driver, Surroundings
from drivers.interfaces import (
    Accuracy,
    Clock,
    CommunicationError,
    Identity,
    MeasurementError,
    OutputMode,
    Reading,
    Regulated,
    ReportedError,
    Role,
    Supply,
)
from drivers.interfaces.text import text
from drivers.recognition import ScpiIdentity
from drivers.transport.visa.opening import identify, open_driver, open_session
from drivers.transport.visa.replies import is_overrange
from drivers.transport.visa.session import WAY_DOWN_TIME, ScpiSession

#: How near (relative to what may be set) a reading must be to a level for the output to count as regulated at it.
_REGULATED_WITHIN = 0.01


class ScpiSupply(ScpiDriver, Supply):
    """One output of a supply that has been identified; `data` are its ratings.

    With `guarding`, errors that wait in the queue are left to the process that made them.
    """

    def __init__(
        self,
        session: ScpiSession,
        clock: Clock,
        options: ScpiSupplyOptions,
        *,
        identity: Identity,
        data: SupplyData,
        commands: SupplyCommands | None = None,
        protection: SupplyProtection | None = None,
        name: str = "supply",
        guarding: bool = False,
    ) -> None:
        super().__init__(session, clock, name)
        self._options = options
        self._identity = identity
        self._data = data
        self._commands = commands or SupplyCommands()
        self._channel = ScpiOutput(session, self._commands.channel, name)
        self._voltage_accuracy = options.voltage_accuracy or data.voltage
        self._current_accuracy = options.current_accuracy or data.current
        self._maximum_voltage, self._voltage_owner = lesser(data.maximum_voltage, options.maximum_voltage)
        self._maximum_current, self._current_owner = lesser(data.maximum_current, options.maximum_current)
        self._protection = protection or SupplyProtection(self._channel, self._commands, name)
        if not guarding:
            session.check_left_errors()
        if self._commands.remote:
            session.send(self._commands.remote)
        if self._commands.local and not guarding:
            self._local = self._commands.local
            self._take_over(())

    @property
    def maximum_voltage(self) -> float:
        """Largest voltage (V) that may be set: the lesser of the model's and the station's."""
        return self._maximum_voltage

    @property
    def maximum_current(self) -> float:
        """Largest current limit (A) that may be set: the lesser of the model's and the station's."""
        return self._maximum_current

    def configure(self, voltage: float, current_limit: float, regulated: Regulated = Regulated.VOLTAGE) -> None:
        """Set voltage (V), current limit (A), over-voltage and over-current protection, and read each of them back.

        Over-current protection switches off an output that goes over to constant current, so it stays off where that is
        what is `regulated`, unless the station wants a trip at any current limit. Raises SetpointError before anything is
        sent, ReportedError where the instrument refuses, CommunicationError where it reads back another value.
        """
        self._check_levels(voltage, current_limit)
        channel, commands = self._channel, self._commands
        steps = [(commands.voltage, voltage)]
        if commands.over_voltage:
            steps = [(commands.over_voltage, self._protection_for(voltage)), *steps]
            # The protection must stay above the level at every moment, upwards and downwards.
            if voltage < channel.number(commands.voltage):
                steps.reverse()
        trips = regulated is Regulated.VOLTAGE or self._options.trip_at_current_limit
        self._protection.set_over_current(trips=trips)
        for header, value in ((commands.current, current_limit), *steps):
            channel.write(header, f"{value:.6g}")
        for header, value in ((commands.current, current_limit), *steps):
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
        output = self._commands.output
        with always(self._end, self._session.calls):
            self._channel.write(output, "ON")
            if not self._channel.flag(output):
                on = self._channel.command(output, "ON")
                raise ReportedError(self._name, text("the output did not switch on"), command=on)
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
                text("the output is still on"),
                command=self._channel.command(self._commands.output, "OFF"),
                remedy=text("Switch it off at the front panel"),
            )

    def output_mode(self) -> OutputMode:
        """Say what regulates the output now, by its meters; raises CommunicationError on an unusable reply."""
        if self._protection.tripped():
            return OutputMode.TRIPPED
        if not self._channel.flag(self._commands.output):
            return OutputMode.OFF
        commands = self._commands
        for header, level, highest, mode in (
            (commands.measure_current, commands.current, self._data.maximum_current, OutputMode.CONSTANT_CURRENT),
            (commands.measure_voltage, commands.voltage, self._data.maximum_voltage, OutputMode.CONSTANT_VOLTAGE),
        ):
            if abs(self._shown(header) - self._shown(level)) <= _REGULATED_WITHIN * highest:
                return mode
        return OutputMode.UNREGULATED

    def _clear_protection(self) -> None:
        """Release a tripped protection; the output stays off until it is switched on anew."""
        # Clearing may restore the output to what it was before the trip: off must be what it is told last.
        self.output_off()
        if self._commands.clear:
            self._channel.write(self._commands.clear)
        self.output_off()

    def measure_voltage(self) -> Reading:
        """Return the output voltage (V) by the supply's own meter; raises MeasurementError where it has none."""
        return self._measure(self._commands.measure_voltage, "V", self._voltage_accuracy)

    def measure_current(self) -> Reading:
        """Return the output current (A) by the supply's own meter; raises MeasurementError where it has none."""
        return self._measure(self._commands.measure_current, "A", self._current_accuracy)

    def make_safe(self) -> None:
        """Switch the output off and confirm it."""
        self.output_off()

    def _check_levels(self, voltage: float, current_limit: float) -> None:
        check_setpoint(self._name, "voltage", voltage, "V", 0.0, self._maximum_voltage, self._voltage_owner)
        check_setpoint(self._name, "current limit", current_limit, "A", 0.0, self._maximum_current, self._current_owner)

    def _end(self) -> None:
        """Switch off, then say whether a protection had done so already; its latch is released."""
        self.output_off()
        tripped = self._protection.tripped()
        if tripped:
            self._clear_protection()
            raise ReportedError(
                self._name,
                text("{tripped} protection switched the output off", tripped=tripped),
                remedy=text("Check the leads, the motor's connection and the settings"),
            )

    def _measure(self, header: str, unit: str, accuracy: Accuracy) -> Reading:
        return Reading(self._shown(header), unit, accuracy, self._clock.now())

    def _shown(self, header: str) -> float:
        value = self._channel.number(header)
        if is_overrange(value):
            command = f"{header}?"
            raise MeasurementError(self._name, text("the meter gives no value (9.9E37)"), command=command)
        return value

    def _protection_for(self, voltage: float) -> float:
        above = voltage * (1 + self._options.over_voltage_margin) + self._options.over_voltage_headroom
        return min(above, self._data.maximum_over_voltage)

    def _switch_off(self) -> bool:
        """Send off and return whether the output is on nevertheless."""
        self._channel.write(self._commands.output, "OFF")
        return self._channel.flag(self._commands.output)


@dataclass(frozen=True)
class ScpiSupplyModel:
    """A supply as data: identity, ratings and commands; `driver` makes a driver of it."""

    makers: tuple[str, ...]
    models: tuple[str, ...]
    data: SupplyData
    commands: SupplyCommands = field(default_factory=SupplyCommands)

    @property
    def identity(self) -> ScpiIdentity:
        """Identity by *IDN?."""
        return ScpiIdentity(
            tuple(maker.lower() for maker in self.makers), tuple(model.upper() for model in self.models)
        )

    def open(self, address: str, options: ScpiSupplyOptions, surroundings: Surroundings, name: str) -> ScpiSupply:
        """Open the supply at a VISA address.

        Raises CommunicationError where nothing answers, IdentityError where something else does.
        """

        def made(session: ScpiSession) -> ScpiSupply:
            return ScpiSupply(
                session,
                surroundings.clock,
                options,
                identity=identify(session, self.identity, options.serial_number),
                data=self.data,
                commands=self.commands,
                name=name,
                guarding=surroundings.guarding,
            )

        return open_driver(open_session(address, surroundings, name), made)

    def driver(self, name: str, *, simulated: str = "") -> Driver:
        """Return the driver of this supply; `simulated` names the simulated instrument that stands for it."""
        ratings: Mapping[str, float] = {
            "maximum_voltage": self.data.maximum_voltage,
            "maximum_current": self.data.maximum_current,
        }
        return Driver(
            name,
            Role.SUPPLY,
            ScpiSupplyOptions,
            self.open,
            simulated=simulated,
            ratings=ratings,
            recognised_by=(self.identity,),
        )
