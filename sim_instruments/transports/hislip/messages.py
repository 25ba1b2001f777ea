"""HiSLIP's messages: a header of 16 bytes and a payload (IVI-6.1, revision 2.0, chapter 2)."""

import asyncio
import struct
from dataclasses import dataclass
from enum import IntEnum

from sim_instruments.transports.client import Client

_HEADER = struct.Struct("!2sBBIQ")
HEADER_SIZE = _HEADER.size
_PROLOGUE = b"HS"
_CHUNK = 1 << 16
#: A payload of fewer bytes costs less to copy than to send by itself.
_SMALL = 1 << 12

#: The payload that is accepted, and sent, at most.
MAXIMUM_MESSAGE = 1 << 20


class MessageType(IntEnum):
    """Type of a message (IVI-6.1, table 4)."""

    INITIALIZE = 0
    INITIALIZE_RESPONSE = 1
    FATAL_ERROR = 2
    ERROR = 3
    ASYNC_LOCK = 4
    ASYNC_LOCK_RESPONSE = 5
    DATA = 6
    DATA_END = 7
    DEVICE_CLEAR_COMPLETE = 8
    DEVICE_CLEAR_ACKNOWLEDGE = 9
    ASYNC_REMOTE_LOCAL_CONTROL = 10
    ASYNC_REMOTE_LOCAL_RESPONSE = 11
    TRIGGER = 12
    ASYNC_MAXIMUM_MESSAGE_SIZE = 15
    ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE = 16
    ASYNC_INITIALIZE = 17
    ASYNC_INITIALIZE_RESPONSE = 18
    ASYNC_DEVICE_CLEAR = 19
    ASYNC_SERVICE_REQUEST = 20
    ASYNC_STATUS_QUERY = 21
    ASYNC_STATUS_RESPONSE = 22
    ASYNC_DEVICE_CLEAR_ACKNOWLEDGE = 23
    ASYNC_LOCK_INFO = 24
    ASYNC_LOCK_INFO_RESPONSE = 25


class Fatal(IntEnum):
    """Code of a fatal error (IVI-6.1, table 16)."""

    BAD_HEADER = 1
    CHANNEL_MISSING = 2
    BAD_INITIALIZATION = 3
    TOO_MANY_CLIENTS = 4


class NonFatalError(IntEnum):
    """Code of an error that the connection survives (IVI-6.1, table 18)."""

    UNKNOWN_TYPE = 1
    TOO_LARGE = 4


class FatalError(Exception):
    """The connection cannot go on."""

    def __init__(self, code: Fatal, words: str) -> None:
        self.code = code
        super().__init__(words)


@dataclass(frozen=True, slots=True)
class Message:
    """One message. `kind` is a plain number where the type is unknown; a payload that is too large is left out."""

    kind: int
    control: int = 0
    parameter: int = 0
    payload: bytes = b""
    too_large: bool = False

    @property
    def header(self) -> bytes:
        """The bytes before the payload."""
        return _HEADER.pack(_PROLOGUE, self.kind, self.control, self.parameter, len(self.payload))

    def offer(self, client: Client) -> None:
        """Send the message, or lose it where too much waits for the client already."""
        client.offer(self.header + self.payload)

    async def send(self, client: Client) -> None:
        """Send the message, and wait until there is room for more."""
        header = self.header
        if len(self.payload) < _SMALL:
            await client.send(header + self.payload)
        else:
            await client.send(header, self.payload)


async def receive(client: Client) -> Message:
    """Read a message. Raises FatalError for bytes that are none, IncompleteReadError where the connection ends."""
    prologue, kind, control, parameter, length = _HEADER.unpack(await client.exactly(HEADER_SIZE))
    if prologue != _PROLOGUE:
        raise FatalError(Fatal.BAD_HEADER, "Poorly formed message header")
    if length > MAXIMUM_MESSAGE:
        await _discard(client, length)
        return Message(kind, control, parameter, too_large=True)
    return Message(kind, control, parameter, await client.exactly(length, begun=True) if length else b"")


async def _discard(client: Client, length: int) -> None:
    while length:
        data = await client.read(min(length, _CHUNK), begun=True)
        if not data:
            raise asyncio.IncompleteReadError(b"", length)
        length -= len(data)
