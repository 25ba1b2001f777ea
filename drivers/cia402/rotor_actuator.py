"""Rotor actuator with the CiA 402 drive profile over CANopen: a positioning drive with brake, clutch and coupling."""

import math
from collections.abc import Callable

from drivers.bases.always import always
from drivers.bases.set_points import check_setpoint
from drivers.cia402.node import Cia402Node
from drivers.cia402.opening import Cia402Driver
from drivers.cia402.options import Cia402RotorActuatorOptions
from drivers.cia402.power_state import CONTROLWORD, ENABLE_OPERATION, STATUSWORD
from drivers.cia402.velocity_unit import ENCODER_RESOLUTION, FEED_CONSTANT, VelocityUnit, read_unit
from drivers.interfaces import (
    Accuracy,
    Clock,
    InstrumentError,
    MeasurementError,
    Reading,
    ReportedError,
    RotorActuator,
    polls,
)
from drivers.interfaces.text import Text, text

ACTUAL_POSITION, TARGET_POSITION = 0x6064, 0x607A
ACTUAL_VELOCITY, PROFILE_SPEED, TARGET_VELOCITY = 0x606C, 0x6081, 0x60FF
INPUTS, OUTPUTS = 0x60FD, 0x60FE
#: Modes of operation.
PROFILE_POSITION, PROFILE_VELOCITY = 1, 3
#: Bits of the digital outputs, which the inputs repeat once the mechanism has moved.
BRAKE, CLUTCH, COUPLING = 1 << 16, 1 << 17, 1 << 18
_ALL = BRAKE | CLUTCH | COUPLING
#: Subindices of the digital outputs: the outputs, and which of them the bus switches.
OUTPUT_STATES, OUTPUT_MASK = 1, 2
#: Controlword: a new set point is there. Statusword: it was taken; the target is reached.
NEW_SET_POINT, TAKEN, REACHED = 1 << 4, 1 << 12, 1 << 10

#: Below this speed (rad/s) a shaft stands: no mechanism is hurt by that.
STANDING = 0.1
#: An even speed is within this share of the one asked for, or this (rad/s).
_SPEED_TOLERANCE, _LEAST_TOLERANCE = 0.05, 0.01
#: The drive says within its own window (0x6067) that it is there; farther off than this (rad) something has slipped.
_POSITION_TOLERANCE = math.radians(2.0)
_WRAP = 1 << 32
#: What a part does not do, by its bit and whether it was to close.
_STUCK = {
    (BRAKE, True): text("the brake stays open"),
    (BRAKE, False): text("the brake stays closed"),
    (CLUTCH, True): text("the clutch stays open"),
    (CLUTCH, False): text("the clutch stays closed"),
    (COUPLING, True): text("the coupling to the dynamometer stays open"),
    (COUPLING, False): text("the coupling to the dynamometer stays closed"),
}


