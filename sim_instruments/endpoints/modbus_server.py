"""Modbus TCP for several clients at once, in an event loop (MODBUS Messaging on TCP/IP, V1.0b; Application Protocol, V1.1b3)."""

import asyncio
import struct

from sim_instruments.endpoints.modbus_unit import ModbusLine
from sim_instruments.faults import Fault, FaultKind, spoil
from sim_instruments.instruments.registers import RegisterError
from sim_instruments.paced_clock import PacedClock

_HEADER = struct.Struct("!HHHB")
_LONGEST, _SHORTEST = 254, 2
_REQUEST_TIME = 2.0e-3
_READ, _WRITE_SINGLE, _WRITE = 3, 6, 16
_ILLEGAL_FUNCTION, _ILLEGAL_VALUE, _NO_SUCH_UNIT = 1, 3, 11
_MOST_READ, _MOST_WRITTEN = 125, 123


class _RefusedError(Exception):
    """A request that is answered by an exception code."""

    def __init__(self, code: int) -> None:
        self.code = code
        super().__init__(f"exception {code}")


class ModbusTcpServer:
    """Serves connections that a TcpService hands over. Every request takes 2 ms of bench time; a frame that is none ends its connection."""

    def __init__(self, line: ModbusLine, clock: PacedClock) -> None:
        self._line = line
        self._clock = clock

    async def serve(self, reader: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        """Answer one client until it hangs up."""
        while True:
            transaction, protocol, length, unit = _HEADER.unpack(await reader.readexactly(_HEADER.size))
            if protocol != 0 or not _SHORTEST <= length <= _LONGEST:
                return
            request = await reader.readexactly(length - 1)
            await self._wait(_REQUEST_TIME)
            response, fault = self._answer(unit, request)
            if fault is not None and fault.kind is FaultKind.LATE:
                await self._wait(fault.delay)
            frame = _HEADER.pack(transaction, 0, len(response) + 1, unit) + response
            writer.write(frame if fault is None else self._spoilt(fault, frame))
            await writer.drain()

    async def _wait(self, seconds: float) -> None:
        await asyncio.sleep(seconds / self._clock.speedup)

    def _answer(self, unit: int, request: bytes) -> tuple[bytes, Fault | None]:
        function = request[0]
        try:
            if unit not in self._line.units:
                raise _RefusedError(_NO_SUCH_UNIT)  # noqa: TRY301  one place makes exceptions of refusals
            return self._execute(unit, function, request[1:])
        except (_RefusedError, RegisterError) as refusal:
            return bytes([function | 0x80, refusal.code]), None

    def _execute(self, unit: int, function: int, data: bytes) -> tuple[bytes, Fault | None]:
        device = self._line.units[unit]
        if function not in (_READ, _WRITE_SINGLE, _WRITE):
            raise _RefusedError(_ILLEGAL_FUNCTION)
        if len(data) < 4 or (function != _WRITE and len(data) != 4):
            raise _RefusedError(_ILLEGAL_VALUE)
        address, number = struct.unpack("!HH", data[:4])
        if function == _READ:
            if not 1 <= number <= _MOST_READ:
                raise _RefusedError(_ILLEGAL_VALUE)
            fault = self._line.fault("read", unit, address, number)
            registers = device.read(address, number)
            return struct.pack(f"!BB{number}H", function, 2 * number, *registers), fault
        values = [number] if function == _WRITE_SINGLE else _written(number, data[4:])
        fault = self._line.fault("write", unit, address, len(values))
        device.write(address, values)
        return bytes([function]) + data[:4], fault

    def _spoilt(self, fault: Fault, frame: bytes) -> bytes:
        spoilt = spoil(fault, frame, self._line.generator)
        # The header stays in garbage, or the client would wait for its own reply without looking.
        return frame[: _HEADER.size] + spoilt[_HEADER.size :] if fault.kind is FaultKind.GARBAGE else spoilt


def _written(count: int, data: bytes) -> list[int]:
    if not 1 <= count <= _MOST_WRITTEN or len(data) != 1 + 2 * count or data[0] != 2 * count:
        raise _RefusedError(_ILLEGAL_VALUE)
    return list(struct.unpack(f"!{count}H", data[1:]))
