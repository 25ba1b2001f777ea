"""A moteus as the inverter: d- and q-axis currents at the rotor's own angle, over CAN FD.

Its firmware watches nothing in this mode: a drive whose commands stay away goes on with the last currents.
"""

from collections.abc import Iterator
from contextlib import contextmanager, suppress

from drivers.bases.always import always
from drivers.bases.identification import check_serial_number
from drivers.bases.set_points import check_setpoint
from drivers.catalogue import Surroundings
from drivers.interfaces import (
    Clock,
    DqReading,
    DqSample,
    Identity,
    InstrumentError,
    Inverter,
    InverterAbility,
    MeasurementError,
    Reading,
    polls,
)
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import text
from drivers.mjbots.configuration import FoundConfiguration, MoteusConfiguration
from drivers.mjbots.controller import MoteusController
from drivers.mjbots.diagnostics import DiagnosticStream
from drivers.mjbots.identity import BITRATE
from drivers.mjbots.options import ABILITIES, MoteusOptions
from drivers.mjbots.power_stage import MoteusPowerStage
from drivers.mjbots.readings import MoteusReadings
from drivers.mjbots.registers import Register
from drivers.mjbots.strokes import alternating, check_strokes
from drivers.transport.can.fdcanusb import FdcanusbNode, is_fdcanusb

#: Currents count as settled where the mean of so many samples is what was commanded.
_SETTLED_SAMPLES = 3
#: Shares of the largest current: within which they have settled, where the station says nothing, and below which none flows.
_TOLERANCE, _NO_CURRENT = 0.02, 0.05


