"""A gateway from TCP to a CAN bus: what python-can opens as `slcan` at `socket://host:port`."""

import asyncio

import can

from sim_instruments.transports.can.buses import open_bus
from sim_instruments.transports.can.slcan import Adapter, LineSplitter, line_of

_CHUNK = 1 << 12
#: How long (s) the listening thread waits for a frame before it looks whether it should end.
_LISTENING_TIME = 0.05
#: Bytes that wait for a client which does not read before frames are lost to it, as a full adapter loses them.
_BACKLOG = 1 << 16


class CanGateway:
    """Joins TCP clients to the bus of a channel; each has its own adapter, and all hear each other."""

    def __init__(self, channel: str) -> None:
        self._bus = open_bus(channel)
        self._clients: dict[asyncio.StreamWriter, Adapter] = {}
        self._notifier: can.Notifier | None = None

    async def start(self) -> None:
        """Begin to pass on what is sent on the bus."""
        loop = asyncio.get_running_loop()
        self._notifier = can.Notifier(self._bus, [self._spread], timeout=_LISTENING_TIME, loop=loop)

    async def stop(self) -> None:
        """Leave the bus; again is allowed."""
        if self._notifier is not None:
            self._notifier.stop()
            self._notifier = None
            self._bus.shutdown()

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Serve one client until it hangs up."""
        adapter, splitter = Adapter(), LineSplitter()
        self._clients[writer] = adapter
        try:
            while data := await reader.read(_CHUNK):
                for line in splitter.feed(data):
                    answer = adapter.take(line)
                    writer.write(answer.reply)
                    if answer.frame is not None:
                        self._bus.send(answer.frame)
                        self._spread(answer.frame, writer)
                await writer.drain()
        finally:
            del self._clients[writer]

    def _spread(self, frame: can.Message, sender: asyncio.StreamWriter | None = None) -> None:
        line = line_of(frame)
        for writer, adapter in self._clients.items():
            if writer is sender or not adapter.open or writer.is_closing():
                continue
            if writer.transport.get_write_buffer_size() < _BACKLOG:
                writer.write(line)
