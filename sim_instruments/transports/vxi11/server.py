"""VXI-11 server of one instrument: core, abort and interrupt channel (VXI-11, appendix B)."""

import asyncio
import contextlib
import ipaddress
from collections.abc import Callable, Coroutine
from typing import Any

from sim_instruments.transports.client import Client
from sim_instruments.transports.conversation import Conversation
from sim_instruments.transports.hislip.locks import Locks
from sim_instruments.transports.scpi_socket import INPUT_BUFFER
from sim_instruments.transports.vxi11 import rpc
from sim_instruments.transports.vxi11.link import LinkError, Vxi11Link

_CORE, _ABORT, _VERSION, _INTERRUPT_CALL = 0x0607AF, 0x0607B0, 1, 30
_NOT_ACCESSIBLE, _NO_LINK, _NO_CHANNEL, _UNSUPPORTED, _NO_RESOURCES = 3, 4, 6, 8, 9
_TIMED_OUT, _BAD_ADDRESS, _ABORTED, _CHANNEL_THERE = 15, 21, 23, 29
_NAME, _MOST_LINKS, _TCP, _LONGEST = b"inst0", 30, 0, INPUT_BUFFER + 1024
_CONNECTING_TIME, _ROUND = 5.0, 1.0
#: By procedure: what a link does, how many numbers and whether bytes it takes, and how many zeroes follow its error.
_CALLS: dict[int, tuple[Callable[..., Coroutine[Any, Any, bytes]], int, bool, int]] = {
    11: (Vxi11Link.write, 3, True, 1),
    12: (Vxi11Link.read, 5, False, 2),
    13: (Vxi11Link.status, 3, False, 1),
    14: (Vxi11Link.trigger, 3, False, 0),
    15: (Vxi11Link.clear, 3, False, 0),
    16: (Vxi11Link.control, 3, False, 0),
    17: (Vxi11Link.control, 3, False, 0),
    18: (Vxi11Link.lock, 2, False, 0),
    19: (Vxi11Link.unlock, 0, False, 0),
    20: (Vxi11Link.enable_requests, 1, True, 0),
}


class Vxi11Server:
    """Serves connections that a TcpService hands over, both programs at its `port`, which a portmapper does not name."""

    def __init__(self, converse: Callable[[], Conversation], locks: Locks) -> None:
        self.port = 0
        self._converse, self._locks = converse, locks
        self._operations: dict[int, asyncio.Task[bytes] | None] = {}
        self._last = 0

    async def serve(self, client: Client) -> None:
        """Answer one client's calls until it leaves."""
        connection = _Connection(self, client)
        try:
            while True:
                called = await rpc.receive(client, _LONGEST)
                await client.send(await connection.answer(called))
        finally:
            connection.close()

    def link(self, gone: Callable[[], bool], interrupt: Callable[[bytes], None]) -> tuple[int, Vxi11Link]:
        """Return a new link and its number. Raises LinkError where there are as many as can be."""
        if len(self._operations) >= _MOST_LINKS:
            raise LinkError(_NO_RESOURCES)
        self._last += 1
        self._operations[self._last] = None
        return self._last, Vxi11Link(self._last, self._converse(), self._locks, gone, interrupt)

    def unlink(self, number: int) -> None:
        """Forget a link."""
        del self._operations[number]

    def abort(self, number: int) -> bytes:
        """Abort the present operation of a link with an error. Raises LinkError for an unknown link."""
        if number not in self._operations:
            raise LinkError(_NO_LINK)
        if (operation := self._operations[number]) is not None:
            operation.cancel()
        return b""

    async def carry_out(self, number: int, work: Coroutine[Any, Any, bytes], gone: Callable[[], bool]) -> bytes:
        """Return what a link's call returns. Raises LinkError where it was aborted or took too long."""
        self._operations[number] = operation = asyncio.create_task(work)
        try:
            while not operation.done():
                await asyncio.wait({operation}, timeout=_ROUND)
                if gone():
                    raise ConnectionAbortedError
            if operation.cancelled():
                raise LinkError(_ABORTED)
            return operation.result()
        except TimeoutError:
            raise LinkError(_TIMED_OUT) from None
        finally:
            operation.cancel()
            self._operations[number] = None


