"""Modbus TCP: units on a port of the loopback interface, served by a thread of their own."""

import asyncio
import threading
from collections.abc import Callable
from typing import Any

from pymodbus.constants import ExcCodes
from pymodbus.server import ModbusTcpServer
from pymodbus.server.base import ModbusBaseServer
from pymodbus.simulator import DataType, SimData, SimDevice

from sim_instruments.endpoints.modbus_unit import ModbusLine
from sim_instruments.faults import Fault, FaultKind, spoil
from sim_instruments.instruments.registers import RegisterDevice, RegisterError

_REQUEST_TIME = 2.0e-3
_START_TIMEOUT = 10.0
_WRITE_SINGLE = 6


class ModbusTcpEndpoint:
    """Serves a line of units until it is closed. Every request takes 2 ms of virtual time."""

    def __init__(self, line: ModbusLine, *, host: str = "127.0.0.1", port: int = 0) -> None:
        self._line = line
        self._host = host
        self._port = port
        self._fault: Fault | None = None
        self._ready = threading.Event()
        self._failure: BaseException | None = None
        self._stop: Callable[[], object] | None = None
        self._thread = threading.Thread(target=self._serve, name="modbus-tcp", daemon=True)
        self._thread.start()
        if not self._ready.wait(_START_TIMEOUT) or self._failure is not None:
            raise RuntimeError(f"Modbus TCP server on {host}:{port} did not start") from self._failure

    @property
    def address(self) -> str:
        """Address of the endpoint, tcp://host:port."""
        return f"tcp://{self._host}:{self._port}"

    def close(self) -> None:
        """Stop serving and wait for the thread; again is allowed."""
        if self._stop is not None:
            stop, self._stop = self._stop, None
            stop()
        self._thread.join(_START_TIMEOUT)

    def _serve(self) -> None:
        try:
            asyncio.run(self._main())
        except OSError as error:
            self._failure = error
            self._ready.set()

    async def _main(self) -> None:
        loop = asyncio.get_running_loop()
        stopping = asyncio.Event()
        server: Any = ModbusTcpServer(
            [_device(unit, self._act) for unit in self._line.units.values()],
            address=(self._host, self._port),
            trace_packet=self._trace,
        )
        if not await server.listen():
            self._failure = OSError(f"cannot listen on {self._host}:{self._port}")
            self._ready.set()
            return
        self._port = _bound_port(server.transport)
        self._stop = lambda: loop.call_soon_threadsafe(stopping.set)
        self._ready.set()
        try:
            await stopping.wait()
        finally:
            await server.shutdown()
            # Connections that are being closed need a turn of the loop to say so.
            await asyncio.sleep(0)
            ModbusBaseServer.active_server = None

    async def _act(
        self,
        unit: RegisterDevice,
        function: int,
        start: int,
        address: int,
        count: int,
        registers: list[int],
        values: list[Any] | None,
    ) -> ExcCodes | None:
        if function == _WRITE_SINGLE and values is None:
            # The server reads back what it has just written, to echo it.
            return None
        line = self._line
        # The client is blocked until it has its reply, so sleeping here is sleeping on its behalf.
        line.clock.sleep(_REQUEST_TIME)
        self._fault = line.strike("read" if values is None else "write", unit.unit, address, count)
        try:
            if values is None:
                registers[address - start : address - start + count] = unit.read(address, count)
            else:
                unit.write(address, [int(value) for value in values])
        except RegisterError as error:
            return ExcCodes(error.code)
        return None

    def _trace(self, sending: bool, data: bytes) -> bytes:
        if not sending or self._fault is None:
            return data
        fault, self._fault = self._fault, None
        reply = spoil(fault, data, self._line.generator)
        if fault.kind is FaultKind.GARBAGE:
            # The transaction identifier stays, or the client would wait for its own reply without looking.
            return data[:7] + reply[7:]
        return reply


def _device(unit: RegisterDevice, act: Callable[..., Any]) -> SimDevice:
    async def action(
        function: int, start: int, address: int, count: int, registers: list[int], values: list[Any] | None
    ) -> ExcCodes | None:
        result = await act(unit, function, start, address, count, registers, values)
        return result if isinstance(result, ExcCodes) else None

    blocks = [SimData(start, values=[0] * count, datatype=DataType.REGISTERS) for start, count in unit.ranges]
    return SimDevice(unit.unit, simdata=blocks, action=action)


def _bound_port(transport: Any) -> int:
    return int(transport.sockets[0].getsockname()[1])
