"""Inverter with the CiA 402 drive profile over CANopen: velocity in the drive's user units, torque in thousandths."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cached_property

from drivers.bases.always import always
from drivers.bases.set_points import check_setpoint
from drivers.cia402.motor_ratings import read_rated_current
from drivers.cia402.node import Cia402Node
from drivers.cia402.opening import Cia402Driver
from drivers.cia402.options import ABILITIES, Cia402Options
from drivers.cia402.power_state import INTERNAL_LIMIT, STATUSWORD, ObjectReader
from drivers.cia402.velocity import MODES, TARGET_VELOCITY, VL_TARGET_VELOCITY, Velocity, open_velocity
from drivers.interfaces import (
    Accuracy,
    Clock,
    InstrumentError,
    Inverter,
    InverterAbility,
    MeasurementError,
    OwnRamp,
    Reading,
    ReportedError,
)
from drivers.interfaces.text import Text, text
from drivers.transport.can.process_data import MappedObject

TARGET_TORQUE, ACTUAL_TORQUE, ACTUAL_CURRENT = 0x6071, 0x6077, 0x6078
MAX_TORQUE, MAX_CURRENT = 0x6072, 0x6073

PROFILE_TORQUE, CYCLIC_TORQUE = 4, 10
#: Torque and current per mille of rated.
TORQUE_STEP = 1e-3
#: How far torque and current may be apart in thousandths (of rated, and of themselves): both belong to one motor's ratings.
_APART = 0.1

#: Largest number of the 16-bit torque objects.
HIGHEST_COUNTS = (1 << 15) - 1

ASSUMED_CURRENT_ACCURACY = 0.05
ASSUMED_SOURCE = "assumed, 5 % of rated: no drive profile states an accuracy; enter a calibration"


class Cia402Inverter(Cia402Driver, Inverter):
    """A CiA 402 drive by its node.

    Raises ReportedError where neither the drive nor the station says what a count of velocity or of current is.
    """

    def __init__(self, node: Cia402Node, clock: Clock, options: Cia402Options, *, name: str = "inverter") -> None:
        self._node = node
        self._objects = node.objects
        self._power = node.power
        self._clock = clock
        self._options = options
        self._name = name
        self._torque_mode: int | None = None
        if node.guarding:
            return
        self._rated_current = read_rated_current(node.objects, options.rated_current, options.current_scale)
        node.take_over()
        self._torque_mode = node.supported(PROFILE_TORQUE, CYCLIC_TORQUE)
        node.poll(
            (
                MappedObject(STATUSWORD, 2),
                MappedObject(self._velocity.actual, self._velocity.size, True),
                MappedObject(ACTUAL_TORQUE, 2, True),
            )
        )
        node.watch()

    @cached_property
    def _velocity(self) -> Velocity:
        """The unit of a count of velocity, asked at opening; a guardian asks where it measures the speed."""
        return open_velocity(
            self._objects,
            self._node.supported(*MODES),
            self._options.velocity_unit,
            increments=self._options.increments_per_turn,
            pole_pairs=self._options.pole_pairs,
        )

    @property
    def abilities(self) -> frozenset[InverterAbility]:
        """A frequency, and a q-axis current; what modes the drive has shows when they are commanded."""
        return ABILITIES

    @property
    def maximum_current(self) -> float:
        """Largest phase current (A, peak) that may be commanded: the station's limit."""
        return self._options.maximum_current

    @property
    def maximum_frequency(self) -> float:
        """Largest electrical frequency (Hz) that may be commanded: the station's limit."""
        return self._options.maximum_frequency

    @contextmanager
    def driving_frequency(self, frequency: float, current: float) -> Iterator[None]:
        """Turn the field at a frequency (Hz, sign is direction) with a phase current (A, peak); disabled at the end.

        Entered once the ramp has ended. Raises SetpointError before anything is sent, InstrumentError where the station states
        no object of that current, MeasurementError where the ramp does not end, ReportedError for a fault, an SDO abort, a limit
        of the drive's own, or a drive that does not switch off.
        """
        highest = self._options.maximum_frequency
        check_setpoint(self._name, "frequency", frequency, "Hz", -highest, highest, "the station")
        check_setpoint(self._name, "current", current, "A", 0.0, self._options.maximum_current, "the station")
        field, velocity = self._options.field_current, self._velocity
        if field is None or velocity.mode is None:
            raise self._unable_to_turn(velocity.mode is None)
        with always(self._node.disable, self._node.objects.calls):
            self._node.select(velocity.mode)
            velocity.check_limit(frequency)
            velocity.command(0.0)
            field.write(self._objects, current / (self._options.current_scale or 1.0))
            self._node.enable()
            velocity.command(frequency)
            tolerance = max(self._options.frequency_tolerance, 1.0 / velocity.counts)
            self._await(text("frequency"), "Hz", frequency, velocity.read, tolerance)
            yield

    @contextmanager
    def driving_current(self, current: float) -> Iterator[None]:
        """Regulate the q-axis current (A, peak) for the length of the block; disabled at the end.

        Raises SetpointError before anything is sent, MeasurementError where the current does not settle, ReportedError for a
        fault, an SDO abort, a limit of the drive's own, or a drive that does not switch off.
        """
        self._check_current(current)
        if self._torque_mode is None:
            raise InstrumentError(
                self._name,
                text("the drive has no mode that regulates its torque (0x6502): it cannot drive a commanded current"),
                remedy=text("Use another drive for this procedure"),
            )
        with always(self._node.disable, self._node.objects.calls):
            self._node.select(self._torque_mode)
            self._check_own_limits(current)
            self._objects.write(TARGET_TORQUE, 0, 0, 2)
            self._node.enable()
            self._command_current(current)
            yield

    def set_current(self, current: float) -> None:
        """Change the q-axis current (A, peak) inside a `driving_current` block and wait until it has settled.

        Raises SetpointError before anything is sent, MeasurementError where it does not settle, ReportedError as
        `driving_current`.
        """
        self._check_current(current)
        self._check_own_limits(current)
        self._command_current(current)

    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz) the drive puts out; raises ReportedError where it is in fault."""
        now = self._node.snapshot()
        self._power.check_fault(now)
        accuracy = self._options.frequency_accuracy or self._velocity.accuracy
        return Reading(self._velocity.read(now), "Hz", accuracy, self._clock.now())

    def measure_current(self) -> Reading:
        """Return the q-axis current (A, peak) as the drive reports it; raises ReportedError where it is in fault."""
        now = self._node.snapshot()
        self._power.check_fault(now)
        accuracy = self._options.current_accuracy or Accuracy(
            offset=ASSUMED_CURRENT_ACCURACY * self._rated_current,
            resolution=TORQUE_STEP * self._rated_current,
            source=ASSUMED_SOURCE,
        )
        return Reading(self._current(now), "A", accuracy, self._clock.now())

    def command_zero(self) -> None:
        """Command no torque and no velocity, whatever the drive does now; it stays enabled if it was.

        Raises ReportedError for an SDO abort, CommunicationError where the drive does not answer.
        """
        if self._node.guarding:
            self._command_zero_unasked()
            return
        try:
            if self._torque_mode is not None:
                self._objects.write(TARGET_TORQUE, 0, 0, 2)
        finally:
            if self._velocity.mode is not None:
                self._velocity.command(0.0)

    def _command_zero_unasked(self) -> None:
        """Command no torque and no velocity to a drive whose modes are not known: an object that it has not commands nothing."""
        try:
            self._objects.write_optional(TARGET_TORQUE, 0, 0, 2)
        finally:
            if not self._objects.write_optional(TARGET_VELOCITY, 0, 0, 4):
                self._objects.write_optional(VL_TARGET_VELOCITY, 0, 0, 2)

    def make_safe(self) -> None:
        """Go to Switch on disabled and make sure of it; raises ReportedError naming a fault that was found."""
        self._node.disable()

    def _unable_to_turn(self, without_mode: bool) -> InstrumentError:
        if without_mode:
            return InstrumentError(
                self._name,
                text("the drive has no velocity mode (0x6502): it cannot turn at a commanded frequency"),
                remedy=text("Use another drive for this procedure"),
            )
        return InstrumentError(
            self._name,
            text("a drive that regulates its speed supplies the current that its load takes, not a commanded one"),
            remedy=text(
                "State field_current, the object of the phase current in the drive's open-loop mode, where it has one; "
                "use another inverter otherwise"
            ),
        )

    def _check_current(self, current: float) -> None:
        highest = min(self._options.maximum_current, HIGHEST_COUNTS * TORQUE_STEP * self._rated_current)
        check_setpoint(self._name, "current", current, "A", -highest, highest, "the station")

    def _check_own_limits(self, current: float) -> None:
        for index in (MAX_TORQUE, MAX_CURRENT):
            limit = self._objects.read_optional(index, 0, 2)
            if limit is not None and limit < abs(self._torque_counts(current)):
                raise ReportedError(
                    self._name,
                    text(
                        "the drive's own limit {object} is {limit} ‰ of rated ({current:g} A), below the current asked for",
                        object=f"0x{index:04X}",
                        limit=limit,
                        current=limit * TORQUE_STEP * self._rated_current,
                    ),
                    remedy=text("Raise it in the drive's set-up, or ask for less"),
                )

    def _torque_counts(self, current: float) -> int:
        return round(current / self._rated_current / TORQUE_STEP)

    def _command_current(self, current: float) -> None:
        self._objects.write(TARGET_TORQUE, 0, self._torque_counts(current), 2, signed=True)
        tolerance = self._options.current_tolerance * self._rated_current
        self._await(text("current"), "A", current, self._current, tolerance)
        self._check_ratings()

    def _check_ratings(self) -> None:
        """Refuse a torque whose thousandths are not those of the current: rated torque and current of two motors."""
        current = self._objects.read_optional(ACTUAL_CURRENT, 0, 2, signed=True)
        torque = self._objects.read(ACTUAL_TORQUE, 0, 2, signed=True)
        if current is not None and abs(abs(current) - abs(torque)) > _APART * (1.0 / TORQUE_STEP + abs(torque)):
            raise MeasurementError(
                self._name,
                text(
                    "torque (0x6077, {torque} ‰) and current (0x6078, {current} ‰) differ: rated torque 0x6076 and rated current "
                    "0x6075 are not of one motor",
                    torque=torque,
                    current=current,
                ),
                remedy=text("Correct the drive's set-up"),
            )

    def _current(self, source: ObjectReader) -> float:
        return source.read(ACTUAL_TORQUE, 0, 2, signed=True) * TORQUE_STEP * self._rated_current

    def _await(
        self, what: Text, unit: str, target: float, read: Callable[[ObjectReader], float], tolerance: float
    ) -> None:
        ramp = OwnRamp(self._clock, self._options.settle_timeout, self._options.poll_interval)
        for _ in ramp.polls():
            if abs((found := read(now := self._node.snapshot())) - target) <= tolerance:
                break
            last = ramp.stalled(abs(found - target))
            limited = self._power.check_operation(now, at_last=last) & INTERNAL_LIMIT
            if last:
                raise MeasurementError(
                    self._name,
                    text(
                        "the {what} is {found:g} {unit} {elapsed:.3g} s after {target:g} {unit} was commanded, and comes no nearer",
                        what=what,
                        found=found,
                        unit=unit,
                        elapsed=ramp.elapsed,
                        target=target,
                    ),
                    remedy=text("The drive's own limits act (bit 11 of 0x6041): see 0x6072, 0x6073, 0x607F, 0x6080")
                    if limited
                    else "",
                )
