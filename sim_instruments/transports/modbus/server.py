"""Modbus TCP for several clients at once, in an event loop (MODBUS Messaging on TCP/IP, V1.0b)."""

from collections.abc import Awaitable, Callable

from sim_instruments.faults.line_faults import FaultKind
from sim_instruments.transports.client import Client
from sim_instruments.transports.modbus.frames import HEADER, REQUEST_TIME, ModbusFrames, NoFrameError, rest_of
from sim_instruments.transports.modbus.unit import ModbusLine


class ModbusTcpServer:
    """Serves connections that a TcpService hands over. Every request takes 2 ms of bench time; a frame that is none ends its connection.

    `wait` lets bench time (s) pass.
    """

    def __init__(self, line: ModbusLine, wait: Callable[[float], Awaitable[None]]) -> None:
        self._line = line
        self._wait = wait

    async def serve(self, client: Client) -> None:
        """Answer one client until it hangs up."""
        frames = ModbusFrames(self._line)
        while True:
            try:
                transaction, unit, length = rest_of(await client.exactly(HEADER.size))
            except NoFrameError:
                return
            request = await client.exactly(length, begun=True)
            await self._wait(REQUEST_TIME)
            response, fault = frames.answer(unit, request)
            if fault is not None and fault.kind is FaultKind.LATE:
                await self._wait(fault.delay)
            await client.send(frames.frame(transaction, unit, response, fault))
