"""Base of every drive with the CiA 402 profile: identity, found state, power states, mode, watchdog, and its end."""

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Protocol

from drivers.bases.identification import check_serial_number
from drivers.cia402.found_objects import FoundObjects, found_nmt_state, polled_by
from drivers.cia402.node_identity import read_identity
from drivers.cia402.options import PROFILE, NodeOptions
from drivers.cia402.power_state import PowerState, PowerStateMachine, UnreachedStateError
from drivers.cia402.watchdog import HeartbeatWatchdog
from drivers.interfaces import (
    UNWATCHED,
    Calls,
    Clock,
    CommunicationError,
    Identity,
    IdentityError,
    InstrumentError,
    Traffic,
    Watchdog,
    polls,
)
from drivers.interfaces.found_state import FoundSetting
from drivers.interfaces.text import text
from drivers.transport.can.network_management import Emergency, NmtState
from drivers.transport.can.objects import NodeObjects, SdoClient
from drivers.transport.can.process_data import MappedObject, ProcessData

#: Objects (CiA 301 below 0x2000, CiA 402 from 0x6000).
DEVICE_TYPE = 0x1000
MODE, MODE_DISPLAY = 0x6060, 0x6061
SUPPORTED_MODES = 0x6502
GUARD_TIME, LIFE_TIME_FACTOR = 0x100C, 0x100D


class BusConnection(Protocol):
    """The connection to the bus: renewed after an error, closed at the end."""

    def reopen(self) -> None:
        """Connect to the bus anew; raises CommunicationError where that fails."""

    def start_heartbeat(self, producer: int, period: float) -> None:
        """Send heartbeats of node `producer` every `period` (s)."""

    @property
    def nmt_state(self) -> NmtState | None:
        """The node's state by what it has said last, None where it has said nothing."""

    def ask_nmt_state(self) -> None:
        """Ask the node for its state by node guarding; a node that knows that answers before it answers what is asked next."""

    def command_node(self, state: NmtState) -> None:
        """Command a state by NMT; nobody confirms that. Raises CommunicationError for a dead bus."""

    def emergencies(self) -> tuple[Emergency, ...]:
        """Return the emergency frames of errors that the node has not taken back."""

    def forget_emergencies(self) -> None:
        """Take no notice of the emergency frames up to now."""

    def hear(self, identifier: int, take: Callable[[bytes], None]) -> Callable[[], None]:
        """Subscribe `take` to the data of each frame with an identifier; return what ends that."""

    def synchronise(self) -> None:
        """Send a SYNC. Raises CommunicationError for a dead bus."""

    def disconnect(self) -> None:
        """Leave the bus; may be called twice."""


