"""A CANopen network that tells the frames of its nodes."""

from collections.abc import Callable
from typing import Any

import canopen

from drivers.transport.wire import Wire

#: Function codes (CiA 301) of what a node sends: emergencies, replies to SDO, error control; and of the requests to it.
_EMERGENCY, _SDO_REPLY, _SDO_REQUEST, _ERROR_CONTROL = 0x080, 0x580, 0x600, 0x700


class TappedNetwork(canopen.Network):
    """A network that tells each node's requests."""

    def __init__(self) -> None:
        super().__init__()
        self.sent: dict[int, Callable[[int, bytes], None]] = {}

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Send a frame, and tell of it where it is a request to a node that is listened to."""
        if can_id in self.sent:
            self.sent[can_id](can_id, bytes(data))
        super().send_message(can_id, data, remote)


class NodeTap:
    """Tells what goes to one node and what comes from it, until it is ended.

    What comes is told before anybody else hears it: the next request may be out as soon as it is heard.
    """

    def __init__(self, network: TappedNetwork, node_id: int, wire: Wire) -> None:
        self._network, self._wire = network, wire
        self._request = _SDO_REQUEST + node_id
        self._heard = {code + node_id for code in (_EMERGENCY, _SDO_REPLY, _ERROR_CONTROL)}
        network.sent[self._request] = self.sent
        for identifier in self._heard:
            network.subscribe(identifier, self._received)

    def hear(self, identifier: int) -> None:
        """Tell the frames with one more identifier, too."""
        if identifier not in self._heard:
            self._heard.add(identifier)
            self._network.subscribe(identifier, self._received)

    def sent(self, identifier: int, data: bytes = b"", *, remote: bool = False) -> None:
        """Tell a frame that goes out."""
        self._wire("can", ">", b"%03X#%s" % (identifier, b"R" if remote else data.hex().upper().encode()))

    def end(self) -> None:
        """Tell no more."""
        self._network.sent.pop(self._request, None)
        for identifier in self._heard:
            self._network.unsubscribe(identifier, self._received)

    def _received(self, identifier: int, data: bytearray, _: float) -> None:
        self._wire("can", "<", b"%03X#%s" % (identifier, data.hex().upper().encode()))
