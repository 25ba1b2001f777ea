"""HiSLIP server of one instrument: pairs the two connections of each client (IVI-6.1, chapter 4)."""

import asyncio
from collections.abc import Callable

from sim_instruments.transports.client import Client
from sim_instruments.transports.conversation import Conversation
from sim_instruments.transports.hislip.locks import Locks
from sim_instruments.transports.hislip.messages import Fatal, FatalError, Message, MessageType, receive
from sim_instruments.transports.hislip.session import HislipSession

_PROTOCOL_VERSION = 0x0100
_VENDOR = int.from_bytes(b"MB", "big")
_SUB_ADDRESS = b"hislip0"
_GREETING_TIME = 10.0
_MOST_SESSIONS = 30


class HislipServer:
    """Serves connections that a TcpService hands over; the sub-address is hislip0. `locks` are the instrument's, its own unless given."""

    def __init__(self, converse: Callable[[], Conversation], locks: Locks | None = None) -> None:
        self._converse = converse
        self._locks = locks or Locks()
        self._sessions: dict[int, HislipSession] = {}
        self._last = 0

    async def serve(self, client: Client) -> None:
        """Serve one connection, whichever channel it turns out to be."""
        try:
            async with asyncio.timeout(_GREETING_TIME):
                first = await receive(client)
            await self._greet(first, client)
        except FatalError as error:
            await Message(MessageType.FATAL_ERROR, error.code, 0, str(error).encode()).send(client)

    async def _greet(self, first: Message, client: Client) -> None:
        if first.kind == MessageType.INITIALIZE:
            await self._serve_synchronous(first, client)
        elif first.kind == MessageType.ASYNC_INITIALIZE:
            await self._serve_asynchronous(first, client)
        else:
            raise FatalError(Fatal.BAD_INITIALIZATION, "Invalid initialization sequence")

    async def _serve_synchronous(self, first: Message, client: Client) -> None:
        if first.payload not in (b"", _SUB_ADDRESS):
            raise FatalError(Fatal.BAD_INITIALIZATION, "Unknown sub-address; there is hislip0 only")
        if len(self._sessions) >= _MOST_SESSIONS:
            raise FatalError(Fatal.TOO_MANY_CLIENTS, "Maximum number of clients exceeded")
        number = self._new_number()
        session = HislipSession(number, self._converse(), self._locks, client)
        self._sessions[number] = session
        try:
            version = min(first.parameter >> 16, _PROTOCOL_VERSION)
            await Message(MessageType.INITIALIZE_RESPONSE, 0, version << 16 | number).send(client)
            await session.serve()
        finally:
            del self._sessions[number]

    async def _serve_asynchronous(self, first: Message, client: Client) -> None:
        session = self._sessions.get(first.parameter)
        if session is None or session.attached.is_set():
            raise FatalError(Fatal.BAD_INITIALIZATION, "There is no session to join by this number")
        await Message(MessageType.ASYNC_INITIALIZE_RESPONSE, 0, _VENDOR).send(client)
        await session.serve_asynchronous(client)

    def _new_number(self) -> int:
        while True:
            self._last = self._last % 0xFFFF + 1
            if self._last not in self._sessions:
                return self._last
