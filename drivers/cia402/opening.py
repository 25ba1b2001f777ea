"""A CiA 402 node opened by its address, and what the driver of every such drive has."""

from collections.abc import Callable
from typing import Any, Self, TypeVar

from drivers.catalogue import Surroundings
from drivers.cia402.node import Cia402Node
from drivers.interfaces import Identity, Watchdog
from drivers.interfaces.found_state import FoundSetting

DriverT = TypeVar("DriverT")


class Cia402Driver:
    """A drive's identity and connection. A driver is derived from this and then from its role's interface, and sets `_node`."""

    _node: Cia402Node

    @classmethod
    def open(cls, address: str, options: Any, surroundings: Surroundings, name: str) -> Self:
        """Open the node at a CAN address; raises what `open_node` raises."""
        return open_node(cls, address, options, surroundings, name)

    @property
    def identity(self) -> Identity:
        """Vendor and product of 0x1018, with the device's name."""
        return self._node.identity

    @property
    def found_state(self) -> tuple[FoundSetting, ...]:
        """Settings of the drive as found."""
        return self._node.found_state

    @property
    def watchdog(self) -> Watchdog | None:
        """The drive's heartbeat consumer, as it was armed and read back."""
        return self._node.watchdog

    def close(self) -> None:
        """Give back what was found otherwise and leave the bus; may be called twice."""
        self._node.close()


def open_node(
    make: Callable[..., DriverT], address: str, options: Any, surroundings: Surroundings, name: str
) -> DriverT:
    """Open a node at `can://interface/channel?node=N&bitrate=500000`, the interface as python-can names it, for a driver.

    Nodes of one bus share the connection to it. Raises CommunicationError where the bus cannot be opened or the node does not
    answer, IdentityError where it is another one.
    """
    place = surroundings.can_buses.node(address, name, surroundings.wire)
    try:
        node = Cia402Node(
            place.client,
            surroundings.clock,
            options,
            name=name,
            traffic=surroundings.traffic,
            calls=surroundings.calls,
            connection=place,
            guarding=surroundings.guarding,
        )
    except BaseException:
        place.disconnect()
        raise
    try:
        return make(node, surroundings.clock, options, name=name)
    except BaseException:
        try:
            # What was set before it was refused is put back.
            node.close()
        finally:
            place.disconnect()
        raise
