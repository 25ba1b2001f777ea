"""CAN buses in this process, by python-can's `virtual` interface; a gateway lets other processes join one."""

from uuid import uuid4

import can

#: python-can's name of them.
INTERFACE = "virtual"


def fresh_channel() -> str:
    """Return a channel that no other bench is on."""
    return f"virtual-bench-{uuid4().hex}"


def open_bus(channel: str) -> can.BusABC:
    """Return one more end of a channel's bus, open."""
    return can.Bus(interface=INTERFACE, channel=channel)