class MjbotsMoteus(Inverter):
    """A moteus by its controller, which is left stopped.

    Raises ReportedError for firmware or a configuration that cannot be used, IdentityError for another one than the station names.
    """

    def __init__(
        self,
        controller: MoteusController,
        clock: Clock,
        options: MoteusOptions,
        *,
        name: str = "inverter",
        guarding: bool = False,
    ) -> None:
        self._controller = controller
        self._clock = clock
        self._options = options
        self._name = name
        self._power = MoteusPowerStage(
            controller, clock, options.transition_timeout, _NO_CURRENT * options.maximum_current
        )
        self._drives = False
        self._found: FoundConfiguration | None = None
        self._identity = Identity("", "")
        self._maximum_current = options.maximum_current
        stream = DiagnosticStream(controller, clock)
        if guarding:
            # Nothing is asked: a speed is looked at once it has to be zero.
            plain = MoteusConfiguration(options.pole_pairs or 1, 1.0, 1.0, options.maximum_current, False)
            self._readings = MoteusReadings(controller, stream, self._power, clock, plain, options)
            return
        self._identity = controller.identify()
        check_serial_number(name, self._identity, options.serial_number, "read 0x120")
        found = FoundConfiguration(stream, options, name)
        configuration = found.take_over()
        self._found = found
        self._maximum_current = min(options.maximum_current, configuration.maximum_current)
        self._readings = MoteusReadings(controller, stream, self._power, clock, configuration, options)

    @classmethod
    def open(cls, address: str, options: MoteusOptions, surroundings: Surroundings, name: str) -> "MjbotsMoteus":
        """Open the controller at `can://interface/channel?node=1`, or at `fdcanusb:///dev/fdcanusb?node=1`.

        Raises CommunicationError where the bus cannot be opened or nobody answers, and what making one raises.
        """
        line = (
            FdcanusbNode(address, name, surroundings.wire)
            if is_fdcanusb(address)
            else surroundings.can_buses.fd_node(address, name, BITRATE, surroundings.wire)
        )
        try:
            controller = MoteusController(
                line,
                name,
                prefix=options.can_prefix,
                traffic=surroundings.traffic,
                calls=surroundings.calls,
                guarding=surroundings.guarding,
            )
            return cls(controller, surroundings.clock, options, name=name, guarding=surroundings.guarding)
        except BaseException:
            line.disconnect()
            raise

    @property
    def identity(self) -> Identity:
        """Maker, model, serial number and firmware."""
        return self._identity

    @property
    def found_state(self) -> tuple[FoundSetting, ...]:
        """Configuration as found."""
        return () if self._found is None else self._found.settings

    @property
    def abilities(self) -> frozenset[InverterAbility]:
        """Currents of both axes; its voltages and the rotor's angle are read."""
        return ABILITIES

    @property
    def maximum_current(self) -> float:
        """Largest phase current (A, peak) that may be commanded: the station's limit, or the drive's own where that is less."""
        return self._maximum_current

    @property
    def maximum_frequency(self) -> float:
        """None (0 Hz): it turns at no frequency that is asked for."""
        return 0.0

    @contextmanager
    def driving_current(self, current: float) -> Iterator[None]:
        """Regulate the q-axis current (A, peak), and none in the d axis, for the length of the block; stopped at the end.

        Errors as for `driving_dq_current`.
        """
        with self.driving_dq_current(0.0, current):
            yield

    @contextmanager
    def driving_dq_current(self, d_current: float, q_current: float) -> Iterator[None]:
        """Regulate the d- and q-axis currents (A, peak) at the rotor's own angle for the length of the block; stopped at the end.

        Raises SetpointError before anything is sent, MeasurementError where a current does not settle or is limited, ReportedError
        for a fault, or a drive that does not start or stop.
        """
        self._check(d_current, q_current)
        with always(self._stop, self._controller.calls):
            command = self._power.start(d_current, q_current)
            self._drives = True
            self._settle(d_current, q_current, command)
            yield

    def set_current(self, current: float) -> None:
        """Change the q-axis current (A, peak), with none in the d axis, and wait until it has settled; errors as for `set_dq_current`."""
        self.set_dq_current(0.0, current)

    def set_dq_current(self, d_current: float, q_current: float) -> None:
        """Change both currents (A, peak) inside a block and wait until they have settled.

        Raises SetpointError before anything is sent, InstrumentError outside of a block, others as `driving_dq_current`.
        """
        self._check(d_current, q_current)
        if not self._drives:
            raise self._idle()
        self._settle(d_current, q_current, self._power.change(d_current, q_current))

    def alternate_dq_current(
        self,
        d_current: float,
        q_current: float,
        other_d_current: float,
        other_q_current: float,
        duration: float,
        strokes: int,
    ) -> tuple[DqSample, ...]:
        """Alternate between two current vectors (A, peak) inside a block, as the interface says.

        Raises SetpointError before anything is sent, InstrumentError outside of a block, ReportedError where it regulates no more.
        """
        vectors = (complex(d_current, q_current), complex(other_d_current, other_q_current))
        for vector in vectors:
            self._check(vector.real, vector.imag)
        check_strokes(self._name, duration, strokes)
        if not self._drives:
            raise self._idle()
        return tuple(alternating(self._power, self._readings, self._clock, vectors, duration, strokes))

    def measure_frequency(self) -> Reading:
        """Return the rotor's electrical frequency (Hz)."""
        frequency = self._readings.frequency(self._readings.registers())
        return Reading(frequency, "Hz", self._readings.frequency_accuracy, self._clock.now())

    def measure_current(self) -> Reading:
        """Return the q-axis current (A, peak)."""
        current = self._readings.registers()[Register.Q_CURRENT]
        return Reading(current, "A", self._readings.current_accuracy, self._clock.now())

    def measure_dq(self, duration: float = 0.0) -> DqReading:
        """Return the means of what it says within `duration` (s); voltages are NaN where it is stopped.

        Raises MeasurementError where its output is limited, ReportedError where it is at fault.
        """
        return self._readings.measure(duration)

    def command_zero(self) -> None:
        """Command no current, whatever the drive does now; it stays enabled if it regulates currents, and is stopped otherwise."""
        self._power.command_zero()

    def make_safe(self) -> None:
        """Stop and make sure of it; raises ReportedError naming a fault that was found."""
        self._stop()

    def close(self) -> None:
        """Give back what was found otherwise and leave the bus; may be called twice."""
        found, self._found = self._found, None
        try:
            if found is not None:
                self._give_back(found)
        finally:
            self._controller.disconnect()

    def _idle(self) -> InstrumentError:
        return InstrumentError(
            self._name,
            text("it regulates no current; nothing was sent"),
            remedy=text("Change currents inside a block that regulates them"),
        )

    def _give_back(self, found: FoundConfiguration) -> None:
        # One that is gone is not waited for setting by setting, and none is changed under power.
        with suppress(InstrumentError):
            if self._power.is_off:
                found.give_back()

    def _stop(self) -> None:
        self._drives = False
        self._power.stop()

    def _check(self, d_current: float, q_current: float) -> None:
        highest = self._maximum_current
        whose = (
            text("the station") if highest == self._options.maximum_current else text("the drive (servo.max_current_A)")
        )
        for label, value in (("d-axis current", d_current), ("q-axis current", q_current)):
            check_setpoint(self._name, label, value, "A", -highest, highest, whose)
        length = (d_current**2 + q_current**2) ** 0.5
        # What rounds up of a vector at the limit is none that is beyond it.
        check_setpoint(self._name, "current vector", length, "A", 0.0, highest * (1.0 + 1e-12), whose)

    def _settle(self, d_current: float, q_current: float, command: str) -> None:
        tolerance = self._options.current_tolerance or _TOLERANCE * self._options.maximum_current
        latest: list[tuple[float, float]] = []
        for last in polls(self._clock, self._options.settle_timeout, self._options.sample_interval):
            registers = self._readings.registers()
            self._power.check(registers, command)
            latest = [*latest[1 - _SETTLED_SAMPLES :], (registers[Register.D_CURRENT], registers[Register.Q_CURRENT])]
            means = [sum(axis) / len(latest) for axis in zip(*latest, strict=True)]
            apart = max(abs(means[0] - d_current), abs(means[1] - q_current))
            limited = self._power.limited(registers)
            if len(latest) == _SETTLED_SAMPLES and apart <= tolerance and limited is None:
                return
            if last:
                raise limited or MeasurementError(
                    self._name,
                    text(
                        "the currents are {d:g} A and {q:g} A {settle_timeout:g} s after {command}",
                        d=means[0],
                        q=means[1],
                        settle_timeout=self._options.settle_timeout,
                        command=command,
                    ),
                    command=command,
                    remedy=text("Check the motor's three wires and the drive's current loop (servo.pid_dq)"),
                )
