"""One link of a VXI-11 client to an instrument (VXI-11, B.6): what its calls do, as coroutines of their parameters; times in ms."""

import asyncio
from collections.abc import Callable

from sim_instruments.scpi.errors import ScpiError
from sim_instruments.scpi.session import Outgoing
from sim_instruments.transports.conversation import Conversation
from sim_instruments.transports.hislip.locks import Locks
from sim_instruments.transports.scpi_socket import INPUT_BUFFER
from sim_instruments.transports.service_request import ServiceRequests
from sim_instruments.transports.vxi11.rpc import numbers, opaque

LOCKED, NO_LOCK = 11, 12
_WAIT, _END, _TERMINATED, _GRANTED = 0x01, 0x08, 0x80, 1
_COUNT, _CHARACTER, _WHOLE = 1, 2, 4


class LinkError(Exception):
    """The error that a call returns (Device_ErrorCode)."""

    def __init__(self, code: int) -> None:
        self.code = code


class Vxi11Link:
    """Messages, status, lock, clear and service requests. Raises LinkError, and TimeoutError for what takes too long.

    `interrupt` is given the handle of each service request.
    """

    def __init__(
        self,
        number: int,
        conversation: Conversation,
        locks: Locks,
        gone: Callable[[], bool],
        interrupt: Callable[[bytes], None],
    ) -> None:
        self._conversation, self._locks, self._gone, self._interrupt = conversation, locks, gone, interrupt
        # HiSLIP's sessions, which share the locks, have positive numbers.
        self._holder = -number
        self._program = b""
        self._task: asyncio.Task[None] | None = None
        self._reply: Outgoing | None = None
        self._rest = bytearray()
        self._unfollow: Callable[[], None] = lambda: None

    async def write(self, io_timeout: int, wait: int, flags: int, data: bytes) -> bytes:
        """Take a part of a message; a whole one is handled while further calls come."""
        await self._until_ready(flags, wait, io_timeout)
        # One byte more than fits says that something was lost.
        self._program = (self._program + data)[: INPUT_BUFFER + 1]
        if flags & _END:
            program, self._program = self._program, b""
            if len(program) > INPUT_BUFFER:
                self._conversation.session.report(ScpiError(-363))
                return numbers(len(data))
            if self._reply is not None:
                self._reply, self._rest = None, bytearray()
                self._conversation.session.report(ScpiError(-410))
            self._task = asyncio.create_task(self._handle(program))
            self._task.add_done_callback(lambda task: task.cancelled() or task.exception())
        return numbers(len(data))

    async def read(self, size: int, io_timeout: int, wait: int, flags: int, character: int) -> bytes:
        """Return why no more than these bytes of the reply, and them."""
        await self._until_ready(flags, wait, io_timeout)
        if self._reply is None:
            self._conversation.session.report(ScpiError(-420))
            return await _in_vain(io_timeout)
        reply, over = self._reply, False
        while not over and len(self._rest) <= size:
            over = (part := next(iter(reply.parts), None)) is None
            self._rest += part or b""
            await asyncio.sleep(0)
        if over and not self._rest:
            # Half a reply: what ended it will not come.
            return await _in_vain(io_timeout)
        found = self._rest.find(character & 0xFF, 0, size) + 1 if flags & _TERMINATED else 0
        data = bytes(self._rest[: found or size])
        del self._rest[: found or size]
        reason = _CHARACTER if found else _COUNT if len(data) == size else 0
        if over and not self._rest and reply.whole:
            self._reply, reason = None, reason & _CHARACTER | _WHOLE
        return numbers(reason) + opaque(data)

    async def status(self, *_: int) -> bytes:
        """Return the status byte."""
        return numbers(self._conversation.session.status_byte(self._reply is not None))

    async def trigger(self, flags: int, wait: int, io_timeout: int) -> bytes:
        """Do what *TRG does."""
        await self.write(io_timeout, wait, flags | _END, b"*TRG\n")
        return b""

    async def clear(self, flags: int, wait: int, _: int) -> bytes:
        """Give up whatever has been begun."""
        await self._until_allowed(flags, wait)
        self._give_up()
        self._conversation.session.clear()
        return b""

    async def control(self, flags: int, wait: int, _: int) -> bytes:
        """Leave remote and local as they are: the front panel is nobody's."""
        await self._until_allowed(flags, wait)
        return b""

    async def lock(self, flags: int, wait: int) -> bytes:
        """Lock the instrument for this link alone."""
        if await self._locks.request(self._holder, b"", wait * 1e-3 if flags & _WAIT else 0.0) != _GRANTED:
            raise LinkError(LOCKED)
        return b""

    async def unlock(self) -> bytes:
        """Release the lock."""
        if self._locks.release(self._holder) != _GRANTED:
            raise LinkError(NO_LOCK)
        return b""

    async def enable_requests(self, enabled: int, handle: bytes) -> bytes:
        """Ask for service by a handle from now on, or no more."""
        self._unfollow()
        self._unfollow = lambda: None
        if enabled:
            requests = ServiceRequests(self._conversation.session, lambda _: self._interrupt(handle))
            self._unfollow = self._conversation.follow(lambda: requests.look(self._reply is not None))
        return b""

    def end(self) -> None:
        """Give up everything and release what it holds."""
        self._give_up()
        self._unfollow()
        self._conversation.session.abandon()
        self._locks.forget(self._holder)

    async def _handle(self, program: bytes) -> None:
        # The reply is there as soon as the task is done: a callback's turn would come after that of a read that waits.
        if (reply := await self._conversation.exchange(program, self._gone)) is not None:
            self._reply = Outgoing(iter(reply.parts), reply.whole)

    def _give_up(self) -> None:
        if self._task is not None:
            self._task.cancel()
        self._task, self._reply, self._program, self._rest = None, None, b"", bytearray()

    async def _until_allowed(self, flags: int, wait: int) -> None:
        try:
            async with asyncio.timeout(wait * 1e-3 if flags & _WAIT else 0.0):
                await self._locks.until_allowed(self._holder)
        except TimeoutError:
            raise LinkError(LOCKED) from None

    async def _until_ready(self, flags: int, wait: int, io_timeout: int) -> None:
        """Wait until the lock allows it and the message before has been handled."""
        await self._until_allowed(flags, wait)
        if self._task is not None:
            async with asyncio.timeout(io_timeout * 1e-3):
                await asyncio.shield(self._task)


async def _in_vain(io_timeout: int) -> bytes:
    await asyncio.sleep(io_timeout * 1e-3)
    raise TimeoutError
