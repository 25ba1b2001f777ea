"""A node behind an fdcanusb, an adapter from a serial port to CAN FD that is spoken to in lines of text."""

import re
from time import monotonic
from typing import Any

from drivers.interfaces import CommunicationError
from drivers.interfaces.text import text
from drivers.transport.parameters import parameters_of
from drivers.transport.serial.line_settings import LINE_KEYS, PORT_ERRORS, open_port
from drivers.transport.serial.port_errors import not_opened
from drivers.transport.wire import Wire

SCHEME = "fdcanusb"
#: The rate of a moteus' own serial port; an adapter on USB does not look at it.
_BAUD_RATE = 921_600
#: How long (s) the adapter may take to acknowledge a frame.
_ACKNOWLEDGED = 0.2
#: A frame with a fast data phase, in the format of CAN FD.
_FLAGS = "BF"
_RECEIVED = re.compile(rb"rcv ([0-9A-Fa-f]+) ((?:[0-9A-Fa-f]{2})*)(?: .*)?")


def is_fdcanusb(address: str) -> bool:
    """Return whether an address is `fdcanusb:///dev/…`."""
    return address.partition("://")[0].casefold() == SCHEME


class FdcanusbNode:
    """One node at `fdcanusb:///dev/fdcanusb?node=1`, with the keys of a serial port; the port is this node's alone.

    Raises CommunicationError for an address that is none, or a port that cannot be opened.
    """

    def __init__(self, address: str, name: str, wire: Wire | None = None) -> None:
        self._address = address
        self._name = name
        self._wire = wire
        self._identifiers = range(0)
        #: Frames that came while an acknowledgement was awaited.
        self._early: list[tuple[int, bytes]] = []
        self._path, self.node_id = _parsed(address, name)
        self._port: Any = self._opened()

    def send(self, identifier: int, data: bytes) -> None:
        """Send a frame and wait for the adapter's acknowledgement. Raises CommunicationError where none comes, or it refuses."""
        line = f"can send {identifier:04x} {data.hex().upper()} {_FLAGS}\n".encode()
        self._tell(">", line)
        try:
            self._port.write(line)
        except PORT_ERRORS as error:
            raise self._broken(error) from error
        end = monotonic() + _ACKNOWLEDGED
        while (left := end - monotonic()) > 0.0:
            heard = self._line(left)
            if heard.startswith(b"OK"):
                return
            if heard.startswith(b"ERR"):
                raise CommunicationError(
                    self._name,
                    text("the adapter refuses a frame ({reason})", reason=heard.decode("latin-1").strip()),
                    command=line.decode().strip(),
                    remedy=text("Check that the bus is powered and ended by its resistors"),
                )
            self._keep(heard)
        raise CommunicationError(
            self._name,
            text("the adapter does not acknowledge a frame"),
            command=line.decode().strip(),
            remedy=text("Check that an fdcanusb is at {address}", address=self._address),
        )

    def receive(self, timeout: float) -> tuple[int, bytes] | None:
        """Return a frame for one of the identifiers that are listened to, None where none comes in time (s, real)."""
        end = monotonic() + timeout
        while not self._early:
            if (left := end - monotonic()) <= 0.0:
                return None
            self._keep(self._line(left))
        return self._early.pop(0)

    def listen(self, identifiers: range) -> None:
        """Receive frames with these identifiers from now on."""
        self._identifiers = identifiers

    def discard(self) -> None:
        """Throw away what has come and was not received."""
        self._early.clear()
        try:
            self._port.reset_input_buffer()
        except PORT_ERRORS as error:
            raise self._broken(error) from error

    def reopen(self) -> None:
        """Open the port anew; raises CommunicationError where that fails."""
        self.disconnect()
        self._port = self._opened()

    def disconnect(self) -> None:
        """Close the port; may be called twice."""
        self._port.close()

    def _opened(self) -> Any:
        try:
            return open_port(self._path, _BAUD_RATE, _ACKNOWLEDGED)
        except ValueError as error:
            raise CommunicationError(
                self._name, text("{address}: {error}", address=self._address, error=error)
            ) from error
        except PORT_ERRORS as error:
            raise not_opened(self._name, self._address, error) from error

    def _line(self, timeout: float) -> bytes:
        """Return the next line, what has come of it where the rest does not come in time."""
        try:
            self._port.timeout = timeout
            heard = bytes(self._port.read_until(b"\n"))
        except PORT_ERRORS as error:
            raise self._broken(error) from error
        if heard:
            self._tell("<", heard)
        return heard

    def _keep(self, line: bytes) -> None:
        match = _RECEIVED.fullmatch(line.strip())
        if match is not None and (identifier := int(match[1], 16)) in self._identifiers:
            self._early.append((identifier, bytes.fromhex(match[2].decode())))

    def _tell(self, direction: Any, data: bytes) -> None:
        if self._wire is not None:
            self._wire("serial", direction, data)

    def _broken(self, error: BaseException) -> CommunicationError:
        return CommunicationError(
            self._name,
            text("the adapter is no longer connected ({error})", error=error),
            remedy=text("Check the adapter and its cable"),
        )


def _parsed(address: str, name: str) -> tuple[str, int]:
    """Return a port with the keys of its line, and the node behind it; raises CommunicationError for an address that is none."""
    path, _, query = address.partition("://")[2].partition("?")
    try:
        given = parameters_of(query)
        node = int(given.pop("node", ""))
    except ValueError:
        node, given = 0, {}
    if not path or not 1 <= node <= 127:
        raise CommunicationError(
            name,
            text("'{address}' is no address of a node behind an fdcanusb", address=address),
            remedy=text(
                "Write fdcanusb:///dev/fdcanusb?node=1…127; a port may have {keys} besides", keys=", ".join(LINE_KEYS)
            ),
        )
    rest = "&".join(f"{key}={value}" for key, value in given.items())
    return f"{path}?{rest}" if rest else path, node
