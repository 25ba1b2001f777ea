"""Modbus TCP for several clients at once, in an event loop (MODBUS Messaging on TCP/IP, V1.0b)."""

import asyncio

from sim_instruments.endpoints.modbus_frames import HEADER, REQUEST_TIME, ModbusFrames, NoFrameError, rest_of
from sim_instruments.endpoints.modbus_unit import ModbusLine
from sim_instruments.faults import FaultKind
from sim_instruments.paced_clock import PacedClock


class ModbusTcpServer:
    """Serves connections that a TcpService hands over. Every request takes 2 ms of bench time; a frame that is none ends its connection."""

    def __init__(self, line: ModbusLine, clock: PacedClock) -> None:
        self._frames = ModbusFrames(line)
        self._clock = clock

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one client until it hangs up."""
        while True:
            try:
                transaction, unit, length = rest_of(await reader.readexactly(HEADER.size))
            except NoFrameError:
                return
            request = await reader.readexactly(length)
            await self._wait(REQUEST_TIME)
            response, fault = self._frames.answer(unit, request)
            if fault is not None and fault.kind is FaultKind.LATE:
                await self._wait(fault.delay)
            writer.write(self._frames.frame(transaction, unit, response, fault))
            await writer.drain()

    async def _wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds / self._clock.speedup)
