"""A node that is spoken to by frames of CAN FD with a protocol of its maker's, and not by CANopen."""

from collections.abc import Callable
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any, Protocol, cast

from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text

if TYPE_CHECKING:
    import can

    from drivers.transport.wire import Wire

#: Identifiers above this one are extended (ISO 11898-1).
_STANDARD = 0x7FF
#: Flag of a frame with a fast data phase, in candump's notation of CAN FD frames.
_FAST = 1
#: Payloads that a frame of CAN FD can have.
_SIZES = (*range(9), 12, 16, 20, 24, 32, 48, 64)


class FrameLine(Protocol):
    """A way to one node, by frames with an identifier and up to 64 bytes."""

    node_id: int

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame. Raises CommunicationError where it cannot be sent."""

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Return a frame for one of the identifiers that are listened to, None where none comes in time (s, real)."""

    def listen(self, identifiers: range) -> None:
        """Receive frames with these identifiers from now on."""

    def discard(self) -> None:
        """Throw away what has come and was not received."""

    def reopen(self) -> None:
        """Connect anew; raises CommunicationError where that fails."""

    def disconnect(self) -> None:
        """Close the connection; may be called twice."""


class OpenBus(Protocol):
    """Bus as a node that shares it uses it."""

    nodes: set[int]
    network: Any

    @property
    def answers_at_once(self) -> bool:
        """Return whether a reply has come, if it ever will, when the call that sends its request returns."""

    def connect(self, name: str) -> None:
        """Connect to the bus; raises CommunicationError where that fails."""

    def disconnect(self) -> None:
        """Leave the bus."""


def padded(data: bytes, fill: int) -> bytes:
    """Return a payload filled up to a size that a frame of CAN FD can have."""
    size = next(size for size in _SIZES if size >= len(data))
    return data.ljust(size, bytes((fill,)))


def candump(identifier: int, data: bytes) -> bytes:
    """Return a frame of CAN FD as candump writes it."""
    return f"{identifier:0{8 if identifier > _STANDARD else 3}X}##{_FAST:X}{data.hex().upper()}".encode()


class FdNode:
    """One node's place on a shared bus; `release` is called once it is given up."""

    def __init__(self, bus: OpenBus, node_id: int, name: str, wire: "Wire | None", release: Callable[[], None]) -> None:
        self.node_id = node_id
        self._bus = bus
        self._release = release
        self._name = name
        self._wire = wire
        self._connected = True
        self._heard: SimpleQueue[tuple[int, bytes]] = SimpleQueue()
        self._identifiers = range(0)
        bus.nodes.add(node_id)

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame with a fast data phase. Raises CommunicationError where it cannot be sent."""
        import can

        frame = can.Message(
            arbitration_id=identifier,
            is_extended_id=identifier > _STANDARD,
            is_fd=True,
            bitrate_switch=True,
            data=data,
        )
        if self._wire is not None:
            self._wire("can", ">", candump(identifier, data))
        try:
            cast("can.BusABC", self._bus.network.bus).send(frame)
        except (can.CanError, OSError, RuntimeError, AttributeError, ValueError) as error:
            raise CommunicationError(
                self._name,
                text("cannot be sent to the node ({error})", error=error),
                command=f"frame for node {self.node_id}",
                remedy=text("Check the adapter: it must send frames of CAN FD, as its address says (fd=true)"),
            ) from error

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Return a frame for one of the identifiers that are listened to, None where none comes in time (s, real)."""
        try:
            return self._heard.get(timeout=timeout) if not self._bus.answers_at_once else self._heard.get_nowait()
        except Empty:
            return None

    def listen(self, identifiers: range) -> None:
        """Receive frames with these identifiers from now on."""
        self._unsubscribe()
        self._identifiers = identifiers
        for identifier in identifiers:
            self._bus.network.subscribe(identifier, self._take)

    def discard(self) -> None:
        """Throw away what has come and was not received."""
        while not self._heard.empty():
            self._heard.get_nowait()

    def reopen(self) -> None:
        """Connect to the bus anew, for all its nodes; raises CommunicationError where that fails."""
        self._bus.disconnect()
        self._bus.connect(self._name)

    def disconnect(self) -> None:
        """Give the place up, and the bus where it was the last; may be called twice."""
        if not self._connected:
            return
        self._connected = False
        self._unsubscribe()
        self._bus.nodes.discard(self.node_id)
        self._release()

    def _unsubscribe(self) -> None:
        for identifier in self._identifiers:
            self._bus.network.unsubscribe(identifier, self._take)

    def _take(self, identifier: int, data: bytearray, _: float) -> None:
        if self._wire is not None:
            self._wire("can", "<", candump(identifier, bytes(data)))
        self._heard.put((identifier, bytes(data)))