class Cia402RotorActuator(Cia402Driver, RotorActuator):
    """A rotor actuator by its node. Raises ReportedError where it states no whole number of increments per turn."""

    def __init__(
        self, node: Cia402Node, clock: Clock, options: Cia402RotorActuatorOptions, *, name: str = "rotor_actuator"
    ) -> None:
        self._node = node
        self._objects = node.objects
        self._power = node.power
        self._clock = clock
        self._options = options
        self._name = name
        self._counts: int | None = None
        self._increments = options.increments_per_turn or 0
        if node.guarding:
            return
        self._increments = self._increments or self._encoder()
        node.take_over()
        self._unit: VelocityUnit = self._turns(read_unit(node.objects, options.velocity_unit, self._increments))
        mask = self._objects.read_optional(OUTPUTS, OUTPUT_MASK, 4)
        # CiA 402 leaves the mask to the maker; without one every output is the bus' to switch.
        if mask is not None and mask & _ALL != _ALL:
            self._objects.write(OUTPUTS, OUTPUT_MASK, mask | _ALL, 4)
        node.watch()

    @property
    def maximum_speed(self) -> float:
        """Largest speed (rad/s) at which it turns the shaft: the station's limit."""
        return self._options.maximum_speed

    def lock(self) -> None:
        """Hold the shaft where it stands; returns when the brake has closed.

        Raises ReportedError where it does not close, InstrumentError while the shaft turns.
        """
        self._refuse_turning(text("the brake closes only while the shaft is at rest"))
        self._switch(BRAKE, BRAKE | CLUTCH)

    def release(self) -> None:
        """Open brake and clutch, so that the shaft turns freely; returns when they have opened."""
        self._switch(0, BRAKE | CLUTCH)

    def turn(self, speed: float) -> None:
        """Turn the shaft evenly at `speed` (rad/s, sign is direction) until stopped; returns once it does.

        Raises SetpointError beyond the maximum, InstrumentError with the brake closed, MeasurementError where the shaft does
        not get to that speed; it is let go of then.
        """
        highest = self._options.maximum_speed
        check_setpoint(self._name, "speed", speed, "rad/s", -highest, highest, "the station")
        try:
            self._take_hold(PROFILE_VELOCITY, TARGET_VELOCITY)
            self._objects.write(TARGET_VELOCITY, 0, self._as_velocity(speed), 4, signed=True)
            tolerance = max(_SPEED_TOLERANCE * abs(speed), _LEAST_TOLERANCE)
            self._await(
                lambda: abs(self._speed() - speed) <= tolerance,
                lambda: self._missed(speed),
            )
            self._power.check_operation()
        except BaseException as error:
            self._let_go_after(error)
            raise

    def stop(self) -> None:
        """End turning and let the shaft go; returns when the drive stands."""
        with always(self._release_hold, self._objects.calls):
            self._objects.write(TARGET_VELOCITY, 0, 0, 4)
            self._await(
                lambda: abs(self._speed()) <= STANDING,
                lambda: self._missed(0.0),
            )

    def move_by(self, angle: float) -> None:
        """Turn the shaft by an angle (rad) and let it go.

        Raises SetpointError for more than the drive can count, InstrumentError with the brake closed, MeasurementError where
        the shaft does not get there.
        """
        farthest = (_WRAP / 2 - 1) / self._increments * 2.0 * math.pi
        check_setpoint(self._name, "angle", angle, "rad", -farthest, farthest, "0x607A")
        with always(self._release_hold, self._objects.calls):
            self._take_hold(PROFILE_POSITION, None)
            target = _wrapped(self._position() + self._as_counts(angle))
            self._objects.write(PROFILE_SPEED, 0, self._as_velocity(self._options.maximum_speed), 4)
            self._objects.write(TARGET_POSITION, 0, target, 4, signed=True)
            self._objects.write(CONTROLWORD, 0, ENABLE_OPERATION | NEW_SET_POINT, 2)
            self._await(lambda: bool(self._status() & TAKEN), lambda: text("a new target position was not taken"))
            self._objects.write(CONTROLWORD, 0, ENABLE_OPERATION, 2)
            # It cannot be there sooner.
            self._clock.sleep(abs(angle) / self._options.maximum_speed)
            tolerance = self._as_counts(_POSITION_TOLERANCE)
            self._await(
                lambda: bool(self._status() & REACHED) and abs(_wrapped(self._position() - target)) <= tolerance,
                lambda: text("the shaft is {angle:.3g}° from its target", angle=math.degrees(self._remaining(target))),
            )
            self._power.check_operation()

    def angle(self) -> Reading:
        """Return the shaft's angle (rad) by the encoder that sits on it."""
        counts = self._position()
        # The counter has 32 bits and the angle does not wrap.
        self._counts = counts if self._counts is None else self._counts + _wrapped(counts - self._counts)
        step = 2.0 * math.pi / self._increments
        accuracy = self._options.angle_accuracy or Accuracy(
            resolution=step, source="one increment of 0x6064; no drive profile states an accuracy"
        )
        return Reading(self._counts * step, "rad", accuracy, self._clock.now())

    def couple_dynamometer(self) -> None:
        """Close the coupling to the dynamometer; refused with InstrumentError while the shaft turns."""
        self._refuse_turning(text("the coupling closes only while the shaft is at rest"))
        self._switch(COUPLING, COUPLING)

    def uncouple_dynamometer(self) -> None:
        """Open the coupling to the dynamometer; refused with InstrumentError while the shaft turns."""
        self._refuse_turning(text("the coupling opens only while the shaft is at rest"))
        self._switch(0, COUPLING)

    def make_safe(self) -> None:
        """Take the torque away and open the clutch, and make sure of both; the brake stays as it is.

        Raises ReportedError naming a fault that was found, or a clutch that stays engaged.
        """
        self._let_go()

    def _take_hold(self, mode: int, target: int | None) -> None:
        """Hold the standing shaft, by the clutch, in a mode in which it was told to stay where it is."""
        if self._objects.read(INPUTS, 0, 4) & BRAKE:
            raise InstrumentError(self._name, text("the brake is closed"), remedy=text("Release the shaft first"))
        self._node.select(mode)
        if target is not None:
            self._objects.write(target, 0, 0, 4)
        self._node.enable()
        self._switch(CLUTCH, CLUTCH)

    def _release_hold(self) -> None:
        """Open the clutch while the drive still holds the shaft, so that it is let go of where it is; then no torque."""
        with always(self._node.disable, self._objects.calls):
            self._switch(0, CLUTCH)

    def _let_go(self) -> None:
        with always(lambda: self._switch(0, CLUTCH), self._objects.calls):
            self._node.disable()

    def _let_go_after(self, error: BaseException) -> None:
        try:
            with self._objects.calls.making_safe():
                self._let_go()
        except InstrumentError as failure:
            error.add_note(f"During the shutdown: {failure}")

    def _switch(self, wanted: int, mask: int) -> None:
        """Set the outputs in `mask` and return once the mechanism has followed; raises ReportedError where it does not."""
        outputs = self._objects.read(OUTPUTS, OUTPUT_STATES, 4)
        if outputs & mask != wanted:
            self._objects.write(OUTPUTS, OUTPUT_STATES, outputs & ~mask | wanted, 4)
        for last in polls(self._clock, self._options.timeout, self._options.poll_interval):
            if (stuck := (self._objects.read(INPUTS, 0, 4) ^ wanted) & mask) == 0:
                break
            if last:
                parts = [_STUCK[bit, bool(wanted & bit)] for bit in (BRAKE, CLUTCH, COUPLING) if stuck & bit]
                raise ReportedError(
                    self._name,
                    text("{parts} {timeout:g} s after the command", parts=parts, timeout=self._options.timeout),
                    command="read 0x60FD:00",
                    remedy=text("Check air, power and end switches of the mechanism"),
                )

    def _refuse_turning(self, why: Text) -> None:
        speed = self._speed()
        if abs(speed) > STANDING:
            raise InstrumentError(
                self._name,
                text("the shaft turns at {speed:.3g} rad/s, and {why}", speed=speed, why=why),
                command="read 0x606C:00",
                remedy=text("Wait until it stands"),
            )

    def _await(self, reached: Callable[[], bool], finding: Callable[[], Text]) -> None:
        for last in polls(self._clock, self._options.timeout, self._options.poll_interval):
            if reached():
                break
            self._power.check_fault()
            if last:
                raise MeasurementError(
                    self._name, finding(), remedy=text("Check that the shaft turns freely, and clutch and brake")
                )

    def _encoder(self) -> int:
        increments = self._objects.read_optional(ENCODER_RESOLUTION, 1, 4)
        turns = self._objects.read_optional(ENCODER_RESOLUTION, 2, 4)
        if not increments or not turns or increments % turns:
            raise ReportedError(
                self._name,
                text(
                    "the drive states no whole number of increments per turn ({increments} in {turns})",
                    increments=increments,
                    turns=turns,
                ),
                command="read 0x608F",
                remedy=text("Set increments_per_turn in the station file"),
            )
        feed, revolutions = (self._objects.read_optional(FEED_CONSTANT, subindex, 4) for subindex in (1, 2))
        # A feed of 1:1 was never set up.
        if feed and revolutions and feed != revolutions and feed * turns != revolutions * increments:
            raise ReportedError(
                self._name,
                text(
                    "positions are counted in units of a feed ({feed} in {turns} turns)", feed=feed, turns=revolutions
                ),
                command="read 0x6092",
                remedy=text(
                    "Set 0x6092 to the increments of one turn, or increments_per_turn to the units of one turn"
                ),
            )
        return increments // turns

    def _status(self) -> int:
        return self._objects.read(STATUSWORD, 0, 2)

    def _position(self) -> int:
        return self._objects.read(ACTUAL_POSITION, 0, 4, signed=True)

    def _remaining(self, target: int) -> float:
        return _wrapped(self._position() - target) / self._increments * 2.0 * math.pi

    def _missed(self, wanted: float) -> Text:
        return text(
            "the speed is {speed:.3g} rad/s, {wanted:.3g} rad/s was commanded", speed=self._speed(), wanted=wanted
        )

    def _speed(self) -> float:
        counts = self._objects.read(ACTUAL_VELOCITY, 0, 4, signed=True)
        return counts / self._unit.counts * 2.0 * math.pi

    def _turns(self, unit: VelocityUnit) -> VelocityUnit:
        if unit.electrical:
            raise ReportedError(
                self._name,
                text("velocity_unit is an electrical frequency, and this drive turns a shaft"),
                remedy=text('State "counts/s", "rpm" … in the station file'),
            )
        return unit

    def _as_velocity(self, speed: float) -> int:
        return round(speed / (2.0 * math.pi) * self._unit.counts)

    def _as_counts(self, angle: float) -> int:
        """Return an angle (rad) in increments."""
        return round(angle / (2.0 * math.pi) * self._increments)


def _wrapped(counts: int) -> int:
    """Return counts as a signed number of 32 bits."""
    return (counts + _WRAP // 2) % _WRAP - _WRAP // 2
