"""A CANopen client of a simulated node."""

from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from typing import Any

import canopen
import pytest
from canopen import objectdictionary as od

#: A reply that comes, from another thread of this process, comes within this time (s), however busy the machine.
PATIENCE = 30.0


def dictionary_of(types: Mapping[int, int]) -> canopen.ObjectDictionary:
    """Return an object dictionary of plain objects: index and data type."""
    dictionary = od.ObjectDictionary()
    for index, kind in types.items():
        variable = od.ODVariable(f"{index:04X}", index)
        variable.data_type = kind
        dictionary.add_object(variable)
    return dictionary


@contextmanager
def silence_of(node: canopen.RemoteNode) -> Iterator[None]:
    """Wait for no reply of a node for long: none is to come."""
    node.sdo.RESPONSE_TIMEOUT = 0.1
    try:
        yield
    finally:
        node.sdo.RESPONSE_TIMEOUT = PATIENCE


@contextmanager
def remote_node(address: Any, types: Mapping[int, int]) -> Iterator[canopen.RemoteNode]:
    """Connect to the node at a bench's address for the length of the block."""
    network = canopen.Network()
    network.NOTIFIER_CYCLE = 0.05
    network.connect(interface=address["interface"], channel=address["channel"])
    node = network.add_node(int(address["node_id"]), dictionary_of(types))
    node.sdo.RESPONSE_TIMEOUT = PATIENCE
    try:
        yield node
    finally:
        network.disconnect()


def aborted(access: Callable[[], object]) -> int:
    """Return the abort code by which the node refuses."""
    with pytest.raises(canopen.SdoAbortedError) as caught:
        access()
    return int(caught.value.code)
