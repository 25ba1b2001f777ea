"""One client's connection as a server sees it: what it may keep the server waiting for, and how much may wait for it."""

import asyncio
import socket
from dataclasses import dataclass

#: Bytes that wait for a client which does not read before what is offered to it is lost.
_BACKLOG = 1 << 16
#: A peer that has vanished is asked for after the first so many seconds of silence, again each so many, and given up after so many times.
_KEEP_ALIVE = (("TCP_KEEPIDLE", 30), ("TCP_KEEPINTVL", 10), ("TCP_KEEPCNT", 3))


@dataclass(frozen=True)
class Patience:
    """The longest times (s, real time) that a client is waited for before its connection is closed.

    `idle`: for the first byte of its next message; `half`: from a message's first byte to its last; `stalled`: for room
    for what it has asked for and does not read.
    """

    idle: float = 7200.0
    half: float = 30.0
    stalled: float = 60.0


class Client:
    """Reads from a client and sends to it, one task at a time for either; never keeps more for it than a part of a reply.

    With `lasting` its silence is none that ends it, as for one that merely listens.
    """

    def __init__(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        self.lasting = False
        self._reader = reader
        self._writer = writer
        self._now = asyncio.get_running_loop().time
        self._heard = self._now()
        #: Since when (s, of the loop) a message is on its way, a reading is under way, and a part of a reply has waited for room.
        self._begun: float | None = None
        self._reading = False
        self._sending: float | None = None
        _keep_alive(writer)

    @property
    def gone(self) -> bool:
        """True if no listener can be reached any more."""
        return self._writer.is_closing()

    @property
    def host(self) -> str:
        """The address that it has called from."""
        return str(self._writer.get_extra_info("peername")[0])

    @property
    def finished(self) -> bool:
        """True if it has sent its last byte."""
        return self._reader.at_eof()

    async def read(self, count: int, *, begun: bool = False) -> bytes:
        """Return 1 … `count` bytes, none at the end; `begun` says that they go on with a message."""
        now = self._now()
        if not begun:
            self._begun, self._heard = None, now
        elif self._begun is None:
            self._begun = now
        self._reading = True
        try:
            return await self._reader.read(count)
        finally:
            self._reading = False

    async def exactly(self, count: int, *, begun: bool = False) -> bytes:
        """Return `count` bytes. Raises IncompleteReadError where the connection ends before."""
        data = await self.read(count, begun=begun) if count else b""
        while len(data) < count:
            more = await self.read(count - len(data), begun=True) if data else b""
            if not more:
                raise asyncio.IncompleteReadError(data, count)
            data += more
        return data

    async def send(self, *data: bytes) -> None:
        """Send bytes, wait until there is room for more, and let others have their turn."""
        for part in data:
            self._writer.write(part)
        self._sending = self._now()
        try:
            await self._writer.drain()
            await asyncio.sleep(0)
        finally:
            self._sending = None

    def offer(self, data: bytes) -> None:
        """Send bytes, or lose them where too much waits already."""
        if not self.gone and self._writer.transport.get_write_buffer_size() < _BACKLOG:
            self._writer.write(data)

    def heard(self) -> None:
        """Take note that it has shown itself by another way."""
        self._heard = self._now()

    def overdue(self, patience: Patience) -> bool:
        """Return whether it has kept the server waiting for too long."""
        now = self._now()
        if self._sending is not None:
            return now - self._sending > patience.stalled
        if not self._reading:
            return False
        if self._begun is not None:
            return now - self._begun > patience.half
        return not self.lasting and now - self._heard > patience.idle

    def abort(self) -> None:
        """Hang up at once, whatever has not been sent."""
        self._writer.transport.abort()

    def close(self) -> None:
        """Hang up once everything has been sent."""
        self._writer.close()


def _keep_alive(writer: asyncio.StreamWriter) -> None:
    connection = writer.get_extra_info("socket")
    if connection is None:
        return
    connection.setsockopt(socket.SOL_SOCKET, socket.SO_KEEPALIVE, 1)
    for name, value in _KEEP_ALIVE:
        # Not every system lets a program choose.
        if (option := getattr(socket, name, None)) is not None:
            connection.setsockopt(socket.IPPROTO_TCP, option, value)
