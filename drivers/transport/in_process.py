"""Instruments that live in this very process: the bytes and frames of their protocols without a wire, a thread or a wait."""

from collections.abc import Callable
from typing import TYPE_CHECKING, Protocol

from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text

if TYPE_CHECKING:
    from can import BusABC, Message

#: Scheme of the addresses of byte streams, and python-can interface in those of CAN nodes.
IN_PROCESS = "in-process"


class ByteStream(Protocol):
    """One connection to an instrument; what is written has its effect before the call returns.

    Reading and writing raise ConnectionError once it is broken.
    """

    def write(self, data: bytes) -> int:
        """Send bytes and return how many were taken."""

    def read(self, count: int, timeout: float) -> bytes:
        """Return up to `count` bytes, nothing once `timeout` (s, bench time) has passed without one."""

    def reset_input_buffer(self) -> None:
        """Throw away what has come and was not read."""

    def close(self) -> None:
        """Close the connection; may be called twice."""


class InProcess(Protocol):
    """Opener of addresses in process."""

    def stream(self, address: str) -> ByteStream:
        """Return a connection to `in-process://…`. Raises LookupError where nothing is there, ConnectionError where it is cut off."""

    def can_bus(self, channel: str) -> "BusABC":
        """Return an end of a bus that has `hand_over`. Raises LookupError where there is no such channel."""


class DirectDelivery(Protocol):
    """A bus that needs nobody to listen: it gives each frame to its listeners on the sender's thread."""

    def hand_over(self, listener: "Callable[[Message], None]") -> None:
        """Give each frame to a listener."""


def is_in_process(address: str) -> bool:
    """Return whether an address is one of a byte stream in process."""
    return address.startswith(f"{IN_PROCESS}://")


def open_stream(address: str, opener: InProcess | None, name: str) -> ByteStream:
    """Return a connection to an address in process; raises CommunicationError where nothing in this process is there."""
    try:
        if opener is not None:
            return opener.stream(address)
    except (LookupError, ConnectionError) as error:
        raise _nothing_there(address, name) from error
    raise _nothing_there(address, name)


def open_can_bus(channel: str, opener: InProcess | None, name: str) -> "BusABC":
    """Return an end of a bus in process; raises CommunicationError where there is none in this process."""
    try:
        if opener is not None:
            return opener.can_bus(channel)
    except LookupError as error:
        raise _nothing_there(f"can://{IN_PROCESS}/{channel}", name) from error
    raise _nothing_there(f"can://{IN_PROCESS}/{channel}", name)


def _nothing_there(address: str, name: str) -> CommunicationError:
    return CommunicationError(
        name,
        text("nothing in this process answers at {address}", address=address),
        remedy=text("Give the instrument's own address; only the virtual bench has these, while it runs"),
    )
