"""Connections to CAN buses: the nodes of one bus share one, which ends with the last of them."""

import threading
from collections.abc import Callable
from typing import TYPE_CHECKING, cast

from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text
from drivers.transport.can.addresses import BusAddress, parse_address, with_flexible_data_rate
from drivers.transport.can.network_management import NMT_COMMANDS, Emergency, NmtState
from drivers.transport.can.sockets import keep_to_own_group, leaving
from drivers.transport.in_process import IN_PROCESS, DirectDelivery, InProcess, open_can_bus
from drivers.transport.serial.port_errors import not_opened
from drivers.transport.wire import Wire

if TYPE_CHECKING:
    import can

    from drivers.transport.can.fd_frames import FdNode
    from drivers.transport.can.heartbeat import HeartbeatProducer
    from drivers.transport.can.objects import SdoClient

#: How long (s) the listening thread waits for a frame before it looks whether it should end; a second by default.
LISTENING_TIME = 0.05
#: A node has so long (s) for a reply, less than an energised instrument may be silent.
_RESPONSE_TIME = 0.5
#: Identifiers of network management and, with the node's number, of what tells its state (CiA 301).
_NMT, _SYNC, _ERROR_CONTROL = 0x000, 0x080, 0x700


class CanBuses:
    """The buses that are open. Many adapters can be opened but once, whatever the number of nodes behind them.

    `in_process` opens those of `can://in-process/…`.
    """

    def __init__(self, in_process: InProcess | None = None) -> None:
        self._open: dict[tuple[str, str], SharedBus] = {}
        self._in_process = in_process

    def node(self, address: str, name: str, wire: Wire | None = None) -> "BusNode":
        """Return a node's place on the bus at `can://interface/channel?node=5&bitrate=500000`, opened where it is not.

        `wire` receives the node's frames both ways. Raises CommunicationError where the bus cannot be
        opened, has another bit rate, or the node is taken.
        """
        bus, node_id = self._taken(*parse_address(address, name), address, name)
        return BusNode(self, bus, node_id, name, wire)

    def fd_node(self, address: str, name: str, bitrate: int, wire: Wire | None = None) -> "FdNode":
        """Return the place of a node that is spoken to by frames of CAN FD, at `bitrate` (bit/s) where its address says no other.

        Errors as for `node`.
        """
        from drivers.transport.can.fd_frames import FdNode

        wanted, node_id = parse_address(address, name, bitrate)
        if wanted.interface != IN_PROCESS:
            wanted = with_flexible_data_rate(wanted)
        bus, node_id = self._taken(wanted, node_id, address, name)
        return FdNode(bus, node_id, name, wire, lambda: self.release(bus))

    def _taken(self, wanted: BusAddress, node_id: int, address: str, name: str) -> tuple["SharedBus", int]:
        key = wanted.interface, wanted.channel
        bus = self._open.get(key)
        if bus is None:
            bus = SharedBus(wanted, name, self._in_process)
            self._open[key] = bus
        if bus.address.settings != wanted.settings:
            raise CommunicationError(
                name,
                text("the bus of {address} is open with other settings already", address=address),
                remedy=text("Give all nodes of one bus the same settings"),
            )
        if bus.address.bitrate != wanted.bitrate:
            raise CommunicationError(
                name,
                text(
                    "the bus of {address} is open with {bitrate} bit/s already",
                    address=address,
                    bitrate=bus.address.bitrate,
                ),
                remedy=text("Give all nodes of one bus the same bit rate"),
            )
        if node_id in bus.nodes:
            raise CommunicationError(
                name,
                text("node {node_id} at {address} is in use", node_id=node_id, address=address),
                remedy=text("Give each instrument its own node id"),
            )
        return bus, node_id

    def release(self, bus: "SharedBus") -> None:
        """Disconnect a bus that no node uses any more."""
        if not bus.nodes:
            self._open.pop((bus.address.interface, bus.address.channel), None)
            bus.disconnect()


class SharedBus:
    """One connected bus; raises CommunicationError in the name of the instrument that needs it."""

    def __init__(self, address: BusAddress, name: str, in_process: InProcess | None = None) -> None:
        from drivers.transport.can.listening import BrokenLine
        from drivers.transport.can.tapped import TappedNetwork

        self.address = address
        self._in_process = in_process
        self.nodes: set[int] = set()
        self.network: TappedNetwork = TappedNetwork()
        self.network.NOTIFIER_CYCLE = LISTENING_TIME
        self._leaving = threading.Event()
        cast("list[can.Listener]", self.network.listeners).append(BrokenLine(self._leaving))
        self.connect(name)

    def connect(self, name: str) -> None:
        """Connect to the bus; raises CommunicationError where that fails."""
        import can

        self._leaving.clear()
        address = self.address
        if self.answers_at_once:
            self.network.bus = open_can_bus(address.channel, self._in_process, name)
            for listener in self.network.listeners:
                cast("DirectDelivery", self.network.bus).hand_over(listener)
            return
        try:
            self.network.connect(**address.arguments(LISTENING_TIME))
        except (can.CanError, OSError, ValueError, ImportError) as error:
            self.disconnect()
            if address.channel.startswith("/") and not isinstance(error, (ValueError, ImportError)):
                raise not_opened(name, f"can://{address.interface}/{address.channel}", error) from error
            raise CommunicationError(
                name,
                text(
                    "cannot be opened at can://{interface}/{channel} ({error})",
                    interface=address.interface,
                    channel=address.channel,
                    error=error,
                ),
                remedy=text("Check interface, channel and bit rate"),
            ) from error
        if address.interface == "udp_multicast":
            keep_to_own_group(self.network.bus)

    @property
    def answers_at_once(self) -> bool:
        """Return whether a reply has come, if it ever will, when the call that sends its request returns."""
        return self.address.interface == IN_PROCESS

    def disconnect(self) -> None:
        """Leave the bus; what a broken connection says about its end is of no use any more."""
        self._leaving.set()
        if self.network.notifier is not None:
            # Or canopen prints it.
            self.network.notifier.exception = None
        with leaving(self.network.bus):
            self.network.disconnect()
        self.network.bus = None


