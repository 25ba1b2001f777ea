"""Requests in Modbus TCP frames and the answers to them, whatever carries the bytes (Application Protocol, V1.1b3)."""

import struct

from sim_instruments.faults.line_faults import Fault, FaultKind, spoil
from sim_instruments.instruments.registers import BitDevice, NoAnswerError, OutputDevice, RegisterError
from sim_instruments.transports.modbus.faults import ReplyFaults, shown_unit
from sim_instruments.transports.modbus.unit import ModbusLine

#: MBAP header: transaction, protocol, length of what follows the length, unit.
HEADER = struct.Struct("!HHHB")
#: Bench time (s) that a request takes.
REQUEST_TIME = 2.0e-3
_LONGEST, _SHORTEST = 254, 2
_READ_BITS = (1, 2)
_READ, _WRITE_COIL, _WRITE_SINGLE, _WRITE = 3, 5, 6, 16
#: What a coil is written by.
_COIL_VALUES = {0xFF00: True, 0x0000: False}
_ILLEGAL_FUNCTION, _ILLEGAL_VALUE, _NO_SUCH_UNIT = 1, 3, 11
_MOST_READ, _MOST_WRITTEN, _MOST_BITS = 125, 123, 2000


class _RefusedError(Exception):
    """A request that is answered by an exception code."""

    def __init__(self, code: int) -> None:
        self.code = code
        super().__init__(f"exception {code}")


class NoFrameError(Exception):
    """Bytes that are no Modbus TCP frame."""


def rest_of(header: bytes) -> tuple[int, int, int]:
    """Return transaction, unit and how many bytes of request follow a header. Raises NoFrameError."""
    transaction, protocol, length, unit = HEADER.unpack(header)
    if protocol != 0 or not _SHORTEST <= length <= _LONGEST:
        raise NoFrameError(header.hex(" "))
    return transaction, unit, length - 1


class ModbusFrames:
    """Answers one client's requests to a line of units."""

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._replies = ReplyFaults()

    def answer(self, unit: int, request: bytes, *, in_ascii: bool = False) -> tuple[bytes, Fault | None]:
        """Return the response to a request, empty where none comes, and the fault that is to strike its frame.

        `in_ascii` says that it came in ASCII frames; what speaks TCP to a line speaks RTU on it.
        """
        function = request[0]
        try:
            if (result := self._line.recorded(unit, request)) is not None:
                return result
            if unit not in self._line.units:
                raise _RefusedError(_NO_SUCH_UNIT)  # noqa: TRY301  one place makes exceptions of refusals
            framing = self._line.framing_of(unit)
            if framing is not None and framing.ascii != in_ascii:
                raise NoAnswerError  # noqa: TRY301  likewise
            return self._execute(unit, function, request[1:])
        except (_RefusedError, RegisterError) as refusal:
            return bytes([function | 0x80, refusal.code]), None
        except NoAnswerError:
            return b"", None

    def frame(self, transaction: int, unit: int, response: bytes, fault: Fault | None) -> bytes:
        """Return the frame of a response, or what a fault leaves of it."""
        if not response:
            return b""
        whole = HEADER.pack(transaction, 0, len(response) + 1, shown_unit(unit, fault)) + response
        if fault is None:
            return whole
        spoilt = spoil(fault, whole, self._line.generator)
        # The header stays in garbage, or the client would wait for its own reply without looking.
        return whole[: HEADER.size] + spoilt[HEADER.size :] if fault.kind is FaultKind.GARBAGE else spoilt

    def _execute(self, unit: int, function: int, data: bytes) -> tuple[bytes, Fault | None]:
        device = self._line.units[unit]
        if function in _READ_BITS and isinstance(device, BitDevice):
            return self._bits(device, unit, function, data)
        if function == _WRITE_COIL and isinstance(device, OutputDevice):
            return self._coil(device, unit, data)
        if function not in (_READ, _WRITE_SINGLE, _WRITE):
            raise _RefusedError(_ILLEGAL_FUNCTION)
        if len(data) < 4 or (function != _WRITE and len(data) != 4):
            raise _RefusedError(_ILLEGAL_VALUE)
        address, number = struct.unpack("!HH", data[:4])
        if function == _READ:
            if not 1 <= number <= _MOST_READ:
                raise _RefusedError(_ILLEGAL_VALUE)
            fault, description = self._struck("read", unit, address, number)
            registers = device.read(address, number)
            response = struct.pack(f"!BB{number}H", function, 2 * number, *registers)
        else:
            values = [number] if function == _WRITE_SINGLE else _written(number, data[4:])
            fault, description = self._struck("write", unit, address, len(values))
            device.write(address, values)
            response = bytes([function]) + data[:4]
        return self._replies.altered(fault, device, description, address, response), fault

    def _bits(self, device: BitDevice, unit: int, function: int, data: bytes) -> tuple[bytes, Fault | None]:
        if len(data) != 4:
            raise _RefusedError(_ILLEGAL_VALUE)
        address, number = struct.unpack("!HH", data)
        if not 1 <= number <= _MOST_BITS:
            raise _RefusedError(_ILLEGAL_VALUE)
        fault, _ = self._struck("read", unit, address, number)
        packed = sum(bit << place for place, bit in enumerate(device.read_bits(address, number)))
        content = packed.to_bytes((number + 7) // 8, "little")
        return bytes([function, len(content)]) + content, fault

    def _coil(self, device: OutputDevice, unit: int, data: bytes) -> tuple[bytes, Fault | None]:
        if len(data) != 4:
            raise _RefusedError(_ILLEGAL_VALUE)
        address, value = struct.unpack("!HH", data)
        if value not in _COIL_VALUES:
            raise _RefusedError(_ILLEGAL_VALUE)
        fault, _ = self._struck("write", unit, address, 1)
        device.write_bit(address, _COIL_VALUES[value])
        return bytes([_WRITE_COIL]) + data, fault

    def _struck(self, verb: str, unit: int, address: int, count: int) -> tuple[Fault | None, str]:
        """Return the fault that strikes a request, and the request in words; one that refuses it does so."""
        if not self._line.faults:
            return None, ""
        description = f"{verb} {unit} {address:04X}H {count}"
        fault = self._line.faults.strike(description)
        if fault is not None and fault.kind is FaultKind.EXCEPTION:
            raise _RefusedError(fault.code)
        return fault, description


def _written(count: int, data: bytes) -> list[int]:
    if not 1 <= count <= _MOST_WRITTEN or len(data) != 1 + 2 * count or data[0] != 2 * count:
        raise _RefusedError(_ILLEGAL_VALUE)
    return list(struct.unpack(f"!{count}H", data[1:]))
