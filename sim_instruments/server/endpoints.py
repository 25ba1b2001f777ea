"""The endpoints at which other processes reach each transport's instruments: ports, pseudo-terminals, a CAN gateway."""

import asyncio
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass

import numpy as np

from sim_instruments.clock.paced_clock import PacedClock
from sim_instruments.scpi.instrument import ScpiInstrument
from sim_instruments.scpi.session import ClientSession
from sim_instruments.server.port_plan import PortError, PortPlan
from sim_instruments.transports.can.fdcanusb_line import FdcanusbLine
from sim_instruments.transports.can.gateway import CanGateway
from sim_instruments.transports.client import Patience
from sim_instruments.transports.connection import Connection
from sim_instruments.transports.conversation import Conversation
from sim_instruments.transports.hislip.locks import Locks
from sim_instruments.transports.hislip.server import HislipServer
from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.modbus.rtu import ModbusRtuEndpoint
from sim_instruments.transports.modbus.tcp import ModbusTcpServer
from sim_instruments.transports.modbus.unit import ModbusLine
from sim_instruments.transports.scpi_socket import ScpiSocket
from sim_instruments.transports.tcp_service import Serve, TcpService
from sim_instruments.transports.vxi11.server import Vxi11Server

LOOPBACK = "127.0.0.1"
#: How long a client is waited for.
PATIENT = Patience()
#: How often (s) those who follow the time are told of it.
_PULSE = 0.01
_MOST_CONNECTIONS = 64


@dataclass(frozen=True)
class RefusedClient:
    """A client that was hung up on at an `endpoint` (name and way), because `most` are served at once."""

    endpoint: tuple[str, str]
    most: int


class Endpoints:
    """Opens endpoints on one loop's thread, each of which `leaving` closes.

    TCP ports listen on `host`, each at its port of the plan by name and way. What opens runs on the caller's thread and waits for the
    loop's. `refused` is told of clients that are too many. Raises PortError for a port, OSError for a terminal that cannot be had.
    """

    def __init__(
        self,
        loop: LoopThread,
        clock: PacedClock,
        leaving: ExitStack,
        host: str,
        ports: PortPlan,
        *,
        patience: Patience = PATIENT,
        seed: int = 0,
        refused: Callable[[RefusedClient], None] = lambda _: None,
    ) -> None:
        self._refused = refused
        self._loop = loop
        self._clock = clock
        self._leaving = leaving
        self._host = host
        self._ports = ports
        self._patience = patience
        self._seed = seed
        self._clients = 0
        self._scpi: list[ScpiInstrument] = []

    def scpi(self, name: str, instrument: ScpiInstrument) -> dict[str, str]:
        """Serve an instrument over HiSLIP, a raw socket and VXI-11; return its addresses by way."""

        def converse() -> Conversation:
            self._clients += 1
            generator = np.random.default_rng((self._seed, 0x50C4, self._clients))
            return Conversation(ClientSession(instrument, generator), self._clock)

        self._scpi.append(instrument)
        socket = self.listen((name, "socket"), ScpiSocket(converse).serve, connection=instrument.connection)
        locks = Locks()
        hislip = self.listen((name, "hislip"), HislipServer(converse, locks).serve, connection=instrument.connection)
        vxi11 = Vxi11Server(converse, locks)
        vxi11.port = self.listen((name, "vxi11"), vxi11.serve, connection=instrument.connection).port
        return {
            "hislip": f"TCPIP0::{self._host}::hislip0,{hislip.port}::INSTR",
            "socket": f"TCPIP0::{self._host}::{socket.port}::SOCKET",
            # No portmapper names the port: PyVISA-py takes it behind the host.
            "vxi11": f"TCPIP0::{self._host},{vxi11.port}::inst0::INSTR",
        }

    def modbus(self, name: str, line: ModbusLine) -> dict[str, str]:
        """Serve a line of units over TCP and a pseudo-terminal; return its addresses by way."""
        tcp = self.modbus_tcp(name, line)
        rtu = ModbusRtuEndpoint(line)
        self._leaving.callback(rtu.close)
        return {"tcp": tcp, "rtu": rtu.address}

    def modbus_tcp(self, name: str, line: ModbusLine) -> str:
        """Serve a line of units over TCP only; return its address."""
        tcp = self.listen((name, "tcp"), ModbusTcpServer(line, self._wait).serve, connection=line.connection)
        return f"tcp://{self._host}:{tcp.port}"

    def can(self, channel: str) -> dict[str, str]:
        """Serve a CAN bus; return python-can's interface and channel of it."""
        gateway = CanGateway(channel)
        self._loop.run(gateway.start())
        self._leaving.callback(lambda: self._loop.run(gateway.stop()))
        tcp = self.listen(("can", "tcp"), gateway.serve)
        return {"interface": "slcan", "channel": f"socket://{self._host}:{tcp.port}"}

    def fdcanusb(self, channel: str) -> str:
        """Serve a CAN bus by an fdcanusb adapter at a pseudo-terminal; return its path."""
        line = FdcanusbLine(channel)
        self._loop.run(line.start())
        self._leaving.callback(lambda: self._loop.run(line.stop()))
        return line.address

    def listen(
        self,
        endpoint: tuple[str, str],
        serve: Serve,
        *,
        host: str = "",
        connection: Connection | None = None,
        patience: Patience | None = None,
    ) -> TcpService:
        """Listen at an endpoint's port, of another `host` and with another `patience` where they are given."""
        service = TcpService(
            serve,
            host or self._host,
            most_clients=_MOST_CONNECTIONS,
            connection=connection,
            patience=patience or self._patience,
            refused=lambda: self._refused(RefusedClient(endpoint, _MOST_CONNECTIONS)),
        )
        port = self._ports.take(*endpoint)
        try:
            self._loop.run(service.start(port))
        except OSError as error:
            raise PortError(endpoint, host or self._host, port, error) from error
        self._leaving.callback(lambda: self._loop.run(service.stop()))
        return service

    def begin_pulse(self) -> None:
        """Begin to tell those who follow the time of it."""
        self._loop.run(self._begin_pulse())

    async def _begin_pulse(self) -> None:
        self._beat = asyncio.get_running_loop().create_task(self._pulse())

    async def _pulse(self) -> None:
        now = asyncio.get_running_loop().time
        while True:
            until, behind = now() + _PULSE, False
            for instrument in self._scpi:
                while (more := instrument.catch_up()) and now() < until:
                    await asyncio.sleep(0)
                behind = behind or more
            # Instruments are served by this thread alone, so what follows the time is told of it here, too.
            self._clock.pulse(behind=behind)
            await asyncio.sleep(0.0 if behind else _PULSE)

    async def _wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds / self._clock.speedup)
