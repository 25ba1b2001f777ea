"""Modbus RTU and ASCII: units on a serial line, a pseudo-terminal served by a thread."""

import math
import os
import select
import struct
import threading
import time

from pymodbus.exceptions import ModbusIOException
from pymodbus.framer import FramerAscii, FramerRTU
from pymodbus.pdu import DecodePDU, ModbusPDU

from sim_instruments.faults.line_faults import FaultKind, spoil
from sim_instruments.transports.modbus.faults import shown_unit
from sim_instruments.transports.modbus.frames import ModbusFrames
from sim_instruments.transports.modbus.unit import ModbusLine
from sim_instruments.transports.serial.pty import PseudoTerminal

_BITS_PER_CHARACTER = 11
# Of a client that has set a rate without a name.
_USUAL_RATE = 9600
_ASCII_START = b":"
_SILENT_CHARACTERS = 3.5
_TURNAROUND = 5.0e-3
# A frame that stays incomplete for so long in real time is given up, as a silent interval would end it.
_FRAME_TIMEOUT = 0.05
_STOP_TIMEOUT = 10.0


class ModbusRtuEndpoint:
    """Serves a line of units until it is closed; a request takes the virtual time that its bytes take on the wire.

    A unit that needs silence on the line before a request in RTU, its `silence` (s) in bench time or in the wall's, hears none without;
    one with a `framing` hears none that comes at another rate, parity or kind of frame. Of the client's settings a pseudo-terminal shows
    the rate and odd parity.
    While the line's cable is out nothing gets through, and nobody is told: that is how serial lines are.
    """

    def __init__(self, line: ModbusLine) -> None:
        self._line = line
        self._frames = ModbusFrames(line)
        self._last = (-math.inf, -math.inf)
        self._terminal = PseudoTerminal()
        self._rtu, self._ascii = FramerRTU(DecodePDU(True)), FramerAscii(DecodePDU(True))
        self._wake, self._waker = os.pipe()
        self._thread = threading.Thread(target=self._serve, name="modbus-rtu", daemon=True)
        self._thread.start()

    @property
    def address(self) -> str:
        """Address of the endpoint, rtu:// and the path of the serial port."""
        return f"rtu://{self._terminal.path}"

    def close(self) -> None:
        """Stop serving, wait for the thread and close the line; again is allowed."""
        if self._waker < 0:
            return
        os.write(self._waker, b"\0")
        self._thread.join(_STOP_TIMEOUT)
        for descriptor in (self._wake, self._waker):
            os.close(descriptor)
        self._wake = self._waker = -1
        self._terminal.close()

    def _serve(self) -> None:
        buffer = b""
        while True:
            ready, _, _ = select.select([self._terminal.master, self._wake], [], [], _FRAME_TIMEOUT if buffer else None)
            if self._wake in ready:
                return
            buffer = buffer + self._terminal.receive() if ready else b""
            framer = self._framer_for(buffer)
            used, pdu = self._decode(framer, buffer) if buffer else (0, None)
            if pdu is not None:
                self._answer(pdu, used, framer)
            buffer = buffer[used:]

    def _framer_for(self, buffer: bytes) -> FramerRTU | FramerAscii:
        framings = (self._line.framing_of(unit) for unit in self._line.units)
        listened = any(framing is not None and framing.ascii for framing in framings)
        return self._ascii if listened and buffer.startswith(_ASCII_START) else self._rtu

    def _decode(self, framer: FramerRTU | FramerAscii, buffer: bytes) -> tuple[int, ModbusPDU | None]:
        try:
            return framer.handleFrame(buffer, 0, 0)
        except (ModbusIOException, ValueError, struct.error):
            # A frame with a good checksum that is no request: a slave keeps silent.
            return len(buffer), None

    def _answer(self, request: ModbusPDU, length: int, framer: FramerRTU | FramerAscii) -> None:
        unit = request.dev_id
        silent = max(now - last for now, last in zip(self._times(), self._last, strict=True))
        self._last = self._times()
        if unit not in self._line.units or not self._line.connection.up:
            return
        in_ascii, rate, framing = framer is self._ascii, self._terminal.rate, self._line.framing_of(unit)
        if framing is not None and not framing.hears(rate, odd=self._terminal.odd_parity, in_ascii=in_ascii):
            return
        needed = getattr(self._line.units[unit], "silence", 0.0)
        if needed and silent <= needed and not in_ascii:
            return
        response, fault = self._frames.answer(
            unit, bytes([request.function_code]) + request.encode(), in_ascii=in_ascii
        )
        reply = framer.encode(response, shown_unit(unit, fault), 0) if response else b""
        characters = length + len(reply) + 2.0 * _SILENT_CHARACTERS
        # The client is blocked until it has its reply, so sleeping here is sleeping on its behalf.
        self._line.clock.sleep(characters * _BITS_PER_CHARACTER / (rate or _USUAL_RATE) + _TURNAROUND)
        if fault is not None and fault.kind is FaultKind.LATE:
            self._line.clock.sleep(fault.delay)
        self._last = self._times()
        self._terminal.send(reply if fault is None else spoil(fault, reply, self._line.generator))

    def _times(self) -> tuple[float, float]:
        return self._line.clock.now(), time.monotonic()
