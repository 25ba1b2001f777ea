"""What each transport's instruments are reached by from other processes: ports, pseudo-terminals, a CAN gateway."""

import asyncio
import itertools
from contextlib import ExitStack

import numpy as np

from sim_instruments.clock.paced_clock import PacedClock
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.session import ClientSession
from sim_instruments.transports.can.gateway import CanGateway
from sim_instruments.transports.connection import Connection
from sim_instruments.transports.conversation import Conversation
from sim_instruments.transports.hislip.server import HislipServer
from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.modbus.rtu import ModbusRtuEndpoint
from sim_instruments.transports.modbus.server import ModbusTcpServer
from sim_instruments.transports.modbus.unit import ModbusLine
from sim_instruments.transports.scpi_socket import ScpiSocket
from sim_instruments.transports.tcp_service import Serve, TcpService

LOOPBACK = "127.0.0.1"
#: How often (s) those who follow the time are told of it.
_PULSE = 0.01
_MOST_CONNECTIONS = 64


class Endpoints:
    """Opens endpoints on a loop's thread, each of which `leaving` closes.

    TCP ports listen on `host`, one after the other from `base_port` on where that is given. Coroutines run on the loop. Raise OSError
    where a port or a terminal cannot be had.
    """

    def __init__(
        self, loop: LoopThread, clock: PacedClock, leaving: ExitStack, host: str, base_port: int | None, seed: int
    ) -> None:
        self._loop = loop
        self._clock = clock
        self._leaving = leaving
        self._host = host
        self._ports = itertools.repeat(0) if base_port is None else itertools.count(base_port)
        self._seed = seed
        self._clients = 0

    async def scpi(self, instrument: ScpiInstrument) -> dict[str, str]:
        """Serve an instrument over HiSLIP and a raw socket; return its addresses by way."""

        def converse() -> Conversation:
            self._clients += 1
            generator = np.random.default_rng((self._seed, 0x50C4, self._clients))
            return Conversation(ClientSession(instrument, generator), self._clock)

        socket = await self.listen(ScpiSocket(converse).serve, connection=instrument.connection)
        hislip = await self.listen(HislipServer(converse).serve, connection=instrument.connection)
        return {
            "hislip": f"TCPIP0::{self._host}::hislip0,{hislip.port}::INSTR",
            "socket": f"TCPIP0::{self._host}::{socket.port}::SOCKET",
        }

    async def modbus(self, line: ModbusLine) -> dict[str, str]:
        """Serve a line of units over TCP and a pseudo-terminal; return its addresses by way."""
        tcp = await self.modbus_tcp(line)
        rtu = ModbusRtuEndpoint(line)
        self._leaving.callback(rtu.close)
        return {"tcp": tcp, "rtu": rtu.address}

    async def modbus_tcp(self, line: ModbusLine) -> str:
        """Serve a line of units over TCP only; return its address."""
        tcp = await self.listen(ModbusTcpServer(line, self._wait).serve, connection=line.connection)
        return f"tcp://{self._host}:{tcp.port}"

    async def can(self, channel: str) -> dict[str, str]:
        """Serve a CAN bus; return python-can's interface and channel of it."""
        gateway = CanGateway(channel)
        await gateway.start()
        self._leaving.callback(lambda: self._loop.run(gateway.stop()))
        tcp = await self.listen(gateway.serve)
        return {"interface": "slcan", "channel": f"socket://{self._host}:{tcp.port}"}

    async def listen(self, serve: Serve, host: str = "", connection: Connection | None = None) -> TcpService:
        """Listen on the next port, of another `host` where one is given."""
        service = TcpService(serve, host or self._host, most_clients=_MOST_CONNECTIONS, connection=connection)
        await service.start(next(self._ports))
        self._leaving.callback(lambda: self._loop.run(service.stop()))
        return service

    async def begin_pulse(self) -> None:
        """Begin to tell those who follow the time of it."""
        self._beat = asyncio.get_running_loop().create_task(self._pulse())

    async def _pulse(self) -> None:
        while True:
            # Instruments are served by this thread alone, so what follows the time is told of it here, too.
            self._clock.pulse()
            await asyncio.sleep(_PULSE)

    async def _wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds / self._clock.speedup)
