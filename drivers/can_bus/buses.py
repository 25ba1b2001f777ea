"""Connections to CAN buses: the nodes of one bus share one, which ends with the last of them."""

import os
import socket
import sys
from contextlib import suppress
from typing import TYPE_CHECKING

from drivers.can_bus.addresses import BusAddress, parse_address
from drivers.interfaces import CommunicationError

if TYPE_CHECKING:
    from drivers.can_bus.heartbeat import HeartbeatProducer
    from drivers.can_bus.objects import SdoClient

#: How long (s) the listening thread waits for a frame before it looks whether it should end; a second by default.
LISTENING_TIME = 0.05
#: Linux' option to receive only what comes for groups that this very socket has joined (ip(7)).
_IP_MULTICAST_ALL = 49


class CanBuses:
    """The buses that are open. Many adapters can be opened but once, whatever the number of nodes behind them."""

    def __init__(self) -> None:
        self._open: dict[tuple[str, str], SharedBus] = {}

    def node(self, address: str, name: str) -> "BusNode":
        """Return a node's place on the bus at `can://interface/channel?node=5&bitrate=500000`, opened where it is not.

        Raises CommunicationError where the bus cannot be opened, has another bit rate, or the node is taken.
        """
        wanted, node_id = parse_address(address, name)
        key = wanted.interface, wanted.channel
        bus = self._open.get(key)
        if bus is None:
            bus = SharedBus(wanted, name)
            self._open[key] = bus
        if bus.address.bitrate != wanted.bitrate:
            raise CommunicationError(
                name,
                f"the bus of {address} is open with {bus.address.bitrate} bit/s already",
                remedy="Give all nodes of one bus the same bit rate",
            )
        if node_id in bus.nodes:
            raise CommunicationError(
                name, f"node {node_id} at {address} is in use", remedy="Give each instrument its own node id"
            )
        return BusNode(self, bus, node_id, name)

    def release(self, bus: "SharedBus") -> None:
        """Disconnect a bus that no node uses any more."""
        if not bus.nodes:
            self._open.pop((bus.address.interface, bus.address.channel), None)
            bus.disconnect()


class SharedBus:
    """One connected bus; raises CommunicationError in the name of the instrument that needs it."""

    def __init__(self, address: BusAddress, name: str) -> None:
        import canopen

        self.address = address
        self.nodes: set[int] = set()
        self.network: canopen.Network = canopen.Network()
        self.network.NOTIFIER_CYCLE = LISTENING_TIME
        self.connect(name)

    def connect(self, name: str) -> None:
        """Connect to the bus; raises CommunicationError where that fails."""
        import can

        address = self.address
        try:
            self.network.connect(interface=address.interface, channel=address.channel, bitrate=address.bitrate)
        except (can.CanError, OSError, ValueError, ImportError) as error:
            self.disconnect()
            raise CommunicationError(
                name,
                f"cannot be opened at can://{address.interface}/{address.channel} ({error})",
                remedy="Check interface, channel and bit rate",
            ) from error
        if address.interface == "udp_multicast":
            self._keep_to_own_group()

    def _keep_to_own_group(self) -> None:
        """Have Linux hand over what comes for this bus' group only, and not for any other's on the same port."""
        if sys.platform == "linux" and self.network.bus is not None:
            with socket.socket(fileno=os.dup(self.network.bus.fileno())) as own:
                own.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)

    def disconnect(self) -> None:
        """Leave the bus; what a broken connection says about its end is of no use any more."""
        import can

        with suppress(can.CanError, OSError):
            self.network.disconnect()
        self.network.bus = None


class BusNode:
    """One node's place on a shared bus."""

    def __init__(self, buses: CanBuses, bus: SharedBus, node_id: int, name: str) -> None:
        import canopen

        self._buses = buses
        self._bus = bus
        self._node_id = node_id
        self._name = name
        self._heartbeat: HeartbeatProducer | None = None
        self._connected = True
        node = bus.network.add_node(node_id, canopen.ObjectDictionary())  # type: ignore[no-untyped-call]
        self.client: SdoClient = node.sdo
        bus.nodes.add(node_id)

    def reopen(self) -> None:
        """Connect to the bus anew, for all its nodes; raises CommunicationError where that fails."""
        self._bus.disconnect()
        self._bus.connect(self._name)

    def start_heartbeat(self, producer: int, period: float) -> None:
        """Send heartbeats of node `producer` every `period` (s) from now on."""
        from drivers.can_bus.heartbeat import HeartbeatProducer

        self._heartbeat = HeartbeatProducer(self._bus.network.send_message, producer, period)

    def disconnect(self) -> None:
        """Give the place up, and the bus where it was the last; may be called twice."""
        if not self._connected:
            return
        self._connected = False
        if self._heartbeat is not None:
            self._heartbeat.stop()
        del self._bus.network[self._node_id]
        self._bus.nodes.discard(self._node_id)
        self._buses.release(self._bus)
