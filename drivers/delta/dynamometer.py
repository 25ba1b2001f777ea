"""Dynamometer: a machine on a Delta C2000 drive, with a DYN-200 transducer in the shaft."""

import math
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property

from drivers.bases.always import always
from drivers.bases.set_points import check_setpoint, lesser
from drivers.catalogue import Surroundings
from drivers.delta.c2000 import COAST_TO_STOP, ControlMode, DeltaC2000, maximum_speed
from drivers.delta.c2000_watchdog import CommunicationWatchdog
from drivers.delta.dyn200 import RPM, Dyn200
from drivers.delta.options import DeltaDyn200Options
from drivers.interfaces import (
    Accuracy,
    Clock,
    CommunicationError,
    Dynamometer,
    DynamometerReading,
    Identity,
    MeasurementError,
    Watchdog,
)
from drivers.interfaces.text import text
from drivers.transport.modbus.line import ModbusLine, open_line

#: Share of full scale that is the limit of error of strain-gauge transducers of this class.
TORQUE_SHARE = 1e-3
TORQUE_SOURCE = "0.1 % of full scale, typical of its class; enter the transducer's calibration"
SPEED_SOURCE = "one digit, typical of its class; enter the transducer's calibration"
#: A shaft slower than this (rad/s) is at rest.
REST_SPEED = 0.5 * RPM
#: Consecutive readings that must agree before a speed counts as settled.
SETTLED_READINGS = 3


class DeltaDyn200(Dynamometer):
    """A dynamometer on one Modbus line; both units are asked for when this is made, with `guarding` when first needed.

    Raises CommunicationError where one of them does not answer, ReportedError where the drive is in fault.
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
        if not guarding:
            self._drive.check_fault()
        self._asked = None if guarding else Dyn200(line, options.transducer_unit)
        self._watchdog = CommunicationWatchdog(line, options.drive_unit)
        if options.watchdog_time and not guarding:
            self._watchdog.arm(options.watchdog_time)

    @cached_property
    def _transducer(self) -> Dyn200:
        return self._asked or Dyn200(self._line, self._options.transducer_unit)

    @cached_property
    def _torque_accuracy(self) -> Accuracy:
        full_scale = self._options.transducer_range or self._options.rated_torque
        return self._options.torque_accuracy or Accuracy(
            offset=TORQUE_SHARE * full_scale,
            resolution=self._transducer.torque_resolution,
            source=TORQUE_SOURCE,
        )

    @cached_property
    def _speed_accuracy(self) -> Accuracy:
        return self._options.speed_accuracy or Accuracy(
            offset=self._transducer.speed_resolution,
            resolution=self._transducer.speed_resolution,
            source=SPEED_SOURCE,
        )

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
        """Take the present torque reading as zero.

        Raises MeasurementError where the shaft turns.
        """
        speed = self._transducer.read().speed
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
            self._drive.command_speed(speed)
            self._drive.run()
            self._settle(speed)
            yield

    def set_speed(self, speed: float) -> None:
        """Change the commanded speed (rad/s) inside a `driving_speed` block and wait until it has settled.

        Raises SetpointError before anything is sent, MeasurementError where the speed does not settle.
        """
        self._check_speed(speed)
        self._drive.command_speed(speed)
        self._drive.run()
        self._settle(speed)

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
        with self._watchdog.fed(), always(self._end_torque, self._line.calls):
            # In torque control the frequency command limits the speed (parameter 11-36).
            self._drive.command_speed(highest)
            self._drive.command_torque(torque)
            self._drive.run_forward()
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
        """Return one reading: torque, speed and power from a single transaction."""
        reading = self._transducer.read()
        time = self._clock.now()
        speed = reading.speed
        if speed > 0:
            speed *= self._direction()
        power = math.copysign(reading.power, reading.torque * speed) if reading.power else 0.0
        return DynamometerReading(time, speed, reading.torque, power, self._speed_accuracy, self._torque_accuracy)

    def stop(self) -> None:
        """Brake to standstill, wait until the shaft is at rest, and disable the drive.

        Raises MeasurementError where it does not come to rest, ReportedError where the drive does not switch off.
        """
        with always(self._drive.disable, self._line.calls):
            if self._transducer.read().speed <= REST_SPEED:
                return
            self._drive.set_stop_method(COAST_TO_STOP)
            self._drive.disable()
            self._drive.set_mode(ControlMode.SPEED)
            # At 0 Hz the drive brakes along its ramp and then holds the shaft.
            self._drive.command_speed(0.0)
            self._drive.run()
            deadline = self._clock.now() + self._options.settle_timeout
            while (speed := self._transducer.read().speed) > REST_SPEED:
                if self._clock.now() >= deadline:
                    raise MeasurementError(
                        self._name,
                        text("the shaft still turns at {speed:.3g} rad/s", speed=speed),
                        remedy=text("Press the emergency stop"),
                    )
                self._clock.sleep(self._options.settle_interval)

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
        """Put the drive's watch back and close the connection; may be called twice."""
        self._watchdog.disarm()
        self._line.close()

    def _check_speed(self, speed: float) -> None:
        check_setpoint(
            self._name, "speed", speed, "rad/s", -self._maximum_speed, self._maximum_speed, self._speed_owner
        )

    def _prepare(self, mode: ControlMode) -> None:
        self._drive.check_fault()
        self._drive.set_stop_method(COAST_TO_STOP)
        self._drive.set_mode(mode)

    def _coast(self) -> None:
        with always(self._drive.disable, self._line.calls):
            self._drive.set_stop_method(COAST_TO_STOP)

    def _end_torque(self) -> None:
        try:
            self._drive.disable()
        finally:
            self._drive.command_torque(0.0)

    def _direction(self) -> int:
        return self._transducer.direction() if self._options.direction_from == "transducer" else self._drive.direction

    def _settle(self, speed: float) -> None:
        tolerance = abs(speed) * self._options.speed_tolerance + REST_SPEED
        agreement = abs(speed) * self._options.speed_stability + 2 * self._transducer.speed_resolution
        deadline = self._clock.now() + self._options.settle_timeout
        last: list[float] = []
        while True:
            last = [*last, self.measure().speed][-SETTLED_READINGS:]
            if (
                len(last) == SETTLED_READINGS
                and all(abs(found - speed) <= tolerance for found in last)
                and max(last) - min(last) <= agreement
            ):
                return
            if self._clock.now() >= deadline:
                self._drive.check_fault()
                raise MeasurementError(
                    self._name,
                    text(
                        "the speed is {last:.4g} rad/s {settle_timeout:g} s after {speed:.4g} rad/s was commanded",
                        last=last[-1],
                        settle_timeout=self._options.settle_timeout,
                        speed=speed,
                    ),
                    remedy=text("Check the coupling, the drive's ramp times and the torque limit"),
                )
            self._clock.sleep(self._options.settle_interval)
