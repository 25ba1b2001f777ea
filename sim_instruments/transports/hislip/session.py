"""One HiSLIP client: its synchronous and its asynchronous channel, in synchronised mode."""

import asyncio
import struct
from collections.abc import Iterator
from typing import Any

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.session import Outgoing
from sim_instruments.transports.client import Client
from sim_instruments.transports.conversation import Conversation
from sim_instruments.transports.hislip.locks import Locks
from sim_instruments.transports.hislip.messages import (
    HEADER_SIZE,
    MAXIMUM_MESSAGE,
    Fatal,
    FatalError,
    Message,
    MessageType,
    NonFatalError,
    receive,
)
from sim_instruments.transports.service_request import ServiceRequests

#: The longest message that an instrument takes, and the least that a client may want replies cut to.
_INPUT_BUFFER = 1 << 16
_SMALLEST_MESSAGE = 256
_SYNCHRONISED = 0
_GREETING_TIME = 10.0
_RMT_DELIVERED = 0x01
_RELEASE = 0


class HislipSession:
    """Serves both channels. Query errors are left to the client's comparison of MessageIDs, which tells stale replies."""

    def __init__(self, number: int, conversation: Conversation, locks: Locks, client: Client) -> None:
        self.number = number
        self.attached = asyncio.Event()
        self._conversation = conversation
        self._locks = locks
        self._client = client
        self._task: asyncio.Task[None] | None = None
        self._asynchronous: asyncio.Task[None] | None = None
        self._clearing = False
        self._partial = bytearray()
        self._overrun = False
        self._undelivered = False
        self._sent_size = MAXIMUM_MESSAGE
        self._requests: ServiceRequests | None = None

    # the synchronous channel

    async def serve(self) -> None:
        """Take messages until the client leaves. Raises FatalError for bytes that are no message, or no second channel."""
        first = asyncio.ensure_future(receive(self._client))
        try:
            await self._until_attached(first)
            await self._take(await first)
            while True:
                await self._take(await receive(self._client))
        finally:
            for task in (first, self._task, self._asynchronous):
                if task is not None:
                    task.cancel()
            self._conversation.session.abandon()
            self._locks.forget(self.number)

    async def _until_attached(self, first: "asyncio.Future[Message]") -> None:
        attached = asyncio.ensure_future(self.attached.wait())
        # Reading goes on meanwhile: that is how a client's leaving shows.
        either: set[asyncio.Future[Any]] = {first, attached}
        await asyncio.wait(either, timeout=_GREETING_TIME, return_when=asyncio.FIRST_COMPLETED)
        attached.cancel()
        if self.attached.is_set():
            return
        if first.done():
            first.result()
        raise FatalError(Fatal.CHANNEL_MISSING, "The asynchronous channel is not established")

    async def _take(self, message: Message) -> None:
        match message.kind:
            case MessageType.DEVICE_CLEAR_COMPLETE:
                self._clearing = False
                await Message(MessageType.DEVICE_CLEAR_ACKNOWLEDGE, _SYNCHRONISED).send(self._client)
            case MessageType.DATA | MessageType.DATA_END | MessageType.TRIGGER:
                if not self._clearing:
                    self._task = asyncio.get_running_loop().create_task(self._handle(message))
                    # Device clear cancels what is being handled; the channel itself goes on.
                    await asyncio.wait({self._task})
                    self._raise_from(self._task)
                    self._look()
            case MessageType.FATAL_ERROR:
                raise ConnectionAbortedError
            case MessageType.ERROR:
                return
            case _:
                await _unknown(message).send(self._client)

    async def _handle(self, message: Message) -> None:
        self._delivered(message.control)
        if message.too_large:
            self._partial.clear()
            self._overrun = message.kind == MessageType.DATA
            self._conversation.session.report(ScpiError(-363))
            await Message(MessageType.ERROR, NonFatalError.TOO_LARGE, 0, b"Message too large").send(self._client)
            return
        await self._locks.until_allowed(self.number)
        if message.kind == MessageType.TRIGGER:
            await self._answer(b"*TRG\n", message.parameter)
            return
        self._partial += message.payload
        if len(self._partial) > _INPUT_BUFFER:
            self._partial.clear()
            if not self._overrun:
                self._overrun = True
                self._conversation.session.report(ScpiError(-363))
        if message.kind == MessageType.DATA_END:
            program, self._partial = bytes(self._partial), bytearray()
            dropped, self._overrun = self._overrun, False
            if not dropped:
                await self._answer(program, message.parameter)

    async def _answer(self, program: bytes, identifier: int) -> None:
        if self._undelivered:
            self._undelivered = False
            self._conversation.session.report(ScpiError(-410))
        reply = await self._conversation.exchange(program, lambda: self._client.gone)
        if reply is None:
            return
        self._undelivered = True
        last = b""
        for payload in self._payloads(reply):
            if last:
                await Message(MessageType.DATA, 0, identifier, last).send(self._client)
            last = payload
        kind = MessageType.DATA_END if reply.whole else MessageType.DATA
        await Message(kind, 0, identifier, last).send(self._client)

    def _payloads(self, reply: Outgoing) -> Iterator[bytes]:
        """Give the parts of a reply, none of them longer than the client wants."""
        for part in reply.parts:
            for start in range(0, len(part), self._sent_size):
                yield part[start : start + self._sent_size]

    @staticmethod
    def _raise_from(task: "asyncio.Task[None]") -> None:
        error = None if task.cancelled() else task.exception()
        if error is not None:
            raise error

    # the asynchronous channel

    async def serve_asynchronous(self, client: Client) -> None:
        """Answer the asynchronous channel until the client leaves, which ends the synchronous one, too."""
        self._asynchronous = asyncio.current_task()
        # Whether the session is idle shows on its other channel.
        client.lasting = True
        self._requests = ServiceRequests(
            self._conversation.session,
            lambda status: Message(MessageType.ASYNC_SERVICE_REQUEST, status).offer(client),
        )
        unfollow = self._conversation.follow(self._look)
        self.attached.set()
        try:
            while True:
                message = await receive(client)
                self._client.heard()
                await self._take_asynchronous(message, client)
        finally:
            unfollow()
            self._client.close()
            self._interrupt()

    async def _take_asynchronous(self, message: Message, client: Client) -> None:
        match message.kind:
            case MessageType.ASYNC_MAXIMUM_MESSAGE_SIZE if len(message.payload) == 8:
                wanted = struct.unpack("!Q", message.payload)[0]
                self._sent_size = max(_SMALLEST_MESSAGE, min(wanted, MAXIMUM_MESSAGE)) - HEADER_SIZE
                size = struct.pack("!Q", MAXIMUM_MESSAGE)
                await Message(MessageType.ASYNC_MAXIMUM_MESSAGE_SIZE_RESPONSE, 0, 0, size).send(client)
            case MessageType.ASYNC_STATUS_QUERY:
                self._delivered(message.control)
                status = self._conversation.session.status_byte(self._undelivered)
                await Message(MessageType.ASYNC_STATUS_RESPONSE, status).send(client)
            case MessageType.ASYNC_DEVICE_CLEAR:
                self._clearing = True
                self._interrupt()
                self._conversation.session.clear()
                self._partial.clear()
                self._overrun = self._undelivered = False
                await Message(MessageType.ASYNC_DEVICE_CLEAR_ACKNOWLEDGE, _SYNCHRONISED).send(client)
            case MessageType.ASYNC_LOCK:
                code = await self._lock(message)
                await Message(MessageType.ASYNC_LOCK_RESPONSE, code).send(client)
            case MessageType.ASYNC_LOCK_INFO:
                info = Message(MessageType.ASYNC_LOCK_INFO_RESPONSE, int(self._locks.exclusive), self._locks.holders)
                await info.send(client)
            case MessageType.ASYNC_REMOTE_LOCAL_CONTROL:
                await Message(MessageType.ASYNC_REMOTE_LOCAL_RESPONSE).send(client)
            case MessageType.FATAL_ERROR:
                raise ConnectionAbortedError
            case MessageType.ERROR:
                return
            case _:
                await _unknown(message).send(client)

    async def _lock(self, message: Message) -> int:
        if message.control == _RELEASE:
            return self._locks.release(self.number)
        return await self._locks.request(self.number, message.payload, message.parameter / 1000.0)

    def _look(self) -> None:
        if self._requests is not None:
            self._requests.look(self._undelivered)

    def _interrupt(self) -> None:
        if self._task is not None:
            self._task.cancel()

    def _delivered(self, control: int) -> None:
        if control & _RMT_DELIVERED:
            self._undelivered = False


def _unknown(message: Message) -> Message:
    return Message(
        MessageType.ERROR, NonFatalError.UNKNOWN_TYPE, 0, f"Unrecognized message type {message.kind}".encode()
    )
