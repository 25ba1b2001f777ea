"""CAN buses that a virtual node joins: in process, or UDP multicast that stays on this computer."""

import os
import random
import socket
from uuid import uuid4

import can
from can.interfaces.udp_multicast import UdpMulticastBus

# A group of the range for local use, a new one for each bench.
_GROUP = "239.74.{}.{}"
#: Linux' option to receive only what comes for groups that this very socket has joined.
_IP_MULTICAST_ALL = 49


class LocalMulticastBus(UdpMulticastBus):
    """A bus that takes no notice of datagrams that are no frames, nor of other benches' on the same port."""

    def __init__(self, channel: str) -> None:
        super().__init__(channel, hop_limit=0)
        with socket.socket(fileno=os.dup(self.fileno())) as own:
            own.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)

    def _recv_internal(self, timeout: float | None) -> tuple[can.Message | None, bool]:
        try:
            return super()._recv_internal(timeout)
        except can.CanOperationError as error:
            if isinstance(error.__cause__, OSError):
                raise
            return None, False


def fresh_channel(interface: str) -> str:
    """Return a channel of python-can's that no other bench is on."""
    if interface == "udp_multicast":
        # Not the seed's business: two benches of one seed must not meet.
        chance = random.SystemRandom()
        return _GROUP.format(chance.randrange(256), chance.randrange(1, 255))
    return f"virtual-bench-{uuid4().hex}"


def open_bus(interface: str, channel: str) -> can.BusABC:
    """Return an open bus. Raises what python-can raises for an interface or channel that it cannot open."""
    if interface == "udp_multicast":
        return LocalMulticastBus(channel)
    return can.Bus(interface=interface, channel=channel)
