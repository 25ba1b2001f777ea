"""Effects of a faulty line on Modbus responses (Application Protocol, V1.1b3), before they are put into frames."""

import struct

from sim_instruments.faults.line_faults import Fault, FaultKind
from sim_instruments.instruments.registers import RegisterDevice

_READ = 3
_HIGHEST_UNIT = 247


class ReplyFaults:
    """The faults of one client's responses; what is one behind stays so until its connection ends."""

    def __init__(self) -> None:
        self._held: bytes | None = None

    def altered(
        self, fault: Fault | None, device: RegisterDevice, request: str, address: int, response: bytes
    ) -> bytes:
        """Return what comes of a response to a request for registers from `address` on; nothing where it is held back."""
        match fault.kind if fault is not None else None:
            case FaultKind.FROZEN if fault is not None:
                response = fault.remembered(request, response)
            case (FaultKind.NOT_A_NUMBER | FaultKind.OVERFLOW) as kind if response[0] == _READ:
                response = _without_readings(kind, device, address, response)
            case FaultKind.STALE if self._held is None:
                self._held = response
                return b""
        if self._held is not None:
            response, self._held = self._held, response
        return response


def shown_unit(unit: int, fault: Fault | None) -> int:
    """Return the unit identifier that a response bears."""
    return unit % _HIGHEST_UNIT + 1 if fault is not None and fault.kind is FaultKind.WRONG_UNIT else unit


def _without_readings(kind: FaultKind, device: RegisterDevice, address: int, response: bytes) -> bytes:
    """Return the response with each reading the largest number, or the one of which there is no positive counterpart."""
    first, count, words = device.readings
    registers = list(struct.unpack(f"!{response[1] // 2}H", response[2:]))
    bits = 16 * words
    value = 1 << (bits - 1) if kind is FaultKind.NOT_A_NUMBER else (1 << (bits - 1)) - 1
    for place in range(len(registers)):
        offset = address + place - first
        if 0 <= offset < count:
            registers[place] = value >> (bits - 16 * (offset % words + 1)) & 0xFFFF
    return response[:2] + struct.pack(f"!{len(registers)}H", *registers)
