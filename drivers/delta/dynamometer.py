"""Dynamometer: a machine on a Delta C2000 drive, with a DYN-200 transducer in the shaft."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property

from drivers.bases.always import always
from drivers.bases.set_points import check_setpoint, lesser
from drivers.catalogue import Surroundings
from drivers.delta.c2000 import COAST_TO_STOP, ControlMode, DeltaC2000, maximum_speed
from drivers.delta.c2000_watchdog import CommunicationWatchdog
from drivers.delta.dyn200 import Dyn200
from drivers.delta.found_settings import FoundDriveSettings
from drivers.delta.options import DeltaDyn200Options
from drivers.delta.shaft import REST_SPEED, RIPPLING_READINGS, Transducer
from drivers.delta.transducer_scales import CHANGING, READINGS, STEADY
from drivers.interfaces import (
    Clock,
    CommunicationError,
    Dynamometer,
    DynamometerReading,
    Identity,
    MeasurementError,
    OwnRamp,
    Watchdog,
    polls,
)
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import text
from drivers.transport.modbus.line import ModbusLine, open_line

_DRIVE_SILENT = text(
    "Check power and cable. A C2000 comes with 9600 bit/s, 7N2 in ASCII and unit 1: motorbench station set-framing finds it on its serial "
    "port and sets it as the station file says"
)


class DeltaDyn200(Dynamometer):
    """A dynamometer on one Modbus line; both units are asked for when this is made, with `guarding` when first needed.

    Raises CommunicationError where one of them does not answer, ReportedError where the drive is in fault or a setting that
    would change a figure is not as it must be.
    """

    def __init__(
        self,
        line: ModbusLine,
        clock: Clock,
        options: DeltaDyn200Options,
        *,
        name: str = "dynamometer",
        guarding: bool = False,
    ) -> None:
        self._line = line
        self._clock = clock
        self._options = options
        self._name = name
        self._maximum_speed, self._speed_owner = lesser(maximum_speed(options.pole_pairs), options.maximum_speed)
        self._maximum_torque, self._torque_owner = lesser(options.rated_torque, options.maximum_torque)
        self._drive = DeltaC2000(line, options.drive_unit, clock, options.pole_pairs, options.rated_torque)
        self._settings = FoundDriveSettings(line, options)
        self._asked: Transducer | None = None
        self._pushing = False
        self._watchdog = CommunicationWatchdog(line, options.drive_unit)
        if guarding:
            return
        self._ask_drive()
        self._asked = self._ask_transducer()
        try:
            self._settings.take_over()
            if options.watchdog_time:
                self._watchdog.arm(options.watchdog_time)
        except BaseException:
            self._settings.give_back()
            raise

    def _ask_drive(self) -> None:
        try:
            self._drive.check_fault()
        except CommunicationError as error:
            raise CommunicationError(
                error.instrument, error.what, command=error.command, remedy=_DRIVE_SILENT
            ) from error

    def _ask_transducer(self) -> Transducer:
        sensor = Dyn200(self._line, self._options.transducer_unit, self._options.speed_decimals)
        return Transducer(sensor, self._clock, self._options, self._name)

    @cached_property
    def _transducer(self) -> Transducer:
        return self._asked or self._ask_transducer()

    @classmethod
    def open(cls, address: str, options: DeltaDyn200Options, surroundings: Surroundings, name: str) -> "DeltaDyn200":
        """Open the dynamometer at `tcp://host:port` or `rtu:///dev/…?baudrate=…`, or in process at `in-process://…`.

        Raises CommunicationError where a unit does not answer, ReportedError where the drive is in fault.
        """
        line = open_line(
            address,
            name,
            traffic=surroundings.traffic,
            calls=surroundings.calls,
            in_process=surroundings.in_process,
            clock=surroundings.clock,
            wire=surroundings.wire,
        )
        try:
            return cls(line, surroundings.clock, options, name=name, guarding=surroundings.guarding)
        except BaseException:
            line.close()
            raise

    @property
    def identity(self) -> Identity:
        """The two makers and models; neither unit tells a serial number over Modbus."""
        return Identity("Delta Electronics", "C2000 with DYN-200")

    @property
    def found_state(self) -> tuple[FoundSetting, ...]:
        """Settings of drive and transducer as found."""
        return self._settings.found

    @property
    def watchdog(self) -> Watchdog | None:
        """The drive's communication time-out, as it was armed and read back."""
        return self._watchdog.armed

    @property
    def maximum_speed(self) -> float:
        """Largest speed (rad/s) that may be commanded: the lesser of the drive's and the station's."""
        return self._maximum_speed

    @property
    def maximum_torque(self) -> float:
        """Largest torque (N·m) that may be commanded: the lesser of the machine's rated and the station's."""
        return self._maximum_torque

    def zero_torque(self) -> None:
        """Take the present torque as zero, by the sensor or else by subtraction here, which a torque's accuracy then says.

        Raises MeasurementError where the shaft turns.
        """
        speed = self._transducer.speed()
        if speed > REST_SPEED:
            raise MeasurementError(
                self._name, text("the shaft turns at {speed:.3g} rad/s, torque cannot be zeroed", speed=speed)
            )
        self._transducer.zero()

    @contextmanager
    def driving_speed(self, speed: float) -> Iterator[None]:
        """Hold the shaft at a speed (rad/s) for the length of the block; the drive is disabled at its end.

        Raises SetpointError before anything is sent, MeasurementError where the speed does not settle,
        ReportedError where the drive is in fault or does not switch off.
        """
        self._check_speed(speed)
        self._prepare(ControlMode.SPEED)
        with self._watchdog.fed(), always(self._drive.disable, self._line.calls):
            self._drive_at(speed)
            yield

    def set_speed(self, speed: float) -> None:
        """Change the commanded speed (rad/s) inside a `driving_speed` block and wait until it has settled.

        Raises SetpointError before anything is sent, MeasurementError where the speed does not settle.
        """
        self._check_speed(speed)
        self._drive_at(speed)

    @contextmanager
    def driving_torque(self, torque: float, speed_limit: float | None = None) -> Iterator[None]:
        """Put a constant torque (N·m) on the shaft for the length of the block; the drive is disabled at its end.

        `speed_limit` (rad/s), the largest speed when not given, stands as the drive's own. Raises SetpointError before
        anything is sent, ReportedError where the drive is in fault or does not switch off.
        """
        highest = self._maximum_speed if speed_limit is None else speed_limit
        check_setpoint(self._name, "speed limit", highest, "rad/s", 0.0, self._maximum_speed, self._speed_owner)
        check_setpoint(
            self._name, "torque", torque, "N·m", -self._maximum_torque, self._maximum_torque, self._torque_owner
        )
        self._prepare(ControlMode.TORQUE)
        self._settings.verify_torque()
        if self._transducer.speed() <= REST_SPEED:
            # From rest a shaft turns the way it is pushed.
            self._transducer.heading = -1 if torque < 0 else 1
        with self._watchdog.fed(), always(self._end_torque, self._line.calls):
            # In torque control the frequency command limits the speed (parameter 11-36).
            self._drive.command_speed(highest)
            self._drive.command_torque(torque)
            self._drive.run()
            self._pushing = True
            yield

    def command_zero(self) -> None:
        """Command no torque and no speed, whatever the drive does now; in speed control it brakes along its ramp.

        Raises ReportedError where the drive refuses, CommunicationError where it does not answer.
        """
        try:
            self._drive.command_zero()
        except CommunicationError:
            self._line.reopen()
            self._drive.command_zero()

    def measure(self) -> DynamometerReading:
        """Return one reading: torque, speed and power from a single transaction.

        Where nobody told the shaft its direction, the speed is a magnitude, and its accuracy says so. Raises MeasurementError
        where power, torque, speed and the drive's frequency contradict each other.
        """
        while True:
            shaft = self._transducer.read()
            time = self._clock.now()
            if self._may_be_used(shaft.speed):
                return self._transducer.as_reading(shaft, time)
            self._clock.sleep(self._options.settle_interval)

    def stop(self) -> None:
        """Brake to standstill, wait until the shaft is at rest, and disable the drive.

        Raises MeasurementError where it does not come to rest, ReportedError where the drive does not switch off.
        """
        with always(self._drive.disable, self._line.calls):
            if self._transducer.speed() <= REST_SPEED:
                return
            self._drive.set_stop_method(COAST_TO_STOP)
            self._drive.disable()
            self._drive.set_mode(ControlMode.SPEED)
            # At 0 Hz the drive brakes along its ramp and then holds the shaft.
            self._drive.command_speed(0.0)
            self._drive.run()
            for last in polls(self._clock, self._options.settle_timeout, self._options.settle_interval):
                if (speed := self._transducer.speed()) <= REST_SPEED:
                    break
                if last:
                    raise MeasurementError(
                        self._name,
                        text("the shaft still turns at {speed:.3g} rad/s", speed=speed),
                        remedy=text("Press the emergency stop"),
                    )

    def make_safe(self) -> None:
        """Take torque and output off, over a renewed connection where the present one fails; the shaft coasts.

        Raises ReportedError where the drive does not switch off, CommunicationError where it does not answer.
        """
        try:
            self._coast()
        except CommunicationError:
            self._line.reopen()
            self._coast()

    def close(self) -> None:
        """Put the drive's watch and settings back and close the connection; may be called twice."""
        self._watchdog.disarm()
        self._settings.give_back()
        self._line.close()

    def _check_speed(self, speed: float) -> None:
        check_setpoint(
            self._name, "speed", speed, "rad/s", -self._maximum_speed, self._maximum_speed, self._speed_owner
        )

    def _may_be_used(self, speed: float) -> bool:
        """Tell whether a speed (rad/s) contradicts the drive's frequency in no way; an error where it does so again and again."""
        scale = self._transducer.speed_scale
        if not self._pushing or scale.settled or not speed:
            return True
        return scale.compare(speed, self._drive.output_speed(), CHANGING, READINGS)

    def _prepare(self, mode: ControlMode) -> None:
        self._drive.check_fault()
        self._drive.set_stop_method(COAST_TO_STOP)
        self._drive.set_mode(mode)

    def _drive_at(self, speed: float) -> None:
        self._drive.command_speed(speed)
        self._transducer.heading = -1 if speed < 0 else 1
        self._drive.run(reverse=speed < 0)
        self._settle(speed)

    def _coast(self) -> None:
        with always(self._drive.disable, self._line.calls):
            self._drive.set_stop_method(COAST_TO_STOP)

    def _end_torque(self) -> None:
        self._pushing = False
        try:
            self._drive.disable()
        finally:
            self._drive.command_torque(0.0)

    def _compare(self, speed: float, within: float) -> None:
        self._transducer.speed_scale.compare(speed, self._drive.output_speed(), within)

    def _settle(self, speed: float) -> None:
        latest: list[float] = []
        ramp = OwnRamp(self._clock, self._options.settle_timeout, self._options.settle_interval)
        for _ in ramp.polls():
            found = self._transducer.read().speed
            latest = [*latest, found][-RIPPLING_READINGS:]
            if self._transducer.has_settled(latest, speed):
                self._compare(found, STEADY)
                return
            if ramp.stalled(abs(found - speed)):
                self._drive.check_fault()
                if step := self._transducer.step_about(latest, speed):
                    raise MeasurementError(
                        self._name,
                        text(
                            "the speed is read in steps of {step:.4g} rad/s, as few pulses counted over a short time give it, and so "
                            "{speed:.4g} rad/s is not told from {low:.4g} to {high:.4g} rad/s",
                            step=step,
                            speed=speed,
                            low=min(latest),
                            high=max(latest),
                        ),
                        remedy=text(
                            "Use a sensor of more pulses a turn, let the transducer count for longer, or command a higher speed"
                        ),
                    )
                self._compare(found, CHANGING)
                raise MeasurementError(
                    self._name,
                    text(
                        "the speed is {last:.4g} rad/s {elapsed:.3g} s after {speed:.4g} rad/s was commanded, and comes no nearer",
                        last=found,
                        elapsed=ramp.elapsed,
                        speed=speed,
                    ),
                    remedy=text("Check the coupling, the drive's ramp times and the torque limit"),
                )
