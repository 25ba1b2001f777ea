"""A TCP port whose clients are served by a task each, and harm nobody but themselves."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

from sim_instruments.transports.connection import Connection

#: Bytes that wait unread from a client before its connection is held up.
_READ_LIMIT = 1 << 16
_MOST_CLIENTS = 32

Serve = Callable[[asyncio.StreamReader, asyncio.StreamWriter], Awaitable[None]]


class TcpService:
    """Serves connections to a port of `host` until it is stopped; above `most_clients` at once, new ones are hung up on.

    With `connection` all are hung up on when its cable is pulled out, and new ones while it is.
    """

    def __init__(
        self, serve: Serve, host: str, *, most_clients: int = _MOST_CLIENTS, connection: Connection | None = None
    ) -> None:
        self._serve = serve
        self._host = host
        self._connection = connection
        self._most = most_clients
        self._clients: dict[asyncio.Task[None], asyncio.StreamWriter] = {}
        self._server: asyncio.Server | None = None
        self._stopped = False
        #: The port, once started.
        self.port = 0

    async def start(self, port: int = 0) -> None:
        """Listen. Raises OSError where the port cannot be had."""
        loop = asyncio.get_running_loop()
        self._stopped = False
        if self._connection is not None:
            self._connection.listen(lambda up: None if up else _soon(loop, self.hang_up))
        self._server = await asyncio.start_server(self._accept, self._host, port, limit=_READ_LIMIT)
        self.port = int(self._server.sockets[0].getsockname()[1])

    def hang_up(self) -> None:
        """Hang up on everybody at once, as a cable that is pulled out does."""
        for client, writer in tuple(self._clients.items()):
            writer.transport.abort()
            client.cancel()

    async def stop(self) -> None:
        """Stop listening and hang up on everybody."""
        self._stopped = True
        if self._server is None:
            return
        server, self._server = self._server, None
        # A connection that is half accepted when the server is closed is lost in Python 3.11: it is taken first.
        for listener in server.sockets:
            asyncio.get_running_loop().remove_reader(listener.fileno())
        await asyncio.sleep(0)
        server.close()
        clients = list(self._clients)
        self.hang_up()
        await asyncio.gather(*clients, return_exceptions=True)

    def _accept(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        unplugged = self._connection is not None and not self._connection.up
        if self._stopped or unplugged or len(self._clients) >= self._most:
            writer.transport.abort()
            return
        client = asyncio.get_running_loop().create_task(self._client(reader, writer))
        self._clients[client] = writer
        # A task that is cancelled before its first step runs nothing of its own, no `finally` either.
        client.add_done_callback(self._left)

    async def _client(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        # A client that leaves in the middle of a message has nothing more to be told.
        with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError, TimeoutError):
            await self._serve(reader, writer)
            await writer.drain()

    def _left(self, client: asyncio.Task[None]) -> None:
        self._clients.pop(client).close()


def _soon(loop: asyncio.AbstractEventLoop, act: Callable[[], None]) -> None:
    if not loop.is_closed():
        loop.call_soon_threadsafe(act)
