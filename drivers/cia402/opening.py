"""A CiA 402 node opened by its address."""

from collections.abc import Callable
from typing import Any, TypeVar

from drivers.catalogue import Surroundings
from drivers.cia402.node import Cia402Node

DriverT = TypeVar("DriverT")


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
