"""Inverter with the CiA 402 drive profile over CANopen."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Protocol
from urllib.parse import parse_qs, urlsplit

import can
import canopen

from drivers.can_bus.objects import NodeObjects, SdoClient
from drivers.can_bus.options import Cia402Options
from drivers.can_bus.power_state import PowerStateMachine
from drivers.interfaces import (
    Accuracy,
    Clock,
    CommunicationError,
    Identity,
    IdentityError,
    MeasurementError,
    Reading,
    ReportedError,
    Traffic,
)
from drivers.limits import check_setpoint
from drivers.safety import always

#: Objects (CiA 301 below 0x2000, CiA 402 from 0x6000); the phase current of the open-loop mode is the maker's.
DEVICE_TYPE, DEVICE_NAME, IDENTITY = 0x1000, 0x1008, 0x1018
PHASE_CURRENT = 0x2000
MODE, MODE_DISPLAY = 0x6060, 0x6061
ACTUAL_VELOCITY, TARGET_VELOCITY = 0x606C, 0x60FF
TARGET_TORQUE, RATED_CURRENT, ACTUAL_TORQUE = 0x6071, 0x6075, 0x6077

#: The low half of the device type says which profile.
DRIVE_PROFILE = 0x0192
PROFILE_VELOCITY, PROFILE_TORQUE = 3, 4
#: Velocity in 0.01 Hz (electrical), torque and current per mille of rated, currents in mA.
VELOCITY_STEP, TORQUE_STEP, CURRENT_STEP = 0.01, 1e-3, 1e-3

#: Largest number of the 16-bit torque objects.
HIGHEST_COUNTS = (1 << 15) - 1

#: How long (s) the listening thread waits for a frame before it looks whether it should end; a second by default.
LISTENING_TIME = 0.05

ASSUMED_CURRENT_ACCURACY = 0.05
ASSUMED_SOURCE = "assumed, 5 % of rated: no drive profile states an accuracy; enter a calibration"


class Connection(Protocol):
    """What is let go of at the end: a canopen network."""

    def disconnect(self) -> None:
        """Leave the bus."""


class Cia402Inverter:
    """A CiA 402 drive by its node's SDO client; the node is identified when this is made.

    Raises IdentityError where the node is no drive or another one, CommunicationError where it does not answer.
    """

    def __init__(
        self,
        client: SdoClient,
        clock: Clock,
        options: Cia402Options,
        *,
        name: str = "inverter",
        traffic: Traffic | None = None,
        connection: Connection | None = None,
    ) -> None:
        self._objects = objects = NodeObjects(client, name, traffic=traffic)
        self._clock = clock
        self._options = options
        self._name = name
        self._connection = connection
        self._power = PowerStateMachine(
            objects, clock, timeout=options.transition_timeout, poll_interval=options.poll_interval
        )
        self._identity = self._identify()
        rated = objects.read(RATED_CURRENT, 0, 4) * CURRENT_STEP
        if rated <= 0:
            raise ReportedError(name, "rated current (0x6075) is 0", remedy="Set up the drive for its motor first")
        self._rated_current = rated * options.current_scale

    @property
    def identity(self) -> Identity:
        """Vendor and product of 0x1018, with the device's name."""
        return self._identity

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
        with always(self._power.disable):
            self._select(PROFILE_VELOCITY)
            self._objects.write(TARGET_VELOCITY, 0, 0, 4, signed=True)
            amplitude = round(current / self._options.current_scale / CURRENT_STEP)
            self._objects.write(PHASE_CURRENT, 0, amplitude, 4)
            self._power.enable()
            self._objects.write(TARGET_VELOCITY, 0, round(frequency / VELOCITY_STEP), 4, signed=True)
            self._await("frequency", "Hz", frequency, self._frequency, self._options.frequency_tolerance)
            yield

    @contextmanager
    def driving_current(self, current: float) -> Iterator[None]:
        """Regulate the q-axis current (A, peak) for the length of the block; disabled at the end.

        Raises SetpointError before anything is sent, MeasurementError where the current does not settle,
        ReportedError for a fault, an SDO abort, or a drive that does not switch off.
        """
        self._check_current(current)
        with always(self._power.disable):
            self._select(PROFILE_TORQUE)
            self._objects.write(TARGET_TORQUE, 0, 0, 2, signed=True)
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
            resolution=VELOCITY_STEP, source="one count of 0x606C; frequency of the drive's own quartz"
        )
        return Reading(self._frequency(), "Hz", accuracy, self._clock.now())

    def measure_current(self) -> Reading:
        """Return the q-axis current (A, peak) as the drive reports it; raises ReportedError where it is in fault."""
        self._power.check_fault()
        accuracy = self._options.current_accuracy or Accuracy(
            offset=ASSUMED_CURRENT_ACCURACY * self._rated_current,
            resolution=TORQUE_STEP * self._rated_current,
            source=ASSUMED_SOURCE,
        )
        return Reading(self._current(), "A", accuracy, self._clock.now())

    def make_safe(self) -> None:
        """Go to Switch on disabled and make sure of it; raises ReportedError naming a fault that was found."""
        self._power.disable()

    def close(self) -> None:
        """Leave the bus; may be called twice."""
        if self._connection is not None:
            self._connection.disconnect()
            self._connection = None

    def _identify(self) -> Identity:
        device_type = self._objects.read(DEVICE_TYPE, 0, 4)
        if device_type & 0xFFFF != DRIVE_PROFILE:
            raise IdentityError(
                self._name,
                f"the node's device type is 0x{device_type:08X}, expected profile 402 (0x....0192)",
                command="read 0x1000:00",
                remedy="Correct the node id in the station file",
            )
        vendor, product, revision, serial = (self._objects.read(IDENTITY, sub, 4) for sub in (1, 2, 3, 4))
        model = self._objects.read_text(DEVICE_NAME, 0)
        identity = Identity(f"vendor 0x{vendor:08X}", model or f"product 0x{product:08X}", str(serial), f"{revision:X}")
        wanted = self._options.serial_number
        if wanted is not None and identity.serial_number != wanted:
            raise IdentityError(
                self._name,
                f"serial number {identity.serial_number} answers, expected {wanted}",
                command="read 0x1018:04",
                remedy="Correct the serial number, and the calibration with it, in the station file",
            )
        return identity

    def _select(self, mode: int) -> None:
        self._power.check_fault()
        self._objects.write(MODE, 0, mode, 1, signed=True)
        deadline = self._clock.now() + self._options.transition_timeout
        while (found := self._objects.read(MODE_DISPLAY, 0, 1, signed=True)) != mode:
            if self._clock.now() >= deadline:
                raise ReportedError(self._name, f"stays in mode {found} (0x6061)", command=f"0x6060 = {mode}")
            self._clock.sleep(self._options.poll_interval)

    def _check_current(self, current: float) -> None:
        highest = min(self._options.maximum_current, HIGHEST_COUNTS * TORQUE_STEP * self._rated_current)
        check_setpoint(self._name, "current", current, "A", -highest, highest, "the station")

    def _command_current(self, current: float) -> None:
        counts = round(current / self._rated_current / TORQUE_STEP)
        self._objects.write(TARGET_TORQUE, 0, counts, 2, signed=True)
        tolerance = self._options.current_tolerance * self._rated_current
        self._await("current", "A", current, self._current, tolerance)

    def _frequency(self) -> float:
        # Division keeps decimal counts exact: 5376 counts are 53.76 Hz.
        return self._objects.read(ACTUAL_VELOCITY, 0, 4, signed=True) / round(1 / VELOCITY_STEP)

    def _current(self) -> float:
        return self._objects.read(ACTUAL_TORQUE, 0, 2, signed=True) * TORQUE_STEP * self._rated_current

    def _await(self, what: str, unit: str, target: float, read: Callable[[], float], tolerance: float) -> None:
        deadline = self._clock.now() + self._options.settle_timeout
        while abs((found := read()) - target) > tolerance:
            self._power.check_fault()
            if self._clock.now() >= deadline:
                raise MeasurementError(
                    self._name,
                    f"the {what} is {found:g} {unit} {self._options.settle_timeout:g} s after {target:g} {unit} "
                    "was commanded",
                )
            self._clock.sleep(self._options.poll_interval)


