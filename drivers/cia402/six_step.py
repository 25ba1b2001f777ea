"""Six-step drive with the CiA 402 profile over CANopen: block commutation by Hall sensors in a maker's mode."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from functools import cached_property
from typing import TypeVar

from drivers.bases.always import always
from drivers.cia402.node import Cia402Node
from drivers.cia402.opening import Cia402Driver
from drivers.cia402.options import Cia402SixStepOptions
from drivers.cia402.power_state import STATUSWORD, ObjectReader, UnreachedStateError
from drivers.cia402.stated_objects import StatedObject
from drivers.cia402.velocity import Velocity, open_velocity
from drivers.interfaces import Accuracy, BldcDrive, Clock, MeasurementError, Reading, ReportedError
from drivers.interfaces.text import text
from drivers.transport.can.process_data import MappedObject

T = TypeVar("T")

#: DC link voltage of the profile, and its counts in one V.
BUS_VOLTAGE, MILLI = 0x6079, 1000

#: What stands for an accuracy that is not stated: 1 % of the voltage; 2 % of the current and 20 mA of zero error.
ASSUMED_VOLTAGE = Accuracy(
    gain=0.01,
    resolution=1 / MILLI,
    source="assumed, 1 % of reading: no drive profile states an accuracy; enter a calibration",
)
ASSUMED_CURRENT = Accuracy(
    gain=0.02,
    offset=0.02,
    source="assumed, 2 % of reading + 20 mA: no drive profile states an accuracy; enter a calibration",
)


class Cia402SixStep(Cia402Driver, BldcDrive):
    """A six-step drive by its node; what is the maker's own of it, the station states.

    Raises ReportedError where neither says what a count of velocity is, or which mode commutates in blocks.
    """

    def __init__(self, node: Cia402Node, clock: Clock, options: Cia402SixStepOptions, *, name: str = "drive") -> None:
        self._node = node
        self._clock = clock
        self._options = options
        self._name = name
        self._commutating = False
        if node.guarding:
            return
        self._mode: int = self._stated("mode", options.mode)
        self._bus_current: StatedObject = self._stated("bus_current", options.bus_current)
        self._hall_state: StatedObject = self._stated("hall_state", options.hall_state)
        node.take_over()
        velocity = MappedObject(self._velocity.actual, self._velocity.size, True)
        node.poll((MappedObject(STATUSWORD, 2), velocity), (MappedObject(BUS_VOLTAGE, 4),))
        node.watch()

    @cached_property
    def _velocity(self) -> Velocity:
        """The unit of a count of velocity, asked at opening; a guardian asks where it measures the speed."""
        return open_velocity(
            self._node.objects,
            None,
            self._options.velocity_unit,
            increments=self._options.increments_per_turn,
            pole_pairs=self._options.pole_pairs,
        )

    @contextmanager
    def running(self) -> Iterator[None]:
        """Commutate the motor at full voltage for the length of the block; at its end the bridge is off, confirmed.

        Raises ReportedError for a fault, an SDO abort, or a bridge that does not switch off, MeasurementError where
        the drive does not reach operation.
        """
        with always(self._node.disable, self._node.objects.calls):
            try:
                self._node.select(self._mode)
                self._node.enable()
            except UnreachedStateError as error:
                raise MeasurementError(
                    self._name,
                    text("does not reach operation: {what}", what=error.what),
                    command=error.command,
                    remedy=text("Check the DC source, the drive's enable input and its Hall sensors"),
                ) from error
            self._commutating = True
            try:
                yield
            finally:
                self._commutating = False

    def measure_bus_voltage(self) -> Reading:
        """Return the mean voltage (V) of the DC link over 20 ms; raises ReportedError where the drive is in fault or has stopped."""
        now = self._node.snapshot()
        self._check_power(now)
        value = now.read(BUS_VOLTAGE, 0, 4) / MILLI
        return Reading(value, "V", self._options.voltage_accuracy or ASSUMED_VOLTAGE, self._clock.now())

    def measure_bus_current(self) -> Reading:
        """Return the mean current (A) out of the DC source over 20 ms; raises ReportedError where it is in fault or has stopped."""
        self._check_power()
        value = self._bus_current.read(self._node.objects)
        accuracy = self._options.current_accuracy or replace(ASSUMED_CURRENT, resolution=self._bus_current.scale)
        return Reading(value, "A", accuracy, self._clock.now())

    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz) from the Hall signals' edges; raises ReportedError for a fault or a stop."""
        now = self._node.snapshot()
        self._check_power(now)
        accuracy = self._options.frequency_accuracy or self._velocity.accuracy
        return Reading(self._velocity.read(now), "Hz", accuracy, self._clock.now())

    def _check_power(self, source: ObjectReader | None = None) -> None:
        """Raise ReportedError where the drive is in fault, or has left operation while it is to commutate."""
        power = self._node.power
        if self._commutating:
            power.check_operation(source, at_last=True)
        else:
            power.check_fault(source)

    def hall_state(self) -> tuple[bool, bool, bool]:
        """Return the three Hall signals now."""
        bits = round(self._hall_state.read(self._node.objects))
        return bool(bits & 1), bool(bits & 2), bool(bits & 4)

    def make_safe(self) -> None:
        """Switch the bridge off and make sure of it; raises ReportedError naming a fault that was found."""
        self._node.disable()

    def _stated(self, key: str, value: T | None) -> T:
        if value is None:
            raise ReportedError(
                self._name,
                text(
                    "no drive profile defines block commutation at full voltage, and the station file does not "
                    "state {key}",
                    key=key,
                ),
                remedy=text(
                    "State mode, bus_current and hall_state in the station file, as the drive's manual has them"
                ),
            )
        return value
