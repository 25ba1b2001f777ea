"""Settings of the sockets under a bus that python-can does not make."""

import os
import socket
import sys
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import can

#: Linux' option to receive only what comes for groups that this very socket has joined (ip(7)).
_IP_MULTICAST_ALL = 49


def keep_to_own_group(bus: "can.BusABC | None") -> None:
    """Receive this bus's multicast group only, and no other group on the same port (Linux)."""
    if sys.platform == "linux" and bus is not None:
        with socket.socket(fileno=os.dup(bus.fileno())) as own:
            own.setsockopt(socket.IPPROTO_IP, _IP_MULTICAST_ALL, 0)


@contextmanager
def leaving(bus: "can.BusABC | None") -> Iterator[None]:
    """Shut a bus down in this block: errors are passed over, and its socket is closed in the end.

    pyserial leaves the socket under an slcan bus open where the other end has gone, and waits 0.3 s after it has closed one,
    for servers of one client; those of several processes need no pause.
    """
    import can

    port = getattr(bus, "serialPortOrig", None)
    line = getattr(port, "_socket", None)
    if port is not None and line is not None:
        port.close = line.close
    with suppress(can.CanError, OSError):
        yield
    if line is not None:
        line.close()
