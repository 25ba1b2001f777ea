"""Traffic between driver and instrument, byte by byte, for recording."""

from typing import Literal, Protocol

#: What carries the bytes; Modbus with its framing.
Carrier = Literal["visa", "modbus tcp", "modbus rtu", "modbus ascii", "serial", "can"]
#: To the instrument, from it, and in place of bytes: why none came or went.
Direction = Literal[">", "<", "!"]


class Wire(Protocol):
    """Receives what is on an instrument's wire, in order and from any thread."""

    def __call__(self, carrier: Carrier, direction: Direction, data: bytes) -> None:
        """Take a message as it went, its end included; a CAN frame as candump writes it, a failure as a word."""