class _Connection:
    """One client's connection: its links, and the one by which it is asked for service."""

    def __init__(self, server: Vxi11Server, client: Client) -> None:
        self._server, self._client = server, client
        self._links: dict[int, Vxi11Link] = {}
        self._interrupt: tuple[asyncio.StreamWriter, int, int] | None = None

    async def answer(self, called: rpc.RpcCall) -> bytes:
        """Return the reply to a call."""
        procedure = called.procedure
        if called.program not in (_CORE, _ABORT):
            return called.reply(rpc.NO_PROGRAM)
        if called.version != _VERSION:
            return called.reply(rpc.OTHER_VERSION, rpc.numbers(_VERSION, _VERSION))
        if (called.program == _ABORT) is not (procedure == 1) and procedure:
            return called.reply(rpc.NO_PROCEDURE)
        zeroes = {10: 3, 22: 1}.get(procedure, _CALLS[procedure][3] if procedure in _CALLS else 0)
        try:
            results = await self._do(procedure, called.parameters)
        except rpc.GarbageError:
            return called.reply(rpc.GARBAGE)
        except LinkError as error:
            return called.reply(rpc.SUCCESS, rpc.numbers(error.code, *(0,) * zeroes))
        if results is None:
            return called.reply(rpc.NO_PROCEDURE)
        return called.reply(rpc.SUCCESS, rpc.numbers(0) + results if procedure else b"")

    async def _do(self, procedure: int, given: rpc.XdrReader) -> bytes | None:
        """Return what follows the error 0, None for a procedure that there is not."""
        match procedure:
            case 0:
                return b""
            case 1:
                return self._server.abort(*given.numbers(1))
            case 10:
                _, locked, wait = given.numbers(3)
                return await self._create(given.opaque(), locked, wait)
            case 22:
                raise LinkError(_UNSUPPORTED)
            case 25:
                return await self._call_back(*given.numbers(5))
            case 26:
                return self._hang_up()
        if procedure not in (*_CALLS, 23):
            return None
        number = given.numbers(1)[0]
        if number not in self._links:
            raise LinkError(_NO_LINK)
        if procedure == 23:
            self._destroy(number)
            return b""
        work, count, bytes_too, _ = _CALLS[procedure]
        parameters = (*given.numbers(count), *((given.opaque(),) if bytes_too else ()))
        return await self._server.carry_out(number, work(self._links[number], *parameters), self._gone)

    def close(self) -> None:
        """End its links."""
        for number in tuple(self._links):
            self._destroy(number)
        with contextlib.suppress(LinkError):
            self._hang_up()

    async def _create(self, name: bytes, locked: int, wait: int) -> bytes:
        if name.lower() not in (b"", _NAME):
            raise LinkError(_NOT_ACCESSIBLE)
        number, link = self._server.link(self._gone, self._request_service)
        self._links[number] = link
        if locked:
            try:
                await self._server.carry_out(number, link.lock(1, wait), self._gone)
            except LinkError:
                self._destroy(number)
                raise
        return rpc.numbers(number, self._server.port, INPUT_BUFFER)

    def _destroy(self, number: int) -> None:
        self._links.pop(number).end()
        self._server.unlink(number)

    async def _call_back(self, *about: int) -> bytes:
        host, port, program, version, family = about
        address = str(ipaddress.IPv4Address(host))
        if self._interrupt is not None:
            raise LinkError(_CHANNEL_THERE)
        if family != _TCP:
            raise LinkError(_UNSUPPORTED)
        # An instrument calls its client back, and nobody else whom it names.
        if address != self._client.host or not 0 < port < 1 << 16:
            raise LinkError(_BAD_ADDRESS)
        try:
            async with asyncio.timeout(_CONNECTING_TIME):
                _, writer = await asyncio.open_connection(address, port)
        except OSError:
            raise LinkError(_NO_CHANNEL) from None
        self._interrupt = writer, program, version
        return b""

    def _request_service(self, handle: bytes) -> None:
        if self._interrupt is not None and not self._interrupt[0].is_closing():
            writer, program, version = self._interrupt
            writer.write(rpc.call(program, version, _INTERRUPT_CALL, rpc.opaque(handle)))

    def _hang_up(self) -> bytes:
        if self._interrupt is None:
            raise LinkError(_NO_CHANNEL)
        self._interrupt[0].close()
        self._interrupt = None
        return b""

    def _gone(self) -> bool:
        return self._client.gone or self._client.finished
