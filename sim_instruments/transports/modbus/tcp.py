"""Modbus TCP (MODBUS Messaging on TCP/IP, V1.0b): several clients at once in an event loop, or units for a client in this process."""

from collections.abc import Awaitable, Callable
from contextlib import ExitStack

from sim_instruments.faults.line_faults import FaultKind
from sim_instruments.transports.client import Client
from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.modbus.frames import HEADER, REQUEST_TIME, ModbusFrames, NoFrameError, rest_of
from sim_instruments.transports.modbus.unit import ModbusLine
from sim_instruments.transports.tcp_service import TcpService


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


class ModbusTcpEndpoint:
    """Serves a line of units from a thread of its own until it is closed. Raises OSError where the port cannot be had."""

    def __init__(self, line: ModbusLine, *, host: str = "127.0.0.1", port: int = 0) -> None:
        self._clock = line.clock
        self._host = host
        self._open = ExitStack()
        loop = LoopThread("modbus-tcp")
        self._open.callback(loop.close)
        self._service = TcpService(ModbusTcpServer(line, self._wait).serve, host, connection=line.connection)
        try:
            loop.run(self._service.start(port))
        except BaseException:
            self._open.close()
            raise
        self._open.callback(lambda: loop.run(self._service.stop()))

    @property
    def address(self) -> str:
        """Address of the endpoint, tcp://host:port."""
        return f"tcp://{self._host}:{self._service.port}"

    def close(self) -> None:
        """Stop serving and wait for the thread; again is allowed."""
        self._open.close()

    async def _wait(self, seconds: float) -> None:
        # The client is blocked until it has its reply, so sleeping here is sleeping on its behalf.
        self._clock.sleep(seconds)