class BusNode:
    """One node's place on a shared bus."""

    def __init__(self, buses: CanBuses, bus: SharedBus, node_id: int, name: str, wire: Wire | None = None) -> None:
        import canopen

        from drivers.transport.can.tapped import NodeTap

        self._buses = buses
        self._bus = bus
        self._node_id = node_id
        self._name = name
        self._heartbeat: HeartbeatProducer | None = None
        self._connected = True
        self._tap = None if wire is None else NodeTap(bus.network, node_id, wire)
        node = bus.network.add_node(node_id, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        node.sdo.RESPONSE_TIMEOUT = 0.0 if bus.answers_at_once else _RESPONSE_TIME
        self.client: SdoClient = node.sdo
        self._emergencies = node.emcy
        self._nmt_state: NmtState | None = None
        node.nmt.add_heartbeat_callback(self._take_state)
        bus.nodes.add(node_id)

    def reopen(self) -> None:
        """Connect to the bus anew, for all its nodes; raises CommunicationError where that fails."""
        self._bus.disconnect()
        self._bus.connect(self._name)

    def start_heartbeat(self, producer: int, period: float) -> None:
        """Send heartbeats of node `producer` every `period` (s) from now on."""
        from drivers.transport.can.heartbeat import HeartbeatProducer

        self._heartbeat = HeartbeatProducer(self._bus.network.send_message, producer, period)

    @property
    def nmt_state(self) -> NmtState | None:
        """The node's state by its last heartbeat or answer, None where it has said nothing."""
        return self._nmt_state

    def ask_nmt_state(self) -> None:
        """Ask the node for its state by node guarding; one that knows that answers before it answers what is asked next.

        Raises CommunicationError for a dead bus.
        """
        import can

        frame = can.Message(
            arbitration_id=_ERROR_CONTROL + self._node_id, is_extended_id=False, is_remote_frame=True, dlc=1
        )
        if self._tap is not None:
            self._tap.sent(frame.arbitration_id, remote=True)
        self._send(lambda: cast("can.BusABC", self._bus.network.bus).send(frame), "node guarding")

    def command_node(self, state: NmtState) -> None:
        """Command a state by NMT (CiA 301); nobody confirms that. Raises CommunicationError for a dead bus."""
        frame = bytes((NMT_COMMANDS[state], self._node_id))
        self._send(lambda: self._told(_NMT, frame), f"NMT {state.words}")
        if self._nmt_state is not None:
            self._nmt_state = state

    def emergencies(self) -> tuple[Emergency, ...]:
        """Return the emergency frames of errors that the node has not taken back."""
        return tuple(Emergency(one.code, one.register, bytes(one.data)) for one in self._emergencies.active)

    def forget_emergencies(self) -> None:
        """Take no notice of the emergency frames up to now."""
        self._emergencies.active.clear()

    def hear(self, identifier: int, take: Callable[[bytes], None]) -> Callable[[], None]:
        """Subscribe `take` to the data of each frame with an identifier; return what ends that."""

        def heard(_: int, data: bytearray, __: float) -> None:
            take(bytes(data))

        network = self._bus.network
        if self._tap is not None:
            self._tap.hear(identifier)
        network.subscribe(identifier, heard)
        return lambda: network.unsubscribe(identifier, heard)

    def synchronise(self) -> None:
        """Send a SYNC. Raises CommunicationError for a dead bus."""
        self._send(lambda: self._told(_SYNC, b""), "SYNC")

    def _told(self, identifier: int, data: bytes) -> None:
        if self._tap is not None:
            self._tap.sent(identifier, data)
        self._bus.network.send_message(identifier, data)

    def _take_state(self, state: int) -> None:
        # After boot-up a node is pre-operational by itself.
        if state == NmtState.BOOTING:
            self._nmt_state = NmtState.PRE_OPERATIONAL
        elif state in list(map(int, NmtState)):
            self._nmt_state = NmtState(state)

    def _send(self, send: Callable[[], object], command: str) -> None:
        import can

        try:
            send()
        except (can.CanError, OSError, RuntimeError, AttributeError) as error:
            raise CommunicationError(
                self._name,
                text("cannot be sent to the node ({error})", error=error),
                command=f"{command} of node {self._node_id}",
            ) from error

    def disconnect(self) -> None:
        """Give the place up, and the bus where it was the last; may be called twice."""
        if not self._connected:
            return
        self._connected = False
        if self._heartbeat is not None:
            self._heartbeat.stop()
        if self._tap is not None:
            self._tap.end()
        del self._bus.network[self._node_id]
        self._bus.nodes.discard(self._node_id)
        self._buses.release(self._bus)
