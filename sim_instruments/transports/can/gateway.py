"""A gateway from TCP to a CAN bus: what python-can opens as `slcan` at `socket://host:port`."""

import asyncio

import can

from sim_instruments.transports.can.buses import open_bus
from sim_instruments.transports.can.slcan import Adapter, LineSplitter, line_of
from sim_instruments.transports.client import Client

_CHUNK = 1 << 12
#: How long (s) the listening thread waits for a frame before it looks whether it should end.
_LISTENING_TIME = 0.05


class CanGateway:
    """Joins TCP clients to the bus of a channel; each has its own adapter, and all hear each other.

    A client that does not read loses frames, as a full adapter loses them.
    """

    def __init__(self, channel: str) -> None:
        self._bus = open_bus(channel)
        self._clients: dict[Client, Adapter] = {}
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

    async def serve(self, client: Client) -> None:
        """Serve one client until it hangs up."""
        adapter, splitter = Adapter(), LineSplitter()
        self._clients[client] = adapter
        # Who listens need not speak.
        client.lasting = True
        try:
            while data := await client.read(_CHUNK, begun=splitter.begun):
                for line in splitter.feed(data):
                    answer = adapter.take(line)
                    if answer.frame is not None:
                        self._bus.send(answer.frame)
                        self._spread(answer.frame, client)
                    await client.send(answer.reply)
        finally:
            del self._clients[client]

    def _spread(self, frame: can.Message, sender: Client | None = None) -> None:
        line = line_of(frame)
        for client, adapter in self._clients.items():
            if client is not sender and adapter.open:
                client.offer(line)
