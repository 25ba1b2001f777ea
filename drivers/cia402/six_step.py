"""Six-step drive with the CiA 402 profile over CANopen: block commutation by Hall sensors in a maker's mode."""

from collections.abc import Iterator
from contextlib import contextmanager

from drivers.bases.always import always
from drivers.catalogue import Surroundings
from drivers.cia402.node import VELOCITY_COUNTS, Cia402Node
from drivers.cia402.opening import open_node
from drivers.cia402.options import Cia402SixStepOptions
from drivers.cia402.power_state import UnreachedStateError
from drivers.interfaces import Accuracy, BldcDrive, Clock, Identity, MeasurementError, Reading, Watchdog
from drivers.interfaces.text import text

#: DC link voltage is the profile's (mV), the other two are the maker's (mA; bits 0 … 2 are H1 … H3).
BUS_VOLTAGE, BUS_CURRENT, HALL_STATE = 0x6079, 0x2010, 0x2011
#: The maker's mode of full-voltage block commutation.
BLOCK_COMMUTATION = -1
#: Counts in one V and one A.
MILLI = 1000

#: What stands for an accuracy that is not stated: 1 % of the voltage; 2 % of the current and 20 mA of zero error.
ASSUMED_VOLTAGE = Accuracy(
    gain=0.01,
    resolution=1 / MILLI,
    source="assumed, 1 % of reading: no drive profile states an accuracy; enter a calibration",
)
ASSUMED_CURRENT = Accuracy(
    gain=0.02,
    offset=0.02,
    resolution=1 / MILLI,
    source="assumed, 2 % of reading + 20 mA: no drive profile states an accuracy; enter a calibration",
)
FREQUENCY_OF_HALL_EDGES = Accuracy(
    resolution=1 / VELOCITY_COUNTS, source="one count of 0x606C; frequency of the drive's own quartz"
)


class Cia402SixStep(BldcDrive):
    """A six-step drive by its node."""

    def __init__(self, node: Cia402Node, clock: Clock, options: Cia402SixStepOptions, *, name: str = "drive") -> None:
        self._node = node
        self._clock = clock
        self._options = options
        self._name = name
        if not node.guarding:
            node.watch()

    @classmethod
    def open(
        cls, address: str, options: Cia402SixStepOptions, surroundings: Surroundings, name: str
    ) -> "Cia402SixStep":
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

    @contextmanager
    def running(self) -> Iterator[None]:
        """Commutate the motor at full voltage for the length of the block; at its end the bridge is off, confirmed.

        Raises ReportedError for a fault, an SDO abort, or a bridge that does not switch off, MeasurementError where
        the drive does not reach operation.
        """
        with always(self._node.disable, self._node.objects.calls):
            try:
                self._node.select(BLOCK_COMMUTATION)
                self._node.power.enable()
            except UnreachedStateError as error:
                raise MeasurementError(
                    self._name,
                    text("does not reach operation: {what}", what=error.what),
                    command=error.command,
                    remedy=text("Check the DC source, the drive's enable input and its Hall sensors"),
                ) from error
            yield

    def measure_bus_voltage(self) -> Reading:
        """Return the mean voltage (V) of the DC link over 20 ms; raises ReportedError where the drive is in fault."""
        self._node.power.check_fault()
        value = self._node.objects.read(BUS_VOLTAGE, 0, 4) / MILLI
        return Reading(value, "V", self._options.voltage_accuracy or ASSUMED_VOLTAGE, self._clock.now())

    def measure_bus_current(self) -> Reading:
        """Return the mean current (A) out of the DC source over 20 ms; raises ReportedError where it is in fault."""
        self._node.power.check_fault()
        value = self._node.objects.read(BUS_CURRENT, 0, 4, signed=True) / MILLI
        return Reading(value, "A", self._options.current_accuracy or ASSUMED_CURRENT, self._clock.now())

    def measure_frequency(self) -> Reading:
        """Return the electrical frequency (Hz) from the Hall signals' edges; raises ReportedError for a fault."""
        self._node.power.check_fault()
        accuracy = self._options.frequency_accuracy or FREQUENCY_OF_HALL_EDGES
        return Reading(self._node.frequency(), "Hz", accuracy, self._clock.now())

    def hall_state(self) -> tuple[bool, bool, bool]:
        """Return the three Hall signals now."""
        bits = self._node.objects.read(HALL_STATE, 0, 1)
        return bool(bits & 1), bool(bits & 2), bool(bits & 4)

    def make_safe(self) -> None:
        """Switch the bridge off and make sure of it; raises ReportedError naming a fault that was found."""
        self._node.disable()

    def close(self) -> None:
        """Leave the bus; may be called twice."""
        self._node.close()
