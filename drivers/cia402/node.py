"""What every drive with the CiA 402 profile is made of: identity, power states, mode, watchdog, and its end."""

from typing import Protocol

from drivers.bases.identification import check_serial_number
from drivers.cia402.options import PROFILE, NodeOptions
from drivers.cia402.power_state import PowerState, PowerStateMachine, UnreachedStateError
from drivers.cia402.watchdog import HeartbeatWatchdog
from drivers.interfaces import UNWATCHED, Calls, Clock, CommunicationError, Identity, IdentityError, Traffic, Watchdog
from drivers.interfaces.text import text
from drivers.transport.can.objects import NodeObjects, SdoClient

#: Objects (CiA 301 below 0x2000, CiA 402 from 0x6000).
DEVICE_TYPE, DEVICE_NAME, IDENTITY = 0x1000, 0x1008, 0x1018
MODE, MODE_DISPLAY = 0x6060, 0x6061
ACTUAL_VELOCITY = 0x606C

#: The low half of the device type says which profile.
#: Counts of a velocity in one Hz (electrical).
VELOCITY_COUNTS = 100


class BusConnection(Protocol):
    """The way to the bus: renewed after an error, let go of at the end."""

    def reopen(self) -> None:
        """Connect to the bus anew; raises CommunicationError where that fails."""

    def start_heartbeat(self, producer: int, period: float) -> None:
        """Send heartbeats of node `producer` every `period` (s)."""

    def start_node(self) -> None:
        """Have the node be operational (NMT start)."""

    def disconnect(self) -> None:
        """Leave the bus; may be called twice."""


class Cia402Node:
    """A drive by its node's SDO client; the node is identified when this is made, unless it is held for the shutdown only
    (`guarding`).

    A drive has one SDO channel: a second client that asked beside the first would spoil its replies.
    Raises IdentityError where the node is no drive or another one, CommunicationError where it does not answer.
    """

    def __init__(
        self,
        client: SdoClient,
        clock: Clock,
        options: NodeOptions,
        *,
        name: str,
        traffic: Traffic | None = None,
        calls: Calls = UNWATCHED,
        connection: BusConnection | None = None,
        guarding: bool = False,
    ) -> None:
        self.objects = NodeObjects(client, name, traffic=traffic, calls=calls)
        self.power = PowerStateMachine(
            self.objects, clock, timeout=options.transition_timeout, poll_interval=options.poll_interval
        )
        self.guarding = guarding
        self._clock = clock
        self._options = options
        self._name = name
        self._connection = connection
        self._watchdog = HeartbeatWatchdog(self.objects)
        self.identity = Identity("", "") if guarding else self._identify()
        if connection is not None and not guarding:
            # A node in pre-operational may refuse to be enabled; which state it is in no object tells, so it is not put back.
            connection.start_node()

    @property
    def watchdog(self) -> Watchdog | None:
        """The drive's watch over this process, as it was armed and read back."""
        return self._watchdog.armed

    def watch(self) -> None:
        """Arm the drive's watch over this process where the station asks for it and the drive has one.

        Raises SetpointError for a time that cannot be, ReportedError where the drive refuses.
        """
        if self._options.heartbeat_time and self._connection is not None:
            self._watchdog.arm(self._options.heartbeat_time, self._options.heartbeat_node, self._connection)

    def select(self, mode: int) -> None:
        """Set the mode of operation with the power off.

        Raises ReportedError for a fault, UnreachedStateError where the drive shows another mode.
        """
        if self.power.check_fault() is not PowerState.SWITCH_ON_DISABLED:
            self.power.disable()
        self.objects.write(MODE, 0, mode, 1, signed=True)
        deadline = self._clock.now() + self._options.transition_timeout
        while (found := self.objects.read(MODE_DISPLAY, 0, 1, signed=True)) != mode:
            if self._clock.now() >= deadline:
                raise UnreachedStateError(
                    self._name, text("stays in mode {found} (0x6061)", found=found), command=f"0x6060 = {mode}"
                )
            self._clock.sleep(self._options.poll_interval)

    def frequency(self) -> float:
        """Return the electrical frequency (Hz) by the velocity actual value."""
        # Division keeps decimal counts exact: 5376 counts are 53.76 Hz.
        return self.objects.read(ACTUAL_VELOCITY, 0, 4, signed=True) / VELOCITY_COUNTS

    def disable(self) -> None:
        """Go to Switch on disabled and make sure of it, over a renewed connection where the present one fails.

        Raises ReportedError naming a fault that was found or a state that is kept.
        """
        try:
            self.power.disable()
        except CommunicationError:
            # A lost frame or a bus that went down must not leave the bridge on.
            if self._connection is not None:
                self._connection.reopen()
            self.power.disable()

    def close(self) -> None:
        """End the watch and leave the bus; may be called twice."""
        if self._connection is not None:
            self._watchdog.disarm_if_reachable()
            self._connection.disconnect()
            self._connection = None

    def _identify(self) -> Identity:
        device_type = self.objects.read(DEVICE_TYPE, 0, 4)
        if not PROFILE.matches(device_type):
            raise IdentityError(
                self._name,
                text(
                    "the node's device type is 0x{device_type:08X}, expected profile 402 (0x....0192)",
                    device_type=device_type,
                ),
                command="read 0x1000:00",
                remedy=text("Correct the node id in the station file"),
            )
        vendor, product, revision, serial = (self.objects.read(IDENTITY, sub, 4) for sub in (1, 2, 3, 4))
        model = self.objects.read_text(DEVICE_NAME, 0)
        identity = Identity(f"vendor 0x{vendor:08X}", model or f"product 0x{product:08X}", str(serial), f"{revision:X}")
        check_serial_number(self._name, identity, self._options.serial_number, "read 0x1018:04")
        return identity
