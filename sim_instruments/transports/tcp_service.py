"""A TCP port with one task for each client; a faulty client does not affect the others."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable

from sim_instruments.transports.client import Client, Patience
from sim_instruments.transports.connection import Connection

#: Bytes that wait unread from a client before its connection is held up.
_READ_LIMIT = 1 << 16
_MOST_CLIENTS = 32
#: How often (s) clients that keep the server waiting are looked for.
_ROUND = 1.0
_NEVER_TOO_LONG = Patience()

Serve = Callable[[Client], Awaitable[None]]


class TcpService:
    """Serves connections to a port of `host` until it is stopped; above `most_clients` at once, new ones are hung up on.

    `refused` is told of the first such client, and of the next once one of those served has left.
    Clients that keep it waiting beyond `patience` are hung up on.
    With `connection` all are hung up on when its cable is pulled out, and new ones while it is.
    """

    def __init__(
        self,
        serve: Serve,
        host: str,
        *,
        most_clients: int = _MOST_CLIENTS,
        connection: Connection | None = None,
        patience: Patience = _NEVER_TOO_LONG,
        refused: Callable[[], None] = lambda: None,
    ) -> None:
        self._refused = refused
        self._serve = serve
        self._host = host
        self._connection = connection
        self._most = most_clients
        self._patience = patience
        self._clients: dict[asyncio.Task[None], Client] = {}
        self._rounds: asyncio.Task[None] | None = None
        self._server: asyncio.Server | None = None
        self._stopped = False
        self._told = False
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
        self._rounds = loop.create_task(self._look_round())

    def hang_up(self) -> None:
        """Hang up on everybody at once, as a cable that is pulled out does."""
        for task in tuple(self._clients):
            self._end(task)

    async def stop(self) -> None:
        """Stop listening and hang up on everybody."""
        self._stopped = True
        if self._server is None:
            return
        server, self._server = self._server, None
        if self._rounds is not None:
            self._rounds.cancel()
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
        full = len(self._clients) >= self._most
        if self._stopped or unplugged or full:
            writer.transport.abort()
            if full and not self._told:
                self._told = True
                self._refused()
            return
        client = Client(reader, writer)
        task = asyncio.get_running_loop().create_task(self._client(client))
        self._clients[task] = client
        # A task that is cancelled before its first step runs nothing of its own, no `finally` either.
        task.add_done_callback(self._left)

    async def _client(self, client: Client) -> None:
        # A client that leaves in the middle of a message has nothing more to be told.
        with contextlib.suppress(ConnectionError, asyncio.IncompleteReadError, TimeoutError):
            await self._serve(client)

    async def _look_round(self) -> None:
        while True:
            await asyncio.sleep(min(_ROUND, self._patience.idle, self._patience.half, self._patience.stalled))
            for task, client in tuple(self._clients.items()):
                if client.overdue(self._patience):
                    self._end(task)

    def _end(self, task: asyncio.Task[None]) -> None:
        self._clients[task].abort()
        task.cancel()

    def _left(self, task: asyncio.Task[None]) -> None:
        self._clients.pop(task).close()
        self._told = False


def _soon(loop: asyncio.AbstractEventLoop, act: Callable[[], None]) -> None:
    if not loop.is_closed():
        loop.call_soon_threadsafe(act)