@dataclass(frozen=True)
class DriveSnapshot:
    """The objects that a drive has `sent` at one instant, by index; others are read from the drive."""

    objects: NodeObjects
    sent: Mapping[int, int]

    def read(self, index: int, subindex: int, size: int, *, signed: bool = False) -> int:
        """Return a number of `size` bytes; errors as for `NodeObjects.read`."""
        found = self.sent.get(index)
        return self.objects.read(index, subindex, size, signed=signed) if found is None else found


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
        self.objects = NodeObjects(client, name, traffic=traffic, calls=calls, asked_before=guarding)
        self.power = PowerStateMachine(
            self.objects,
            clock,
            timeout=options.transition_timeout,
            poll_interval=options.poll_interval,
            connection=connection,
        )
        self.guarding = guarding
        self._clock = clock
        self._options = options
        self._name = name
        self._connection = connection
        self._watchdog = HeartbeatWatchdog(self.objects)
        self._found = FoundObjects(self.objects)
        self._process_data: ProcessData | None = None
        self._found_mode: int | None = None
        self._modes: int | None = None
        self._found_nmt: NmtState | None = None
        self._identity = Identity("", "") if guarding else self._woken()
        if connection is not None and not guarding:
            self._start(connection)

    @property
    def identity(self) -> Identity:
        """Vendor and product of 0x1018, with the device's name."""
        return self._identity

    @property
    def found_state(self) -> tuple[FoundSetting, ...]:
        """Settings as found."""
        if self.guarding:
            return ()
        mapped = self._process_data.mapped if self._process_data is not None else ()
        return (found_nmt_state(self._found_nmt), polled_by(mapped), *self._found.settings)

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

    def take_over(self) -> None:
        """Read what the last user has left, and set what may be set; raises ReportedError naming what may not stay as it is."""
        self._found_mode = self.objects.read_optional(MODE, 0, 1, signed=True)
        self._modes = self.objects.read_optional(SUPPORTED_MODES, 0, 4)
        self._found.take_over()

    def poll(self, *groups: Sequence[MappedObject]) -> None:
        """Map what is measured into PDOs, one for each group, if station and drive allow it."""
        if self._options.process_data and self._connection is not None:
            self._process_data = ProcessData(self.objects, self._connection)
            self._process_data.map(*groups)

    def snapshot(self) -> "DriveSnapshot":
        """Return what the drive is like now: what it sends at one instant, and the rest as it is read."""
        if self._process_data is None or not self._process_data.mapped:
            return DriveSnapshot(self.objects, {})
        try:
            return DriveSnapshot(self.objects, self._process_data.read())
        except CommunicationError as error:
            # A node that lost its mapping, or a SYNC that does not reach it: it still answers what it is asked.
            self.objects.trace("error", f"process data: {error}")
            self._process_data.give_back()
            return DriveSnapshot(self.objects, {})

    def supported(self, *modes: int) -> int | None:
        """Return the first of some modes that the drive has (0x6502), None where it has none; the first where it does not say."""
        if self._modes is None:
            return modes[0]
        return next((mode for mode in modes if self._modes >> (mode - 1) & 1), None)

    def select(self, mode: int) -> None:
        """Set the mode of operation with the power off.

        Raises ReportedError for a fault, UnreachedStateError where the drive shows another mode.
        """
        if self.power.check_fault() is not PowerState.SWITCH_ON_DISABLED:
            self.power.disable()
        self._set_mode(mode)
        for last in polls(self._clock, self._options.transition_timeout, self._options.poll_interval):
            if (found := self.objects.read(MODE_DISPLAY, 0, 1, signed=True)) == mode:
                break
            if last:
                raise UnreachedStateError(
                    self._name, text("stays in mode {found} (0x6061)", found=found), command=f"0x6060 = {mode}"
                )

    def enable(self) -> None:
        """Go to Operation enabled, step by step; a node that has left operational meanwhile is started first.

        Raises ReportedError where the drive does not follow.
        """
        connection = self._connection
        if connection is not None and connection.nmt_state not in (None, NmtState.OPERATIONAL):
            connection.command_node(NmtState.OPERATIONAL)
        self.power.enable()

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
        """Give back what was found otherwise, end the watch and leave the bus; may be called twice."""
        connection, self._connection = self._connection, None
        if connection is None:
            return
        self._give_back()
        self._watchdog.disarm_if_reachable()
        if self._found_nmt in (NmtState.PRE_OPERATIONAL, NmtState.STOPPED):
            with suppress(InstrumentError):
                connection.command_node(self._found_nmt)
        connection.disconnect()

    def _give_back(self) -> None:
        if self.guarding:
            return
        try:
            off = self.power.state() is PowerState.SWITCH_ON_DISABLED
        except InstrumentError as error:
            # One that is gone is not waited for object by object.
            self.objects.trace("error", f"not put back: {error}")
            return
        if self._process_data is not None:
            self._process_data.give_back()
        self._found.give_back()
        found, self._found_mode = self._found_mode, None
        with suppress(InstrumentError):
            # Never under power: a mode that begins to act would move the shaft.
            if found is not None and off and self.objects.read(MODE, 0, 1, signed=True) != found:
                self._set_mode(found)

    def _set_mode(self, mode: int) -> None:
        self.objects.write(MODE, 0, mode, 1, signed=True)

    def _start(self, connection: BusConnection) -> None:
        """Have the node be operational, as one in pre-operational may refuse to be enabled; keep what it was before."""
        guarded = self.objects.read_optional(GUARD_TIME, 0, 2) and self.objects.read_optional(LIFE_TIME_FACTOR, 0, 1)
        if not guarded:
            # With life guarding set up, the first question would start it, and a fault follow when no more came.
            connection.ask_nmt_state()
            # Its answer is there before this one's.
            self.objects.read(DEVICE_TYPE, 0, 4)
        self._found_nmt = self._found_nmt or connection.nmt_state
        connection.command_node(NmtState.OPERATIONAL)

    def _woken(self) -> Identity:
        """Identify the node; one that NMT has stopped answers no SDO, and is made pre-operational first."""
        connection = self._connection
        try:
            return self._identify()
        except CommunicationError:
            if connection is None or connection.nmt_state is not NmtState.STOPPED:
                raise
            self._found_nmt = NmtState.STOPPED
            connection.command_node(NmtState.PRE_OPERATIONAL)
            return self._identify()

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
        identity = read_identity(self.objects)
        check_serial_number(self._name, identity, self._options.serial_number, "read 0x1018:04")
        return identity
