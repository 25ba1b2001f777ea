"""Modbus TCP frames in process: what a client writes is answered before its call returns."""

from sim_instruments.faults.line_faults import FaultKind
from sim_instruments.transports.modbus.frames import HEADER, REQUEST_TIME, ModbusFrames, NoFrameError, rest_of
from sim_instruments.transports.modbus.unit import ModbusLine


class ModbusStream:
    """One client's connection to a line of units, which the line's cable ends. Every request takes 2 ms of bench time.

    Raises ConnectionError where the cable is out.
    """

    def __init__(self, line: ModbusLine) -> None:
        self._cable, self._pulled = line.connection, line.connection.pulled
        self._check()
        self._clock = line.clock
        self._frames = ModbusFrames(line)
        self._requests = b""
        self._replies = b""

    def write(self, data: bytes) -> int:
        """Take bytes, answer the requests that are complete, and return how many bytes were taken.

        Raises ConnectionError once the cable has been pulled out.
        """
        self._check()
        self._requests += data
        while (frame := self._next()) is not None:
            transaction, unit, request = frame
            self._clock.sleep(REQUEST_TIME)
            response, fault = self._frames.answer(unit, request)
            if fault is not None and fault.kind is FaultKind.LATE:
                self._clock.sleep(fault.delay)
            self._replies += self._frames.frame(transaction, unit, response, fault)
        return len(data)

    def read(self, count: int, timeout: float) -> bytes:
        """Return up to `count` bytes of what has been answered, nothing once `timeout` (s, bench) has passed without.

        Raises ConnectionError once the cable has been pulled out.
        """
        self._check()
        if not self._replies:
            self._clock.sleep(timeout)
        data, self._replies = self._replies[:count], self._replies[count:]
        return data

    def reset_input_buffer(self) -> None:
        """Throw away what has not been read yet."""
        self._replies = b""

    def close(self) -> None:
        """Forget what is under way; again is allowed."""
        self._requests = self._replies = b""

    def _check(self) -> None:
        if not self._cable.up or self._cable.pulled != self._pulled:
            raise ConnectionResetError("the connection is gone")

    def _next(self) -> tuple[int, int, bytes] | None:
        if len(self._requests) < HEADER.size:
            return None
        try:
            transaction, unit, length = rest_of(self._requests[: HEADER.size])
        except NoFrameError:
            self.close()
            return None
        end = HEADER.size + length
        if len(self._requests) < end:
            return None
        request, self._requests = self._requests[HEADER.size : end], self._requests[end:]
        return transaction, unit, request
