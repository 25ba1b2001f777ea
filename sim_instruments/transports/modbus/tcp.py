"""Modbus TCP: units on a port of the loopback interface, for a client in this process."""

from contextlib import ExitStack

from sim_instruments.transports.loop_thread import LoopThread
from sim_instruments.transports.modbus.server import ModbusTcpServer
from sim_instruments.transports.modbus.unit import ModbusLine
from sim_instruments.transports.tcp_service import TcpService


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