def open_cia402_inverter(
    address: str, clock: Clock, options: Cia402Options, *, name: str = "inverter", traffic: Traffic | None = None
) -> Cia402Inverter:
    """Open a node at `can://interface/channel?node=5&bitrate=500000`, the interface as python-can names it.

    Raises CommunicationError where the bus cannot be opened or the node does not answer, IdentityError where it is
    another one.
    """
    interface, channel, node_id, bitrate = parse_address(address, name)
    network = canopen.Network()
    network.NOTIFIER_CYCLE = LISTENING_TIME
    try:
        network.connect(interface=interface, channel=channel, bitrate=bitrate)
    except (can.CanError, OSError, ValueError, ImportError) as error:
        network.disconnect()
        raise CommunicationError(
            name, f"cannot be opened at {address} ({error})", remedy="Check interface, channel and bit rate"
        ) from error
    try:
        node = network.add_node(node_id, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        return Cia402Inverter(node.sdo, clock, options, name=name, traffic=traffic, connection=network)
    except BaseException:
        network.disconnect()
        raise


def parse_address(address: str, name: str) -> tuple[str, str, int, int]:
    """Return interface, channel, node id and bit rate of a `can://` address; raises CommunicationError otherwise."""
    parts = urlsplit(address)
    settings = {key: values[-1] for key, values in parse_qs(parts.query).items()}
    try:
        node_id, bitrate = int(settings["node"]), int(settings.get("bitrate", "500000"))
    except (KeyError, ValueError):
        node_id = bitrate = 0
    channel = parts.path.removeprefix("/")
    if parts.scheme != "can" or not parts.netloc or not channel or not 1 <= node_id <= 127:
        raise CommunicationError(
            name,
            f"'{address}' is no CAN address",
            remedy="Write can://interface/channel?node=1…127&bitrate=500000",
        )
    return parts.netloc, channel, node_id, bitrate
