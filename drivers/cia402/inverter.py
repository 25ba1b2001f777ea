"""Inverter with the CiA 402 drive profile over CANopen."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from drivers.bases.always import always
from drivers.bases.set_points import check_setpoint
from drivers.catalogue import Surroundings
from drivers.cia402.node import VELOCITY_COUNTS, Cia402Node
from drivers.cia402.opening import open_node
from drivers.cia402.options import Cia402Options
from drivers.interfaces import Accuracy, Clock, Identity, Inverter, MeasurementError, Reading, ReportedError, Watchdog
from drivers.interfaces.text import Text, text

#: Objects of CiA 402; the phase current of the open-loop mode is the maker's.
PHASE_CURRENT = 0x2000
TARGET_VELOCITY = 0x60FF
TARGET_TORQUE, RATED_CURRENT, ACTUAL_TORQUE = 0x6071, 0x6075, 0x6077

PROFILE_VELOCITY, PROFILE_TORQUE = 3, 4
#: Torque and current per mille of rated, currents in mA.
TORQUE_STEP, CURRENT_STEP = 1e-3, 1e-3

#: Largest number of the 16-bit torque objects.
HIGHEST_COUNTS = (1 << 15) - 1

ASSUMED_CURRENT_ACCURACY = 0.05
ASSUMED_SOURCE = "assumed, 5 % of rated: no drive profile states an accuracy; enter a calibration"


class Cia402Inverter(Inverter):
    """A CiA 402 drive by its node. Raises ReportedError where it states no rated current."""

    def __init__(self, node: Cia402Node, clock: Clock, options: Cia402Options, *, name: str = "inverter") -> None:
        self._node = node
        self._objects = objects = node.objects
        self._power = node.power
        self._clock = clock
        self._options = options
        self._name = name
        if node.guarding:
            return
        rated = objects.read(RATED_CURRENT, 0, 4) * CURRENT_STEP
        if rated <= 0:
            raise ReportedError(
                name, text("rated current (0x6075) is 0"), remedy=text("Set up the drive for its motor first")
            )
        self._rated_current = rated * options.current_scale
        node.watch()

    @classmethod
    def open(cls, address: str, options: Cia402Options, surroundings: Surroundings, name: str) -> "Cia402Inverter":
        """Open the node at a CAN address; raises what `open_node` raises."""
        return open_node(cls, address, options, surroundings, name)

    @property
    def identity(self) -> Identity:
        """Vendor and product of 0x1018, with the device's name."""
        return self._node.identity

    @property
    def watchdog(self) -> Watchdog | None:
        """The drive's heartbeat consumer, as it was armed and read back."""
        return self._node.watchdog

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

        Entered once the ramp has ended. Raises SetpointError before anything is sent, MeasurementError where the
        ramp does not end, ReportedError for a fault, an SDO abort, or a drive that does not switch off.
        """
        highest = self._options.maximum_frequency
        check_setpoint(self._name, "frequency", frequency, "Hz", -highest, highest, "the station")
        check_setpoint(self._name, "current", current, "A", 0.0, self._options.maximum_current, "the station")
        with always(self._node.disable, self._node.objects.calls):
            self._node.select(PROFILE_VELOCITY)
            self._objects.write(TARGET_VELOCITY, 0, 0, 4)
            amplitude = round(current / self._options.current_scale / CURRENT_STEP)
            self._objects.write(PHASE_CURRENT, 0, amplitude, 4)
            self._power.enable()
            self._objects.write(TARGET_VELOCITY, 0, round(frequency * VELOCITY_COUNTS), 4, signed=True)
            self._await(text("frequency"), "Hz", frequency, self._node.frequency, self._options.frequency_tolerance)
            yield

    @contextmanager
    def driving_current(self, current: float) -> Iterator[None]:
        """Regulate the q-axis current (A, peak) for the length of the block; disabled at the end.

        Raises SetpointError before anything is sent, MeasurementError where the current does not settle,
        ReportedError for a fault, an SDO abort, or a drive that does not switch off.
        """
        self._check_current(current)
        with always(self._node.disable, self._node.objects.calls):
            self._node.select(PROFILE_TORQUE)
            self._objects.write(TARGET_TORQUE, 0, 0, 2)
            self._power.enable()
            self._command_current(current)
            yield

    def set_current(self, current: float) -> None:
        """Change the q-axis current (A, peak) inside a `driving_current` block and wait until it has settled.

        Raises SetpointError before anything is sent, MeasurementError where it does not settle.
        """
        self._check_current(current)
        self._command_current(current)

    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz) the drive puts out; raises ReportedError where it is in fault."""
        self._power.check_fault()
        accuracy = self._options.frequency_accuracy or Accuracy(
            resolution=1 / VELOCITY_COUNTS, source="one count of 0x606C; frequency of the drive's own quartz"
        )
        return Reading(self._node.frequency(), "Hz", accuracy, self._clock.now())

    def measure_current(self) -> Reading:
        """Return the q-axis current (A, peak) as the drive reports it; raises ReportedError where it is in fault."""
        self._power.check_fault()
        accuracy = self._options.current_accuracy or Accuracy(
            offset=ASSUMED_CURRENT_ACCURACY * self._rated_current,
            resolution=TORQUE_STEP * self._rated_current,
            source=ASSUMED_SOURCE,
        )
        return Reading(self._current(), "A", accuracy, self._clock.now())

    def command_zero(self) -> None:
        """Command no torque and no velocity, whatever the drive does now; it stays enabled if it was.

        Raises ReportedError for an SDO abort, CommunicationError where the drive does not answer.
        """
        try:
            self._objects.write(TARGET_TORQUE, 0, 0, 2)
        finally:
            self._objects.write(TARGET_VELOCITY, 0, 0, 4)

    def make_safe(self) -> None:
        """Go to Switch on disabled and make sure of it; raises ReportedError naming a fault that was found."""
        self._node.disable()

    def close(self) -> None:
        """Leave the bus; may be called twice."""
        self._node.close()

    def _check_current(self, current: float) -> None:
        highest = min(self._options.maximum_current, HIGHEST_COUNTS * TORQUE_STEP * self._rated_current)
        check_setpoint(self._name, "current", current, "A", -highest, highest, "the station")

    def _command_current(self, current: float) -> None:
        counts = round(current / self._rated_current / TORQUE_STEP)
        self._objects.write(TARGET_TORQUE, 0, counts, 2, signed=True)
        tolerance = self._options.current_tolerance * self._rated_current
        self._await(text("current"), "A", current, self._current, tolerance)

    def _current(self) -> float:
        return self._objects.read(ACTUAL_TORQUE, 0, 2, signed=True) * TORQUE_STEP * self._rated_current

    def _await(self, what: Text, unit: str, target: float, read: Callable[[], float], tolerance: float) -> None:
        deadline = self._clock.now() + self._options.settle_timeout
        while abs((found := read()) - target) > tolerance:
            self._power.check_fault()
            if self._clock.now() >= deadline:
                raise MeasurementError(
                    self._name,
                    text(
                        "the {what} is {found:g} {unit} {settle_timeout:g} s after {target:g} {unit} was commanded",
                        what=what,
                        found=found,
                        unit=unit,
                        settle_timeout=self._options.settle_timeout,
                        target=target,
                    ),
                )
            self._clock.sleep(self._options.poll_interval)
